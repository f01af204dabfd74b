#include "hardware/array_match.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "sim/core/box_tree.h"
#include "sim/core/errors.h"
#include "sim/core/units.h"

namespace touchfield {

namespace {

// Median distance of a transducer to its nearest neighbour; 0 for a single one.
double pitch_of(const Points& points) {
  if (points.cols() < 2) return 0;
  Eigen::VectorXd squared = nearest_neighbours(points).squared;
  double* const middle = squared.data() + squared.size() / 2;
  std::nth_element(squared.data(), middle, squared.data() + squared.size());
  return std::sqrt(*middle);
}

// Distances from the middle, sorted: the same for the same places in another order.
Eigen::VectorXd shape_of(const Points& points) {
  const Vector3 centre = points.rowwise().mean();
  Eigen::VectorXd distances = (points.colwise() - centre).colwise().norm();
  std::sort(distances.begin(), distances.end());
  return distances;
}

// The places and, in front of each, a point on the axis.
Points places_and_tips(const Points& positions, const Points& axes) {
  Points points(3, 2 * positions.cols());
  points << positions, positions + kMatchReach * axes;
  return points;
}

std::string what_differs(const Points& run, const Points& device, Eigen::Index worst, double miss) {
  const double run_pitch = pitch_of(run);
  const double device_pitch = pitch_of(device);
  if (std::abs(run_pitch - device_pitch) > 1e-3 * device_pitch) {
    return fmt::format("pitch {:.3f} mm, the device's is {:.3f} mm", run_pitch / kMillimetre,
                       device_pitch / kMillimetre);
  }
  const bool same_shape = (shape_of(run) - shape_of(device)).cwiseAbs().maxCoeff() <= kMatchTolerance;
  return fmt::format("{}: transducer {} is {:.2f} mm away from the device's",
                     same_shape ? "its transducers are in another order, are mirrored, or face another direction"
                                : "its transducers are in other places",
                     worst, miss / kMillimetre);
}

}  // namespace

void require_match(const TransducerArray& run, const ArrayLayout& device, const std::string& name) {
  const auto refuse = [&](const std::string& what) {
    throw InputError(fmt::format("the run's array is not that of {}: {}", name, what));
  };
  if (run.kind == TransducerArray::Kind::kPlaneWave) {
    refuse("it is a plane wave");
  }
  if (run.size() != device.positions.cols()) {
    refuse(fmt::format("{} transducers, the device has {}", run.size(), device.positions.cols()));
  }
  const Points wanted = places_and_tips(run.positions, run.axes);
  const Points there = places_and_tips(device.positions, device.axes);
  const Eigen::Isometry3d motion(Eigen::umeyama(there, wanted, false));
  Eigen::Index worst = 0;
  const double miss = (motion * there - wanted).colwise().norm().maxCoeff(&worst);
  if (!(miss <= kMatchTolerance)) {
    refuse(what_differs(run.positions, device.positions, worst % run.size(), miss));
  }
  for (Eigen::Index n = 0; n < run.size(); ++n) {
    if (run.device(n) != device.device(n) || run.channel(n) != device.channel(n)) {
      refuse(fmt::format("transducer {} is channel {} of unit {}, the device's is channel {} of unit {}", n,
                         run.channel(n), run.device(n), device.channel(n), device.device(n)));
    }
  }
}

}  // namespace touchfield
