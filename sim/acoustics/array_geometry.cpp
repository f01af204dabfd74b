#include "sim/acoustics/array_geometry.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "sim/core/box_tree.h"
#include "sim/core/errors.h"
#include "sim/core/require.h"
#include "sim/core/text.h"
#include "sim/core/units.h"

namespace touchfield {

namespace {

constexpr double kFewestPerWavelength = 8;  // neighbours nearer than this part of it
constexpr double kUsualArray = 2;           // [m]
constexpr double kEvenPitch = 1.01;         // largest over least of an array whose pitch is one number
constexpr double kFlat = 0.05e-3;           // [m]: an extent below it is not shown
constexpr double kSameAxis = 0.9999;        // cosine, about 0.8 degrees
constexpr double kRounding = 1e-9;          // of distances

/// "(0.00, -0.50, 0.87)", without -0.
std::string direction_text(const Vector3& direction) {
  const Vector3 rounded = ((100 * direction).array().round() / 100 + 0.0).matrix();
  return fmt::format("({:.2f}, {:.2f}, {:.2f})", rounded.x(), rounded.y(), rounded.z());
}

std::string facing_text(const TransducerArray& array, const Vector3& facing) {
  if (facing.norm() < kSameAxis) {
    if (facing.norm() < 0.5) {
      return "facing many ways";
    }
    const Vector3 mean = facing.normalized();
    const double widest = std::acos(std::clamp((mean.transpose() * array.axes).minCoeff(), -1.0, 1.0));
    return fmt::format("facing {} within {:.0f} degrees", direction_text(mean), widest / kDegree);
  }
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    if (std::abs(facing(axis)) > kSameAxis) {
      return fmt::format("facing {}{}", facing(axis) > 0 ? '+' : '-', "xyz"[axis]);
    }
  }
  return "facing " + direction_text(facing);
}

std::string apart_text(const TransducerArray& array, const ArrayGeometry& geometry) {
  const std::string where = place_text(array.positions.col(geometry.nearest[0]), 2);
  return geometry.least_pitch > 0 ? fmt::format("transducers {} and {} are {:.4g} mm apart, at {}", geometry.nearest[0],
                                                geometry.nearest[1], geometry.least_pitch / kMillimetre, where)
                                  : fmt::format("transducers {} and {} are in one place, {}", geometry.nearest[0],
                                                geometry.nearest[1], where);
}

}  // namespace

ArrayGeometry array_geometry(const TransducerArray& array) {
  if (array.kind == TransducerArray::Kind::kPlaneWave) {
    throw std::logic_error("a plane wave has no geometry");
  }
  ArrayGeometry geometry;
  geometry.size = array.positions.rowwise().maxCoeff() - array.positions.rowwise().minCoeff();
  geometry.facing = array.axes.rowwise().mean();
  if (array.size() < 2) {
    return geometry;
  }
  const Neighbours neighbours = nearest_neighbours(array.positions);
  double least = std::numeric_limits<double>::infinity();
  for (Eigen::Index n = 0; n < array.size(); ++n) {
    if (neighbours.squared(n) < (1 - kRounding) * least) {
      least = neighbours.squared(n);
      geometry.nearest[0] = n;
      geometry.nearest[1] = neighbours.number[static_cast<std::size_t>(n)];
    }
  }
  geometry.least_pitch = std::sqrt(least);
  geometry.largest_pitch = std::sqrt(neighbours.squared.maxCoeff());
  return geometry;
}

void require_real_array(const TransducerArray& array, double wavelength, const std::string& field,
                        const std::string& advice) {
  if (array.kind == TransducerArray::Kind::kPlaneWave) {
    return;
  }
  const ArrayGeometry geometry = array_geometry(array);
  const double least = std::min(kLeastPitch, wavelength / kFewestPerWavelength);
  if (array.size() > 1) {
    require(geometry.least_pitch >= (1 - kRounding) * least, "{}: {}; they must be at least {:.2g} mm apart: {}", field,
            apart_text(array, geometry), least / kMillimetre, advice);
  }
  require(geometry.size.norm() <= kLargestArray, "{}: the array is {:.4g} m across, must be at most {:g} m: {}", field,
          geometry.size.norm(), kLargestArray, advice);
}

std::vector<std::string> array_warnings(const TransducerArray& array, double wavelength) {
  std::vector<std::string> warnings;
  if (array.kind == TransducerArray::Kind::kPlaneWave) {
    return warnings;
  }
  const ArrayGeometry geometry = array_geometry(array);
  if (array.size() > 1 && geometry.least_pitch < wavelength / kFewestPerWavelength) {
    warnings.push_back(
        fmt::format("array_pitch: {}, less than an eighth of the wavelength of {:.4g} mm; transducers of ultrasound "
                    "are larger: are "
                    "the array's lengths in mm, and is frequency_khz right?",
                    apart_text(array, geometry), wavelength / kMillimetre));
  }
  if (geometry.size.norm() > kUsualArray) {
    warnings.push_back(
        fmt::format("array_size: the array is {:.4g} m across; are its lengths in mm?", geometry.size.norm()));
  }
  return warnings;
}

std::string describe_array(const TransducerArray& array) {
  if (array.kind == TransducerArray::Kind::kPlaneWave) {
    return "a plane wave along " + direction_text(array.axes.col(0));
  }
  const ArrayGeometry geometry = array_geometry(array);
  const std::string facing = facing_text(array, geometry.facing);
  if (array.size() == 1) {
    return fmt::format("1 transducer at {}, {}", place_text(array.positions.col(0), 2), facing);
  }
  std::vector<std::string> sides;
  for (const double side : geometry.size) {
    if (side >= kFlat) {
      sides.push_back(fmt::format("{:.4g}", side / kMillimetre));
    }
  }
  const double least = geometry.least_pitch / kMillimetre;
  const double largest = geometry.largest_pitch / kMillimetre;
  const std::string pitch =
      largest > kEvenPitch * least ? fmt::format("{:.4g} to {:.4g}", least, largest) : fmt::format("{:.4g}", least);
  return fmt::format("{} transducers, {} mm, pitch {} mm, {}", array.size(), fmt::join(sides, " x "), pitch, facing);
}

}  // namespace touchfield
