#include "apps/commands/emission_text.h"

#include <fmt/format.h>

#include "apps/commands/command_line.h"
#include "apps/commands/device_options.h"
#include "apps/commands/standard_streams.h"
#include "hardware/stop_signals.h"
#include "sim/core/json_text.h"
#include "sim/core/units.h"

namespace touchfield {

namespace {

std::string outcome(const EmissionReport& report) {
  if (report.written > 0) {
    return fmt::format("{} file{} written", report.written, report.written == 1 ? "" : "s");
  }
  if (!report.emitted) {
    return report.dry ? "nothing was sent: a dry run" : "nothing was sent: add --emit to emit sound";
  }
  return fmt::format("{} sent, {} dropped, {} late (at most {:.1f} ms) in {:.2f} s; {}{}", report.play.sent,
                     report.play.dropped, report.play.late, report.play.worst_delay * 1e3, report.play.seconds,
                     report.quiet     ? "the array is quiet"
                     : report.failure ? "ended by an error"
                                      : "stopped by the guard, which says how it left the array",
                     report.quiet && report.read_back ? "; every byte was read back and is equal" : "");
}

std::string gaps_text(const EmissionReport& report) {
  const Gaps& gaps = report.gaps;
  if (gaps.count == 0) {
    return "";
  }
  return fmt::format("  {} gap{} of more than {:g} ms without supervision of the array, the longest {:.0f} ms{}\n",
                     gaps.count, gaps.count == 1 ? "" : "s", 1e3 * kShownGap, 1e3 * gaps.longest,
                     !report.emitted && gaps.longest > kLongestGap ? "; an emission would have stopped there" : "");
}

}  // namespace

std::string describe_emission(const EmissionReport& report) {
  const QuantisationReport& rounding = report.quantisation;
  return fmt::format(
      "{}: {} transducers\n"
      "  {} frame{} at {:g} per second, {:g} s, level {:g}, modulation: {}\n"
      "  {} phase levels: error {:.2f} degrees at worst, {:.2f} rms; loss in drives {:.3f} %\n"
      "  {}\n"
      "{}",
      report.device, report.transducers, report.frames, report.frames == 1 ? "" : "s", report.rate, report.seconds,
      report.level, report.modulation, rounding.steps.phase_levels, rounding.worst_phase_error / kDegree,
      rounding.rms_phase_error / kDegree, 100 * rounding.worst_drive_loss, outcome(report), gaps_text(report));
}

nlohmann::ordered_json emission_json(const EmissionReport& report) {
  const QuantisationReport& rounding = report.quantisation;
  nlohmann::ordered_json json = {{"link", report.link},
                                 {"device", report.device},
                                 {"transducers", report.transducers},
                                 {"frames", report.frames},
                                 {"rate_hz", report.rate},
                                 {"seconds", report.seconds},
                                 {"level", report.level},
                                 {"modulation", report.modulation},
                                 {"phase_levels", rounding.steps.phase_levels},
                                 {"intensity_levels", rounding.steps.intensity_levels},
                                 {"worst_phase_error_rad", rounding.worst_phase_error},
                                 {"rms_phase_error_rad", rounding.rms_phase_error},
                                 {"drive_loss", rounding.worst_drive_loss},
                                 {"files", report.written},
                                 {"emitted", report.emitted},
                                 {"gaps", report.gaps.count},
                                 {"longest_gap_s", report.gaps.longest}};
  if (report.emitted) {
    json["quiet"] = report.quiet;
    json["sent"] = report.play.sent;
    json["dropped"] = report.play.dropped;
    json["late"] = report.play.late;
    json["worst_delay_s"] = report.play.worst_delay;
    json["seconds_played"] = report.play.seconds;
    json["read_back"] = report.read_back;
  }
  return json;
}

int said_exit_code(const EmissionReport& report) {
  if (report.signal == 0) {
    return 0;
  }
  say(fmt::format("touchfield: stopped by {}\n", StopSignals::name(report.signal)));
  return 128 + report.signal;
}

int print_emission(const EmissionReport& report, const CommonFlags& flags, const std::string& heading) {
  const int code = said_exit_code(report);
  if (flags.json) {
    put(json_text(emission_json(report), 2) + "\n");
  } else if (!flags.quiet) {
    put(heading + describe_emission(report));
  }
  if (report.failure) {
    std::rethrow_exception(report.failure);
  }
  return code;
}

}  // namespace touchfield
