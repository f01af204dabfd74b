#include "sim/motion/mesh_sequence.h"

#include <algorithm>
#include <string>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/mesh/io/mesh_io.h"

namespace touchfield {

namespace {

/// How a mesh differs from the first one in what must be the same; empty if it does not.
std::string difference(const TriangleMesh& mesh, Eigen::Index vertices, const Triangles& triangles) {
  if (mesh.vertex_count() != vertices) {
    return fmt::format("{} vertices, must be {}", mesh.vertex_count(), vertices);
  }
  if (mesh.face_count() != triangles.cols()) {
    return fmt::format("{} triangles, must be {}", mesh.face_count(), triangles.cols());
  }
  for (Eigen::Index f = 0; f < triangles.cols(); ++f) {
    const Eigen::Vector3i is = mesh.triangles().col(f);
    const Eigen::Vector3i must = triangles.col(f);
    if (is != must) {
      return fmt::format("triangle {} joins vertices {}, {}, {}, must be {}, {}, {}", f, is(0), is(1), is(2), must(0),
                         must(1), must(2));
    }
  }
  return {};
}

}  // namespace

MeshSequence::MeshSequence(const MeshShape& shape) {
  for (const MeshSeries::Mesh& entry : shape.series.value().meshes) {
    const TriangleMesh mesh = read_mesh(entry.file, shape.unit);
    if (vertices_.empty()) {
      triangles_ = mesh.triangles();
    } else if (const auto fault = difference(mesh, vertices_.front().cols(), triangles_); !fault.empty()) {
      throw InputError(fmt::format("{} (time_s = {:.15g}): {} as in {}", entry.file, entry.seconds, fault, shape.file));
    }
    times_.push_back(entry.seconds);
    vertices_.push_back(mesh.vertices());
  }
}

Points MeshSequence::state(double seconds) const {
  const auto after = std::ranges::upper_bound(times_, seconds);
  if (after == times_.begin()) {
    return vertices_.front();
  }
  if (after == times_.end()) {
    return vertices_.back();
  }
  const auto next = static_cast<std::size_t>(after - times_.begin());
  const double share = (seconds - times_[next - 1]) / (times_[next] - times_[next - 1]);
  return (1.0 - share) * vertices_[next - 1] + share * vertices_[next];
}

}  // namespace touchfield
