#include "hardware/links/autd3_udp_link.h"

#include <limits>
#include <span>
#include <utility>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "hardware/links/autd3_udp_protocol.h"
#include "sim/core/errors.h"

namespace touchfield {

using namespace autd3_udp;

namespace {

constexpr std::size_t kMostUnits = 255;     // their numbers are bytes
constexpr double kUdpPatience = 0.08;       // [s] for an answer, which may be 40 ms on its way
constexpr std::size_t kFewestSamples = 2;   // in the firmware's modulation buffer
constexpr std::size_t kMostSamples = 4000;  // it holds more, but they would not be in it within kGuardPatience
constexpr double kAxisTolerance = 1e-5;     // [rad]
constexpr double kCarrierClock = 40e3;      // [Hz] that plays stored frames
constexpr double kMostUdpFrames = 800;      // per second: each is confirmed before the next

// Column of each channel of each device in the layout.
std::vector<std::vector<Eigen::Index>> columns_of(const ArrayLayout& layout, Eigen::Index per_unit) {
  const Eigen::Index n = layout.positions.cols();
  if (n == 0 || n % per_unit != 0) {
    throw InputError(fmt::format("autd3: the array has {} transducers, not a multiple of a unit's {}", n, per_unit));
  }
  const auto units = static_cast<std::size_t>(n / per_unit);
  std::vector<std::vector<Eigen::Index>> columns(units,
                                                 std::vector<Eigen::Index>(static_cast<std::size_t>(per_unit), -1));
  for (Eigen::Index i = 0; i < n; ++i) {
    const int device = layout.device(i);
    const int channel = layout.channel(i);
    if (device < 0 || device >= static_cast<int>(units) || channel < 0 || channel >= per_unit) {
      throw InputError(
          fmt::format("autd3: transducer {} is channel {} of device {}; {} units have devices 0..{} with "
                      "channels 0..{}",
                      i, channel, device, units, units - 1, per_unit - 1));
    }
    Eigen::Index& column = columns[static_cast<std::size_t>(device)][static_cast<std::size_t>(channel)];
    if (column >= 0) {
      throw InputError(
          fmt::format("autd3: transducers {} and {} are both channel {} of device {}", column, i, channel, device));
    }
    column = i;
  }
  return columns;
}

}  // namespace

Autd3UdpLink::Autd3UdpLink(std::string host, int port, const std::vector<UnitPlacement>& units)
    : chain_(std::move(host), port, units.size()), layout_(autd3_layout(units)) {
  if (units.empty() || units.size() > kMostUnits) {
    throw InputError(fmt::format("autd3-udp: {} units; there must be 1 to {}", units.size(), kMostUnits));
  }
}

std::string Autd3UdpLink::describe() const {
  return fmt::format("autd3-udp: {} unit{} on {}", chain_.size(), chain_.size() == 1 ? "" : "s", chain_.place());
}

void Autd3UdpLink::open() {
  if (chain_.is_open()) {
    throw DeviceError("autd3-udp: the link is open already");
  }
  lost_ = false;
  frames_sent_ = 0;
  stored_ = 0;
  try {
    chain_.open();
    run({{smoothing(kAutd3IntensitySteps, kAutd3PhaseSteps)}}, "smoothing");
  } catch (const DeviceError&) {
    close();
    throw;
  }
}

void Autd3UdpLink::take_over() {
  if (!chain_.adopt()) {
    chain_.close();
    open();
  }
}

void Autd3UdpLink::set_modulation(const Modulation& modulation) {
  require_live();
  const std::vector<std::uint8_t> samples = autd3_samples(modulation, describe());
  run({autd3_udp::modulation(chain_.version(), samples, kAutd3ModulationDivider)}, "modulation");
}

void Autd3UdpLink::send(const DriveFrame& frame) {
  require_live();
  require_fits_units(frame);
  run(programs_of(frame), fmt::format("frame {}", frames_sent_));
  ++frames_sent_;
}

void Autd3UdpLink::store(std::size_t first, const std::vector<DriveFrame>& frames) {
  require_live();
  if (first != stored_ || first % kStoredAtOnce != 0 || frames.size() > kStoredAtOnce ||
      first + frames.size() > kMostStored) {
    throw InputError(
        fmt::format("autd3-udp: {} frames from {} on cannot be stored after {}", frames.size(), first, stored_));
  }
  std::vector<Autd3UdpChain::Program> programs;
  for (std::size_t unit = 0; unit < chain_.size(); ++unit) {
    std::vector<UnitFrame> parts;
    for (const DriveFrame& frame : frames) {
      require_fits_units(frame);
      parts.push_back(part_of(frame, unit));
    }
    programs.push_back(stored(first, parts));
  }
  run(programs, "stored frames");
  stored_ += frames.size();
}

void Autd3UdpLink::play_stored(std::size_t count, double rate) {
  require_live();
  const int periods = stored_periods(count, rate, abilities().stored, describe());
  if (count > stored_) {
    throw InputError(fmt::format("autd3-udp: {} frames cannot be played, {} are stored", count, stored_));
  }
  run({played(count, static_cast<std::uint16_t>(periods))}, "the stored sequence");
}

void Autd3UdpLink::check() {
  require_live();
  const std::vector<Bytes> states = run({{kReadState}}, "while a frame is held");
  for (std::size_t unit = 0; unit < states.size(); ++unit) {
    if (!states[unit].empty() && (states[unit].front() & kSwitchedOff) != 0) {
      lost_ = true;
      throw DeviceError(fmt::format("autd3-udp: unit {} has switched itself off: it heard nothing for 0.5 s", unit));
    }
  }
}

void Autd3UdpLink::silence() {
  if (!chain_.is_open()) {
    throw DeviceError("autd3-udp: the link is not open");
  }
  if (chain_.is_taken()) {
    throw DeviceError("autd3-udp: it belongs to another program, which hears nothing from this one");
  }
  // Without the reset, a unit might take the frame for one that another program has sent.
  std::vector<Autd3UdpChain::Program> programs =
      programs_of(silent_frame(static_cast<std::size_t>(layout_.positions.cols())));
  for (Autd3UdpChain::Program& program : programs) {
    program.insert(program.begin(), kReset);
  }
  run(programs, "the silent frame");
}

std::vector<Bytes> Autd3UdpLink::run(const std::vector<Autd3UdpChain::Program>& programs, const std::string& what) {
  try {
    return chain_.run(programs, what, kUdpPatience);
  } catch (const DeviceError&) {
    lost_ = true;
    throw;
  }
}

std::vector<Autd3UdpChain::Program> Autd3UdpLink::programs_of(const DriveFrame& frame) const {
  std::vector<Autd3UdpChain::Program> programs;
  for (std::size_t unit = 0; unit < chain_.size(); ++unit) {
    programs.push_back(pattern(chain_.version(), part_of(frame, unit)));
  }
  return programs;
}

UnitFrame Autd3UdpLink::part_of(const DriveFrame& frame, std::size_t unit) const {
  const std::size_t count = frame.size() / chain_.size();
  return {std::span(frame.phase).subspan(unit * count, count), std::span(frame.intensity).subspan(unit * count, count)};
}

void Autd3UdpLink::require_fits_units(const DriveFrame& frame) const {
  require_fits(frame, abilities(), static_cast<std::size_t>(layout_.positions.cols()), describe());
}

void Autd3UdpLink::require_live() const {
  if (!chain_.is_open()) {
    throw DeviceError("autd3-udp: the link is not open");
  }
  if (lost_) {
    throw DeviceError("autd3-udp: the link was lost before; nothing is sent until it is opened again");
  }
}

LinkAbilities autd3_abilities() {
  LinkAbilities can;
  can.steps = {.phase_levels = 256, .intensity_levels = 256};
  can.most_frames_per_second = kMostUdpFrames;
  can.modulation.rate = kAutd3ModulationRate;
  can.modulation.most_samples = kMostSamples;
  // No faster than the smoothing of phases.
  can.stored = {autd3_udp::kMostStored, kCarrierClock, kAutd3PhaseSteps, std::numeric_limits<std::uint16_t>::max()};
  can.switches_off_after = 0.5;
  return can;
}

std::vector<std::uint8_t> autd3_samples(const Modulation& modulation, const std::string& device) {
  const ModulationAbility ability = autd3_abilities().modulation;
  require_ability(modulation, ability, device);
  std::vector<std::uint8_t> samples = modulation_samples(modulation, ability);
  if (samples.size() < kFewestSamples) {
    samples.resize(kFewestSamples, samples.front());
  }
  return samples;
}

ArrayLayout autd3_layout(const std::vector<UnitPlacement>& units) {
  const ArrayLayout unit = autd3_unit(kAutd3Pitch);
  std::vector<ArrayLayout> placed;
  placed.reserve(units.size());
  for (const UnitPlacement& placement : units) {
    placed.push_back(transformed(unit, placement.rotation, placement.position));
  }
  return joined(placed);
}

std::vector<UnitPlacement> autd3_placements(const ArrayLayout& layout) {
  const ArrayLayout unit = autd3_unit(kAutd3Pitch);
  const Eigen::Index per_unit = unit.positions.cols();
  // The far ends of the first row and of the first column.
  Eigen::Index last_x = 0;
  Eigen::Index last_y = 0;
  (unit.positions.row(0) - unit.positions.row(1)).maxCoeff(&last_x);
  (unit.positions.row(1) - unit.positions.row(0)).maxCoeff(&last_y);

  std::vector<UnitPlacement> placements;
  for (const std::vector<Eigen::Index>& columns : columns_of(layout, per_unit)) {
    const auto position = [&](Eigen::Index channel) -> Vector3 {
      return layout.positions.col(columns[static_cast<std::size_t>(channel)]);
    };
    const Vector3 x = (position(last_x) - position(0)).normalized();
    const Vector3 along_y = position(last_y) - position(0);
    const Vector3 y = (along_y - x * x.dot(along_y)).normalized();
    UnitPlacement placement{position(0), Eigen::Matrix3d::Identity()};
    placement.rotation << x, y, x.cross(y);
    const ArrayLayout expected = transformed(unit, placement.rotation, placement.position);
    for (Eigen::Index channel = 0; channel < per_unit; ++channel) {
      const double miss = (position(channel) - expected.positions.col(channel)).norm();
      if (!(miss <= kAutd3PositionTolerance)) {
        throw InputError(fmt::format("autd3: unit {}: its transducer {} is {:.3g} m from its place in an AUTD3",
                                     placements.size(), channel, miss));
      }
      const Vector3 axis = layout.axes.col(columns[static_cast<std::size_t>(channel)]);
      if (!((axis - expected.axes.col(channel)).norm() <= kAxisTolerance)) {
        throw InputError(
            fmt::format("autd3: unit {}: its transducer {} emits along ({:.4f}, {:.4f}, {:.4f}); an AUTD3 in this pose "
                        "emits along ({:.4f}, {:.4f}, {:.4f})",
                        placements.size(), channel, axis.x(), axis.y(), axis.z(), expected.axes(0, channel),
                        expected.axes(1, channel), expected.axes(2, channel)));
      }
    }
    placements.push_back(placement);
  }
  return placements;
}

}  // namespace touchfield
