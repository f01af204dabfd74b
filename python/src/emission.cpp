#include "hardware/emission/emission.h"

#include <exception>

#include <fmt/format.h>

#include "hardware/guard/guard_process.h"
#include "python/src/arrays.h"
#include "python/src/job.h"
#include "python/src/parts.h"
#include "sim/core/errors.h"

namespace touchfield::python {

namespace {

/// Frames of phases and amplitudes, both F x N.
std::vector<Drive> drives_of(nb::handle phases, nb::handle amplitudes, Eigen::Index channels) {
  const Eigen::MatrixXd turns = complex_table(phases, "send: drives").real();
  const Eigen::MatrixXd levels = complex_table(amplitudes, "send: amplitudes").real();
  require_count("send: drives of a frame", turns.cols(), channels, "per channel");
  require_count("send: amplitudes of a frame", levels.cols(), channels, "per channel");
  require_count("send: amplitudes", levels.rows(), turns.rows(), "per frame");
  if (turns.rows() == 0) {
    throw InputError("send: there is no frame to send");
  }
  std::vector<Drive> drives;
  for (Eigen::Index f = 0; f < turns.rows(); ++f) {
    drives.push_back({turns.row(f).transpose(), levels.row(f).transpose()});
  }
  return drives;
}

Values report_dict(const EmissionReport& report) {
  nb::dict values;
  values["link"] = report.link;
  values["device"] = report.device;
  values["transducers"] = report.transducers;
  values["frames"] = report.frames;
  values["rate_hz"] = report.rate;
  values["seconds"] = report.seconds;
  values["level"] = report.level;
  values["modulation"] = report.modulation;
  values["phase_levels"] = report.quantisation.steps.phase_levels;
  values["worst_phase_error_rad"] = report.quantisation.worst_phase_error;
  values["rms_phase_error_rad"] = report.quantisation.rms_phase_error;
  values["drive_loss"] = report.quantisation.worst_drive_loss;
  values["files"] = report.written;
  values["emitted"] = report.emitted;
  values["silent"] = report.silent;
  values["sent"] = report.play.sent;
  values["dropped"] = report.play.dropped;
  values["late"] = report.play.late;
  values["signal"] = report.signal;
  return values;
}

/// Everything but the device; with `guard`, the program and arguments that start one, the emission too, on this
/// thread: in a process made for it (touchfield/_emission.py), which takes its signals.
Values send(const SharedArray& array, const ArrayLike& phases, const ArrayLike& amplitudes, const std::string& to,
            double rate, std::optional<double> seconds, bool repeat, std::optional<double> level, double most_level,
            double most_seconds, std::optional<double> modulation, double depth, bool force,
            const std::vector<std::string>& guard) {
  EmissionPlan plan;
  plan.device.link = to;
  plan.device.replace = force;
  plan.device.frequency = modulation;
  plan.device.depth = depth;
  plan.request = {level, most_level, seconds, most_seconds, rate, repeat};
  plan.array = layout_of(*array);
  plan.must_match = {*array};
  plan.drives = [drives = drives_of(phases, amplitudes, array->size())](const ArrayLayout&) { return drives; };
  if (guard.empty()) {
    return report_dict(computed(0, [plan](Progress&) { return emit(plan); }));
  }
  plan.emit = true;
  plan.guard = guard;
  EmissionReport report;
  {
    const nb::gil_scoped_release released;
    report = emit(plan);
  }
  if (report.failure) {
    std::rethrow_exception(report.failure);
  }
  return report_dict(report);
}

}  // namespace

void add_emission(nb::module_& module) {
  module.attr("_amplitude_rounding") = kAmplitudeRounding;
  const EmissionRequest usual;
  module.def("_send", &send, nb::arg("array"), nb::arg("phases"), nb::arg("amplitudes"), nb::kw_only(),
             nb::arg("to") = DeviceChoice{}.link, nb::arg("rate") = 10.0, nb::arg("seconds") = nb::none(),
             nb::arg("repeat") = usual.repeat, nb::arg("level") = nb::none(), nb::arg("max_level") = usual.most_level,
             nb::arg("max_seconds") = usual.most_seconds, nb::arg("modulation") = nb::none(),
             nb::arg("depth") = DeviceChoice{}.depth, nb::arg("force") = false,
             nb::arg("guard") = std::vector<std::string>());
  module.def(
      "_serve_link",
      [] {
        const nb::gil_scoped_release released;
        run_guard();
      },
      "The process of a guard.");
}

}  // namespace touchfield::python
