#include "hardware/quantise.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/sincos.h"

namespace touchfield {

namespace {

constexpr double kTurn = 2 * std::numbers::pi;
constexpr double kStepSlack = 1e-9;  // of a step: 0.5 * 2 must not fall to 0 by rounding

// Of transducer n; a NaN lies in no range.
void require_range(const std::string& device, const char* what, Eigen::Index n, double value, double least,
                   double most) {
  if (!(value >= least && value <= most)) {
    throw InputError(fmt::format("{}: the {} of transducer {} is {}, it must be >= {:g} and <= {:g}", device, what, n,
                                 value, least, most));
  }
}

std::uint8_t intensity_step(double amplitude, int levels, const std::string& device) {
  const double exact = amplitude * (levels - 1);
  if (levels == 2 && std::abs(exact - std::round(exact)) > kStepSlack) {
    throw InputError(
        fmt::format("{}: it drives a transducer fully or not at all, an amplitude of {:.3g} is not possible. Equal "
                    "amplitudes become 1 with array.level: 1 and a higher target.pressure_pa",
                    device, amplitude));
  }
  return static_cast<std::uint8_t>(std::floor(exact + kStepSlack));
}

}  // namespace

void QuantisationReport::add(const QuantisationReport& other) {
  const double squares = static_cast<double>(count) * rms_phase_error * rms_phase_error +
                         static_cast<double>(other.count) * other.rms_phase_error * other.rms_phase_error;
  count += other.count;
  steps = other.steps;
  rms_phase_error = count > 0 ? std::sqrt(squares / static_cast<double>(count)) : 0;
  worst_phase_error = std::max(worst_phase_error, other.worst_phase_error);
  worst_drive_loss = std::max(worst_drive_loss, other.worst_drive_loss);
}

QuantisedDrive quantise(const Eigen::VectorXd& phases, const Eigen::VectorXd& amplitudes, double level,
                        const DriveSteps& steps, const std::string& device) {
  if (phases.size() != amplitudes.size()) {
    throw InputError(fmt::format("{}: {} phases and {} amplitudes", device, phases.size(), amplitudes.size()));
  }
  if (!(level > 0 && level <= 1)) {
    throw InputError(fmt::format("{}: level = {} must be > 0 and <= 1", device, level));
  }
  QuantisedDrive out;
  out.report.steps = steps;
  double squares = 0;
  double wanted_energy = 0;
  double driven_energy = 0;
  std::complex<double> overlap = 0;
  for (Eigen::Index n = 0; n < phases.size(); ++n) {
    require_range(device, "phase", n, phases(n), -kMostPhase, kMostPhase);
    require_range(device, "amplitude", n, amplitudes(n), 0, 1);
    const double amplitude = level * amplitudes(n);
    out.frame.phase.push_back(static_cast<std::uint8_t>(phase_step(phases(n), steps.phase_levels)));
    out.frame.intensity.push_back(intensity_step(amplitude, steps.intensity_levels, device));
    if (amplitude == 0) continue;
    const double error = std::remainder(kTurn * out.frame.phase.back() / steps.phase_levels - phases(n), kTurn);
    const double driven = out.frame.intensity.back() / (steps.intensity_levels - 1.0);
    out.report.worst_phase_error = std::max(out.report.worst_phase_error, std::abs(error));
    squares += error * error;
    ++out.report.count;
    wanted_energy += amplitude * amplitude;
    driven_energy += driven * driven;
    overlap += std::polar(amplitude * driven, error);
  }
  if (out.report.count > 0) {
    out.report.rms_phase_error = std::sqrt(squares / static_cast<double>(out.report.count));
    const double energies = wanted_energy * driven_energy;
    out.report.worst_drive_loss = energies > 0 ? std::max(0.0, 1 - std::norm(overlap) / energies) : 1;
  }
  return out;
}

}  // namespace touchfield
