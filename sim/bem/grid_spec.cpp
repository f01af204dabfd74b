#include "sim/bem/grid_spec.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "sim/bem/line_transform.h"

namespace touchfield {

namespace {

constexpr double kOversampling = 1.25;  // pi / h over k_c
constexpr double kWindowShape = 2.15;   // of the window, a point of its width
constexpr double kContinuation = 0.5;   // of the band left between k and pi / h
constexpr double kCoarseGrid = 1e-5;    // tolerances from here on allow the coarsest step: nothing else ends there
// Seconds of one thread, measured: a point of the grid and halving of it, a pair within reach, a point of a window.
constexpr double kPointSeconds = 0.55e-9;
constexpr double kPairSeconds = 6e-9;
constexpr double kWindowSeconds = 10e-9;

GridSpec spec_at(double step, double k, double gamma, double tolerance) {
  const double ratio = k * step / std::numbers::pi;  // k over the grid's largest wavenumber
  const double within = kOversampling * ratio;
  const double strength = 0.018 * std::max(1.0, gamma * k) / (within * within);
  GridSpec spec;
  spec.step = step;
  spec.shape = std::log(strength / (0.5 * tolerance)) / 0.93 / std::sqrt(1.0 - within * within);
  spec.reach = kOversampling * spec.shape * step / std::numbers::pi;
  spec.width =
      std::clamp(static_cast<int>(std::ceil(std::log(4.6 / (ratio * 0.25 * tolerance)) / 2.03)), 4, kWidestWindow);
  spec.window_shape = kWindowShape * spec.width;
  spec.bend_shape = kContinuation * std::numbers::pi * (1.0 - ratio);
  spec.margin = std::max(2, static_cast<int>(std::ceil(std::log(0.05 / (0.25 * tolerance)) / spec.bend_shape)));
  spec.single = tolerance >= kFinestSingleGrid;
  return spec;
}

}  // namespace

GridBody grid_body(const TriangleMesh& mesh) {
  return {mesh.centroids().rowwise().maxCoeff() - mesh.centroids().rowwise().minCoeff(), mesh.total_area(),
          static_cast<double>(mesh.face_count())};
}

GridChoice choose_grid(const GridBody& body, const Complex& wavenumber, double gamma, double tolerance) {
  const double k = wavenumber.real();
  const double number = tolerance >= kFinestSingleGrid ? 1.0 : 2.0;  // how much more double precision takes
  GridChoice best;
  best.seconds = std::numeric_limits<double>::infinity();
  constexpr double kFiner = 0.94;
  const double coarsest = (tolerance < kCoarseGrid ? 0.2 : 0.25) * 2.0 * std::numbers::pi / k;
  for (double step = coarsest; step > 1e-3 * coarsest; step *= kFiner) {
    const GridSpec spec = spec_at(step, k, gamma, tolerance);
    double points = 1.0;
    for (int a = 0; a < 3; ++a) {
      points *= transform_size(std::max(2 * (static_cast<int>(body.extent(a) / step) + 1 + spec.margin), spec.width));
    }
    const double pairs = body.faces * body.faces * std::numbers::pi * spec.reach * spec.reach / body.area;
    const double seconds = number * (kPointSeconds * points * std::log2(points) + kPairSeconds * pairs +
                                     kWindowSeconds * body.faces * spec.width * spec.width);
    if (seconds < best.seconds) {
      best = {spec, seconds, number * 8.0 * points};
    }
    if (points > 1e10) {
      break;
    }
  }
  return best;
}

}  // namespace touchfield
