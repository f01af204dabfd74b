#pragma once

#include <cstdlib>
#include <string>
#include <vector>

#include "sim/bem/quadrature.h"
#include "sim/gpu/cuda/faces.cuh"
#include "sim/hand/hand.h"
#include "sim/hand/shapes.h"
#include "tests/gpu/card.h"
#include "tests/support/mesh_support.h"

namespace touchfield {

/// Surfaces that the card's sums and integrals are held to the CPU's on, and what takes them there.
struct GpuSurface {
  std::string name;
  TriangleMesh mesh;
};

/// Vertices times a factor and moved off the origin, where centres and places differ.
inline TriangleMesh gpu_mesh(const TriangleMesh& mesh, double factor) {
  const Points vertices = (factor * mesh.vertices()).colwise() + Vector3(0.11, -0.07, 0.2);
  return {vertices, mesh.triangles()};
}

/// Two equal boxes with a gap between them of a fifth of their edges: every face has one right opposite, and many
/// distances are the same.
inline TriangleMesh gpu_gap() {
  const TriangleMesh plate = box(Vector3(0.018, 0.012, 0.003), 1.5e-3).mesh;
  return together(plate, shifted(plate, Vector3(0.0, 0.0, 3.3e-3)));
}

inline std::vector<GpuSurface> gpu_surfaces() {
  HandOptions options;
  options.edge = kMostHandEdge;
  return {{"sphere", gpu_mesh(icosphere(8e-3, 6), 1.0)},
          {"gap", gpu_mesh(gpu_gap(), 1.0)},
          {"hand", gpu_mesh(hand(options).mesh, 0.4)}};
}

inline const Complex kGpuWavenumber(732.28, 0.0);
inline const Complex kGpuDamped(732.28, 3.0);
inline constexpr double kGpuGamma = 1.0 / 732.28;

inline cuda::SurfaceWave gpu_wave(const Complex& wavenumber) {
  return {wavenumber.real(), wavenumber.imag(), kGpuGamma};
}

inline cuda::Faces gpu_faces(cuda::Context& context, const TriangleMesh& mesh, const Complex& wavenumber) {
  return {context,
          mesh.triangles().data(),
          static_cast<int>(mesh.face_count()),
          mesh.vertices().data(),
          static_cast<int>(mesh.vertex_count()),
          gpu_wave(wavenumber)};
}

/// A block of complex numbers there and back.
class GpuBlock {
 public:
  GpuBlock(cuda::Context& context, Eigen::Index rows, Eigen::Index columns)
      : rows_(rows), columns_(columns), values_(context, static_cast<std::size_t>(rows * columns)) {}
  GpuBlock(cuda::Context& context, const Eigen::MatrixXcf& values) : GpuBlock(context, values.rows(), values.cols()) {
    values_.upload(reinterpret_cast<const cuComplex*>(values.data()), values_.size());
  }

  cuComplex* data() { return values_.data(); }
  Eigen::MatrixXcf get() const {
    Eigen::MatrixXcf values(rows_, columns_);
    values_.download(reinterpret_cast<cuComplex*>(values.data()), values_.size());
    return values;
  }

 private:
  Eigen::Index rows_;
  Eigen::Index columns_;
  cuda::Array<cuComplex> values_;
};

/// The largest difference, of the largest value of each row.
inline double row_error(const Eigen::MatrixXcf& found, const Eigen::MatrixXcd& expected) {
  const Eigen::MatrixXcd difference = found.cast<Complex>() - expected;
  return (difference.cwiseAbs().rowwise().maxCoeff().array() / expected.cwiseAbs().rowwise().maxCoeff().array())
      .maxCoeff();
}

inline double block_error(const Eigen::MatrixXcf& found, const Eigen::MatrixXcd& expected) {
  return (found.cast<Complex>() - expected).norm() / expected.norm();
}

inline Wave wave_of(double absorption) {
  Medium medium = air(293.15);
  medium.absorption = absorption;
  return {medium, 40e3};
}

inline cuda::Faces faces_of(cuda::Context& context, const TriangleMesh& mesh, const Wave& wave) {
  return {context,
          mesh.triangles().data(),
          static_cast<int>(mesh.face_count()),
          mesh.vertices().data(),
          static_cast<int>(mesh.vertex_count()),
          {wave.k(), wave.medium().absorption, 1.0 / wave.k()}};
}

inline Eigen::MatrixXcf random_block(Eigen::Index rows, Eigen::Index columns, unsigned seed = 5) {
  std::srand(seed);
  return Eigen::MatrixXcf::Random(rows, columns);
}

}  // namespace touchfield
