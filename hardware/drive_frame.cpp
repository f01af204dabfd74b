#include "hardware/drive_frame.h"

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
                    "amplitudes become 1 with array.level: 1 and a higher wanted pressure",
                    device, amplitude));
  }
  return static_cast<std::uint8_t>(std::floor(exact + kStepSlack));
}

constexpr double kFull = 255;
constexpr double kPeriodTolerance = 1e-9;  // of the frequency

void require_sine(const SineModulation& sine) {
  if (!(sine.frequency > 0) || !std::isfinite(sine.frequency)) {
    throw InputError(fmt::format("modulation: frequency = {} Hz must be > 0", sine.frequency));
  }
  if (!(sine.depth > 0 && sine.depth <= 1)) {
    throw InputError(fmt::format("modulation: depth = {} must be > 0 and <= 1", sine.depth));
  }
}

// The fewest samples of whole periods.
std::size_t sine_length(double frequency, const ModulationAbility& ability) {
  if (!(2 * frequency < ability.rate)) {
    throw InputError(fmt::format("modulation: frequency = {} Hz must be below half of the buffer's {} samples/s",
                                 frequency, ability.rate));
  }
  for (std::size_t n = 2; n <= ability.most_samples; ++n) {
    const double periods = frequency * static_cast<double>(n) / ability.rate;
    const double whole = std::round(periods);
    if (whole >= 1 && std::abs(periods - whole) <= kPeriodTolerance * whole) {
      return n;
    }
  }
  throw InputError(fmt::format("modulation: frequency = {} Hz: no whole periods fit into {} samples at {} samples/s",
                               frequency, ability.most_samples, ability.rate));
}

struct Describer {
  std::string operator()(const StaticModulation&) const { return "none"; }
  std::string operator()(const SineModulation& sine) const {
    return fmt::format("{:g} Hz sine, depth {:g}", sine.frequency, sine.depth);
  }
  std::string operator()(const SampledModulation& samples) const {
    return fmt::format("{} samples at {:g} Hz", samples.samples.size(), samples.rate);
  }
};

struct Sampler {
  const ModulationAbility& ability;

  std::vector<std::uint8_t> operator()(const StaticModulation&) const { return {static_cast<std::uint8_t>(kFull)}; }
  std::vector<std::uint8_t> operator()(const SineModulation& sine) const {
    require_sine(sine);
    std::vector<std::uint8_t> bytes(sine_length(sine.frequency, ability));
    const double periods = std::round(sine.frequency * static_cast<double>(bytes.size()) / ability.rate);
    for (std::size_t k = 0; k < bytes.size(); ++k) {
      const double angle = 2 * std::numbers::pi * periods * static_cast<double>(k) / static_cast<double>(bytes.size());
      bytes[k] = static_cast<std::uint8_t>(std::lround(kFull * (1 - sine.depth * (1 - std::sin(angle)) / 2)));
    }
    return bytes;
  }
  std::vector<std::uint8_t> operator()(const SampledModulation& samples) const {
    if (samples.samples.empty()) {
      throw InputError("modulation: it has no sample");
    }
    if (!(samples.rate > 0) || !std::isfinite(samples.rate)) {
      throw InputError(fmt::format("modulation: rate = {} samples/s must be > 0", samples.rate));
    }
    if (samples.rate != ability.rate) {
      throw InputError(
          fmt::format("modulation: samples at {:g} Hz, the device plays {:g} per second", samples.rate, ability.rate));
    }
    if (samples.samples.size() > ability.most_samples) {
      throw InputError(
          fmt::format("modulation: {} samples, the device holds {}", samples.samples.size(), ability.most_samples));
    }
    return samples.samples;
  }
};

// The device's own frequencies, highest and lowest.
std::string own_text(const ModulationAbility& ability) {
  const auto [least, most] = std::minmax_element(ability.own_frequencies.begin(), ability.own_frequencies.end());
  return fmt::format("its firmware modulates on its own, with full depth, at {} frequencies from {:.4g} to {:.4g} Hz",
                     ability.own_frequencies.size(), *least, *most);
}

std::size_t nearest_own(double frequency, const ModulationAbility& ability) {
  const auto nearest =
      std::min_element(ability.own_frequencies.begin(), ability.own_frequencies.end(),
                       [&](double a, double b) { return std::abs(a - frequency) < std::abs(b - frequency); });
  return static_cast<std::size_t>(nearest - ability.own_frequencies.begin());
}

}  // namespace

DriveFrame silent_frame(std::size_t n) { return {std::vector<std::uint8_t>(n, 0), std::vector<std::uint8_t>(n, 0)}; }

Eigen::VectorXd phases_of(const DriveFrame& frame, const DriveSteps& steps) {
  const double step = 2 * std::numbers::pi / steps.phase_levels;
  return Eigen::VectorXd::NullaryExpr(static_cast<Eigen::Index>(frame.phase.size()),
                                      [&](Eigen::Index n) { return step * frame.phase[static_cast<std::size_t>(n)]; });
}

double level_of(const DriveFrame& frame, const DriveSteps& steps) {
  const auto loudest = std::max_element(frame.intensity.begin(), frame.intensity.end());
  return loudest == frame.intensity.end() ? 0 : *loudest / (steps.intensity_levels - 1.0);
}

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

std::string describe(const Modulation& modulation) { return std::visit(Describer{}, modulation); }

std::string describe(const Modulation& modulation, const ModulationAbility& ability) {
  const auto* sine = std::get_if<SineModulation>(&modulation);
  if (sine == nullptr || ability.own_frequencies.empty()) {
    return describe(modulation);
  }
  const double frequency = ability.own_frequencies[nearest_own(sine->frequency, ability)];
  return fmt::format("{:.4g} Hz of the firmware's own, {:g} Hz requested", frequency, sine->frequency);
}

std::vector<std::uint8_t> modulation_samples(const Modulation& modulation, const ModulationAbility& ability) {
  return std::visit(Sampler{ability}, modulation);
}

std::size_t own_frequency(const SineModulation& sine, const ModulationAbility& ability, const std::string& device) {
  require_sine(sine);
  const std::size_t nearest = nearest_own(sine.frequency, ability);
  const double frequency = ability.own_frequencies.at(nearest);
  if (sine.depth != 1 || std::abs(frequency - sine.frequency) > kOwnFrequencyTolerance * sine.frequency) {
    throw InputError(fmt::format("{}: {}, the nearest {:.4g} Hz; it cannot do: {}", device, own_text(ability),
                                 frequency, describe(sine)));
  }
  return nearest;
}

void require_ability(const Modulation& modulation, const ModulationAbility& ability, const std::string& device) {
  const auto* sine = std::get_if<SineModulation>(&modulation);
  if (!ability.own_frequencies.empty()) {
    if (sine == nullptr) {
      throw InputError(fmt::format("{}: {}; it cannot do: {}", device, own_text(ability), describe(modulation)));
    }
    own_frequency(*sine, ability, device);
    return;
  }
  if (std::holds_alternative<StaticModulation>(modulation)) {
    return;
  }
  if (ability.rate <= 0) {
    throw InputError(fmt::format("{}: it cannot modulate: {}", device, describe(modulation)));
  }
  modulation_samples(modulation, ability);
}

}  // namespace touchfield
