#include "sim/store/model_difference.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <span>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "sim/store/run_layout.h"

namespace touchfield {

namespace {

template <class Values>
std::span<const double> numbers(const Values& values) {
  return {values.data(), static_cast<std::size_t>(values.size())};
}

/// Diagonal of the points' bounding box [m].
double extent(const Points& points) {
  return points.cols() == 0 ? 0.0 : (points.rowwise().maxCoeff() - points.rowwise().minCoeff()).norm();
}

double largest_distance(const Points& a, const Points& b) {
  return a.cols() == 0 ? 0.0 : (a - b).colwise().norm().maxCoeff();
}

double relative_to_extent(double distance, const Points& a, const Points& b) {
  return distance == 0.0 ? 0.0 : distance / std::max(extent(a), extent(b));
}

MeshMotion mesh_motion(const Points& a, const Points& b) {
  const Eigen::Matrix4d fit = Eigen::umeyama(a, b, false);
  const Eigen::Matrix3d rotation = fit.topLeftCorner<3, 3>();
  const Vector3 translation = fit.topRightCorner<3, 1>();
  const Points moved = (rotation * a).colwise() + translation;
  return {Vector3(b.rowwise().mean() - a.rowwise().mean()), Eigen::AngleAxisd(rotation).angle(),
          largest_distance(moved, b)};
}

std::string kind_text(const TransducerArray& array) {
  return array.kind == TransducerArray::Kind::kPlaneWave ? "plane wave" : "transducers";
}

std::string directivity_text(const Directivity& directivity) {
  const std::string name = directivity_name(directivity.kind());
  return directivity.kind() == Directivity::Kind::kPiston ? fmt::format("{}, ka = {:.6g}", name, directivity.ka())
                                                          : name;
}

/// Amplitudes of those faces of a target that another has too.
std::vector<double> shared_amplitudes(const Target& target, const Target& other) {
  const std::set<Eigen::Index> others(other.faces.begin(), other.faces.end());
  std::vector<double> amplitudes;
  for (std::size_t k = 0; k < target.faces.size(); ++k) {
    if (others.contains(target.faces[k])) {
      amplitudes.push_back(target.amplitudes(static_cast<Eigen::Index>(k)));
    }
  }
  return amplitudes;
}

}  // namespace

void add_change(std::vector<TextChange>& changes, const std::string& what, const std::string& a, const std::string& b) {
  if (a != b) {
    changes.push_back({what, a, b});
  }
}

MeshDifference compare_meshes(const TriangleMesh& a, const TriangleMesh& b) {
  MeshDifference result;
  result.faces = {a.face_count(), b.face_count()};
  result.vertices = {a.vertex_count(), b.vertex_count()};
  if (a.vertex_count() == b.vertex_count()) {
    result.distance = largest_distance(a.vertices(), b.vertices());
  }
  result.same_triangles = result.distance && a.face_count() == b.face_count() && a.triangles() == b.triangles();
  result.identical = result.same_triangles && compare_numbers(numbers(a.vertices()), numbers(b.vertices())).identical;
  result.relative =
      result.same_triangles ? relative_to_extent(*result.distance, a.vertices(), b.vertices()) : kInfinite;
  if (result.same_triangles && !result.identical) {
    result.motion = mesh_motion(a.vertices(), b.vertices());
  }
  return result;
}

ArrayDifference compare_arrays(const TransducerArray& a, const TransducerArray& b) {
  ArrayDifference result;
  result.channels = {a.size(), b.size()};
  add_change(result.texts, "kind", kind_text(a), kind_text(b));
  add_change(result.texts, "directivity", directivity_text(a.directivity), directivity_text(b.directivity));
  result.same_numbering = a.size() == b.size() && a.device == b.device && a.channel == b.channel;
  result.amplitudes = compare_numbers(numbers(a.amplitudes), numbers(b.amplitudes));
  if (a.size() == b.size()) {
    result.distance = largest_distance(a.positions, b.positions);
    result.tilt = 2.0 * std::asin(std::min(1.0, 0.5 * largest_distance(a.axes, b.axes)));
  }
  const bool same_kind = result.texts.empty() && result.same_numbering;
  result.identical = same_kind && result.amplitudes.identical &&
                     compare_numbers(numbers(a.positions), numbers(b.positions)).identical &&
                     compare_numbers(numbers(a.axes), numbers(b.axes)).identical;
  result.relative = same_kind ? std::max({relative_to_extent(*result.distance, a.positions, b.positions), *result.tilt,
                                          result.amplitudes.relative})
                              : kInfinite;
  return result;
}

TargetDifference compare_targets(const std::optional<Target>& a, const std::optional<Target>& b) {
  const Target none;
  const Target& target_a = a ? *a : none;
  const Target& target_b = b ? *b : none;
  const std::vector<double> shared_a = shared_amplitudes(target_a, target_b);
  const std::vector<double> shared_b = shared_amplitudes(target_b, target_a);
  const auto shared = static_cast<Eigen::Index>(shared_a.size());
  TargetDifference result;
  result.faces = {target_a.size(), target_b.size()};
  result.only_faces = {target_a.size() - shared, target_b.size() - shared};
  result.amplitudes = compare_numbers(shared_a, shared_b);
  const bool same_faces = target_a.faces == target_b.faces;
  result.identical = same_faces && target_a.box == target_b.box && result.amplitudes.identical;
  result.relative = same_faces ? result.amplitudes.relative : kInfinite;
  return result;
}

}  // namespace touchfield
