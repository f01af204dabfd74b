#include "apps/commands/emission_text.h"

#include <fmt/format.h>

#include "apps/commands/command_line.h"
#include "apps/commands/device_options.h"
#include "apps/commands/standard_streams.h"
#include "hardware/stop_signals.h"

namespace touchfield {

namespace {

std::string outcome(const EmissionReport& report) {
  if (report.written > 0) {
    return fmt::format("{} file{} written", report.written, report.written == 1 ? "" : "s");
  }
  if (!report.emitted) {
    return fmt::format("nothing was sent: {}{}", report.dry ? "a dry run" : "add --emit to emit sound",
                       report.gaps.longest > kLongestGap ? "; an emission would have stopped at the longest gap" : "");
  }
  return report.silent    ? "the array is silent"
         : report.failure ? "ended by an error"
                          : "stopped by the guard, which says how it left the array";
}

}  // namespace

Json emission_value(const EmissionReport& report) {
  const QuantisationReport& rounding = report.quantisation;
  Json value = {{"link", report.link},
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
                {"gaps_begin_at_s", kShownGap},
                {"longest_gap_s", report.gaps.longest}};
  if (report.emitted) {
    value.update({{"silent", report.silent},
                  {"sent", report.play.sent},
                  {"dropped", report.play.dropped},
                  {"late", report.play.late},
                  {"worst_delay_s", report.play.worst_delay},
                  {"seconds_played", report.play.seconds}});
  }
  value["outcome"] = outcome(report);
  return value;
}

int said_exit_code(const EmissionReport& report) {
  if (report.signal == 0) {
    return 0;
  }
  say(fmt::format("touchfield: stopped by {}\n", StopSignals::name(report.signal)));
  return 128 + report.signal;
}

int print_emission(const EmissionReport& report, const CommonFlags& flags, const Json& more) {
  const int code = said_exit_code(report);
  Json value = emission_value(report);
  value.update(more);
  print_value(value, flags);
  if (report.failure) {
    std::rethrow_exception(report.failure);
  }
  return code;
}

}  // namespace touchfield
