#include <algorithm>
#include <map>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/require.h"
#include "sim/mesh/io/mesh_files.h"
#include "sim/mesh/query/inspect.h"
#include "sim/motion/moving_model.h"
#include "sim/run/solver_choice.h"

namespace touchfield {

Trajectory::Trajectory(const Scene& scene) {
  if (!scene.motion) {
    return;
  }
  Scene still = scene;
  for (const MotionChange& change : scene.motion->changes) {
    VaryingNumber number = [&] {
      try {
        return varying_number(change.path);
      } catch (const InputError& error) {
        throw InputError(fmt::format("{} {}", change.path, error.what()));
      }
    }();
    require(std::ranges::find(numbers_, number.path, &VaryingNumber::path) == numbers_.end(),
            "{} is changed twice, must be changed once", number.path);
    curves_.push_back(motion_curve(number, change.law, scene.motion->seconds, still));
    numbers_.push_back(std::move(number));
  }
}

Eigen::VectorXd Trajectory::state(double seconds) const {
  Eigen::VectorXd values(size());
  for (Eigen::Index i = 0; i < size(); ++i) {
    values(i) = curves_[static_cast<std::size_t>(i)](seconds);
  }
  return values;
}

void Trajectory::apply(const Eigen::VectorXd& state, Posture& posture) const {
  for (Eigen::Index i = 0; i < size(); ++i) {
    number(i).in(posture) = state(i);
  }
}

Eigen::VectorXd Trajectory::in_range(const Eigen::VectorXd& state) const {
  Eigen::VectorXd values = state;
  for (Eigen::Index i = 0; i < size(); ++i) {
    const auto bound = [&](double written) { return number(i).unit.si(written); };
    const auto& [low, high, low_excluded] = number(i).range;
    if (low) {
      values(i) = std::max(values(i), bound(*low));
    }
    if (high) {
      values(i) = std::min(values(i), bound(*high));
    }
  }
  return values;
}

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

void require_memory(const MeshSeries& series, std::size_t files, Eigen::Index vertices) {
  constexpr double kShare = 0.5;
  constexpr double kGibibyte = 1073741824.0;
  const double bytes = static_cast<double>(files) * static_cast<double>(vertices) * sizeof(Vector3);
  const double free = available_memory();
  require(!(free > 0 && bytes > kShare * free),
          "{}: {} files of {} vertices take {:.3g} GiB; at most {:.3g} GiB, half of the free memory, may be used; list "
          "fewer files or coarser meshes",
          series.times, files, vertices, bytes / kGibibyte, kShare * free / kGibibyte);
}

}  // namespace

MeshSequence::MeshSequence(const MeshShape& shape) {
  const std::vector<MeshSeries::Mesh>& meshes = shape.series.value().meshes;
  std::map<std::string, std::size_t> numbers;
  for (const MeshSeries::Mesh& entry : meshes) {
    numbers.try_emplace(entry.file, numbers.size());
  }
  for (const MeshSeries::Mesh& entry : meshes) {
    const std::size_t number = numbers.at(entry.file);
    if (number == vertices_.size()) {
      const TriangleMesh mesh = read_mesh(entry.file, shape.unit);
      if (number == 0) {
        require_memory(*shape.series, numbers.size(), mesh.vertex_count());
        triangles_ = mesh.triangles();
      } else if (const auto fault = difference(mesh, vertices_.front().cols(), triangles_); !fault.empty()) {
        throw InputError(
            fmt::format("{} (time_s = {:.15g}): {} as in {}", entry.file, entry.seconds, fault, shape.file));
      }
      require_closed_surface(mesh, fmt::format("{} (time_s = {:.15g})", entry.file, entry.seconds));
      vertices_.push_back(mesh.vertices());
    }
    times_.push_back(entry.seconds);
    file_at_.push_back(number);
  }
}

Points MeshSequence::state(double seconds) const {
  const auto after = std::ranges::upper_bound(times_, seconds);
  if (after == times_.begin()) {
    return vertices_at(0);
  }
  if (after == times_.end()) {
    return vertices_at(times_.size() - 1);
  }
  const auto next = static_cast<std::size_t>(after - times_.begin());
  const double share = (seconds - times_[next - 1]) / (times_[next] - times_[next - 1]);
  return (1.0 - share) * vertices_at(next - 1) + share * vertices_at(next);
}

}  // namespace touchfield
