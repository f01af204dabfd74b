#include "sim/motion/motion_instants.h"

#include <algorithm>
#include <cmath>

#include "sim/core/errors.h"

namespace touchfield {

namespace {

template <class Values>
Values in_steps(const Values& values, double step) {
  return (values.array() / step).round() * step;
}

TriangleMesh in_steps(const TriangleMesh& mesh) {
  constexpr double kStep = 0x1p-20;  // [m]
  try {
    return {in_steps<Points>(mesh.vertices(), kStep), mesh.triangles()};
  } catch (const InputError&) {
    return mesh;
  }
}

Eigen::VectorXcd in_steps(const Eigen::VectorXcd& pressure) {
  const double most = pressure.cwiseAbs().maxCoeff();
  if (!(most > 0)) {
    return pressure;
  }
  const double step = std::exp2(std::floor(std::log2(most)) - 13);
  Eigen::VectorXcd result(pressure.size());
  result.real() = in_steps<Eigen::VectorXd>(pressure.real(), step);
  result.imag() = in_steps<Eigen::VectorXd>(pressure.imag(), step);
  return result;
}

}  // namespace

int most_instants(Eigen::Index faces, std::size_t methods) {
  constexpr double kMost = 48;
  constexpr double kFewest = 6;
  constexpr double kBytes = 512.0 * 1024 * 1024;
  constexpr double kMeshBytes = 120;  // of a face, with half a vertex
  const double one = static_cast<double>(faces) * (kMeshBytes + 16.0 * static_cast<double>(methods));
  return static_cast<int>(std::clamp(kBytes / one, kFewest, kMost));
}

MotionInstant rounded(MotionInstant instant) {
  instant.mesh = in_steps(instant.mesh);
  if (instant.sensed) {
    instant.sensed = in_steps(*instant.sensed);
  }
  for (auto& [method, pressure] : instant.pressure) {
    pressure = in_steps(pressure);
  }
  return instant;
}

}  // namespace touchfield
