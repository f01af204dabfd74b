#include "hardware/links/autd3_units.h"

#include <cmath>
#include <cstddef>
#include <limits>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "hardware/links/autd3_udp_protocol.h"
#include "sim/core/errors.h"

namespace touchfield {

namespace {

constexpr std::size_t kFewestSamples = 2;   // in the firmware's modulation buffer
constexpr std::size_t kMostSamples = 4000;  // it holds more, but they would not be in it within kLinkPatience
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
