#include "sim/field/target.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/place_text.h"
#include "sim/core/units.h"
#include "sim/mesh/query/mesh_risks.h"

namespace touchfield {

namespace {

/// A point in the box's own frame, from its centre.
Vector3 in_box_frame(const TargetBox& box, const Vector3& x) { return box.rotation.transpose() * (x - box.centre); }

double distance_to(const TargetBox& box, const Vector3& x) {
  const Vector3 own = in_box_frame(box, x).cwiseAbs();
  if (box.shape == TargetShape::kCylinder) {
    const double beside = std::max(own.head<2>().norm() - 0.5 * box.size.x(), 0.0);
    return std::hypot(beside, std::max(own.z() - 0.5 * box.size.z(), 0.0));
  }
  return (own - 0.5 * box.size).cwiseMax(0.0).norm();
}

/// What messages call the part that a box belongs to.
std::string part_key(const std::vector<TargetBox>& boxes, std::size_t index) {
  if (!boxes[index].key.empty()) {
    return boxes[index].key;
  }
  return boxes.size() == 1 ? "target.box" : fmt::format("target.boxes[{}]", index);
}

/// Ends of the runs of boxes that are one part.
std::vector<std::size_t> part_ends(const std::vector<TargetBox>& boxes) {
  std::vector<std::size_t> ends;
  for (std::size_t b = 1; b <= boxes.size(); ++b) {
    if (b == boxes.size() || boxes[b].key.empty() || boxes[b].key != boxes[b - 1].key) {
      ends.push_back(b);
    }
  }
  return ends;
}

/// No face is in the boxes of a part, begin to end.
[[noreturn]] void refuse_empty_part(const TriangleMesh& mesh, const std::vector<TargetBox>& boxes, std::size_t begin,
                                    std::size_t end) {
  double nearest = std::numeric_limits<double>::infinity();
  Eigen::Index face = 0;
  std::size_t box = begin;
  for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
    for (std::size_t b = begin; b < end; ++b) {
      if (const double distance = distance_to(boxes[b], mesh.centroids().col(f)); distance < nearest) {
        nearest = distance;
        face = f;
        box = b;
      }
    }
  }
  throw InputError(fmt::format(
      "{}: no face has its centroid in the box about {} (scene coordinates); the nearest is {:.2f} mm outside the box, "
      "at {}",
      part_key(boxes, box), place_text(boxes[box].centre), nearest / kMillimetre,
      place_text(mesh.centroids().col(face))));
}

[[noreturn]] void refuse_whole_body(const TriangleMesh& mesh, const std::vector<TargetBox>& boxes) {
  const Vector3 size = (mesh.vertices().rowwise().maxCoeff() - mesh.vertices().rowwise().minCoeff()) / kMillimetre;
  throw InputError(fmt::format("{} covers the whole body ({:.3g} x {:.3g} x {:.3g} mm); make it smaller",
                               part_ends(boxes).size() == 1 ? part_key(boxes, 0) : "target", size.x(), size.y(),
                               size.z()));
}

/// Depth of each target face below the face of its box through which the skin enters [m].
Eigen::VectorXd penetration_depths(const TriangleMesh& mesh, const std::vector<TargetBox>& boxes,
                                   const Target& target) {
  std::vector<double> normal_sum(boxes.size(), 0.0);
  for (std::size_t i = 0; i < target.faces.size(); ++i) {
    const auto b = static_cast<std::size_t>(target.box[i]);
    const Eigen::Index f = target.faces[i];
    normal_sum[b] += mesh.areas()(f) * boxes[b].rotation.col(2).dot(mesh.normals().col(f));
  }
  Eigen::VectorXd depths(target.size());
  for (std::size_t i = 0; i < target.faces.size(); ++i) {
    const auto b = static_cast<std::size_t>(target.box[i]);
    const double along = in_box_frame(boxes[b], mesh.centroids().col(target.faces[i])).z();
    // Skin that faces down the axis came in from above.
    const double from_entry = normal_sum[b] <= 0 ? 0.5 * boxes[b].size.z() - along : 0.5 * boxes[b].size.z() + along;
    depths(static_cast<Eigen::Index>(i)) = std::max(from_entry, 0.0);
  }
  return depths;
}

}  // namespace

double level_at(const TargetBox& box, const Vector3& x) {
  const Vector3 own = in_box_frame(box, x);
  if (box.shape == TargetShape::kMask) {
    return box.mask ? box.level * box.mask->level(own) : 0.0;
  }
  const bool beside = box.shape == TargetShape::kCylinder
                          ? own.head<2>().norm() <= 0.5 * box.size.x()
                          : (own.head<2>().cwiseAbs().array() <= 0.5 * box.size.head<2>().array()).all();
  return beside && std::abs(own.z()) <= 0.5 * box.size.z() ? box.level : 0.0;
}

bool hold_faces(const TriangleMesh& mesh, const std::vector<TargetBox>& boxes) {
  const auto holds_face = [&](const TargetBox& box) {
    for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
      if (holds(box, mesh.centroids().col(f))) {
        return true;
      }
    }
    return false;
  };
  auto begin = boxes.begin();
  return std::ranges::all_of(part_ends(boxes), [&](std::size_t count) {
    const auto end = boxes.begin() + static_cast<std::ptrdiff_t>(count);
    return std::any_of(std::exchange(begin, end), end, holds_face);
  });
}

Target make_target(const TriangleMesh& mesh, const std::vector<TargetBox>& boxes, TargetProfile profile,
                   double pressure) {
  if (!(pressure > 0) || !std::isfinite(pressure)) {
    throw InputError(fmt::format("target: pressure = {} Pa must be > 0", pressure));
  }
  Target target;
  target.boxes = boxes;
  std::vector<Eigen::Index> count(boxes.size(), 0);
  for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
    int first = -1;
    for (std::size_t b = 0; b < boxes.size(); ++b) {
      if (holds(boxes[b], mesh.centroids().col(f))) {
        ++count[b];
        first = first < 0 ? static_cast<int>(b) : first;
      }
    }
    if (first >= 0) {
      target.faces.push_back(f);
      target.box.push_back(first);
    }
  }
  std::size_t begin = 0;
  for (const std::size_t end : part_ends(boxes)) {
    if (std::ranges::all_of(std::span(count).subspan(begin, end - begin), [](auto faces) { return faces == 0; })) {
      refuse_empty_part(mesh, boxes, begin, end);
    }
    begin = end;
  }
  if (target.size() == mesh.face_count()) {
    refuse_whole_body(mesh, boxes);
  }
  target.amplitudes = Eigen::VectorXd::Constant(target.size(), pressure);
  if (profile == TargetProfile::kPenetration) {
    const Eigen::VectorXd depths = penetration_depths(mesh, boxes, target);
    if (!(depths.maxCoeff() > 0)) {
      throw InputError(
          "target: no face is below the side of the box through which the skin enters, so the penetration is 0");
    }
    target.amplitudes = pressure / depths.maxCoeff() * depths;
  }
  for (std::size_t i = 0; i < target.faces.size(); ++i) {
    target.amplitudes(static_cast<Eigen::Index>(i)) *=
        level_at(boxes[static_cast<std::size_t>(target.box[i])], mesh.centroids().col(target.faces[i]));
  }
  return target;
}

OppositeSides opposite_sides(const TriangleMesh& mesh, const Target& target) {
  constexpr double kOpposite = -0.8;  // of the normals
  OppositeSides sides{0.0, 0.0, Vector3::Zero()};
  double area = 0.0;
  double opposed = 0.0;
  for (std::size_t i = 0; i < target.faces.size(); ++i) {
    const Eigen::Index f = target.faces[i];
    area += mesh.areas()(f);
    double nearest = std::numeric_limits<double>::infinity();
    for (std::size_t j = 0; j < target.faces.size(); ++j) {
      const Eigen::Index g = target.faces[j];
      if (target.box[i] == target.box[j] && mesh.normals().col(f).dot(mesh.normals().col(g)) < kOpposite &&
          facing(mesh, f, g) == Facing::kThroughBody) {
        nearest = std::min(nearest, (mesh.centroids().col(g) - mesh.centroids().col(f)).norm());
      }
    }
    if (std::isfinite(nearest)) {
      sides.at = opposed == 0.0 ? Vector3(mesh.centroids().col(f)) : sides.at;
      opposed += mesh.areas()(f);
      sides.thickness += mesh.areas()(f) * nearest;
    }
  }
  if (opposed > 0.0) {
    sides.share = opposed / area;
    sides.thickness /= opposed;
  }
  return sides;
}

Eigen::Index central_face(const TriangleMesh& mesh, const Target& target) {
  Vector3 centre = Vector3::Zero();
  double area = 0.0;
  for (const Eigen::Index f : target.faces) {
    centre += mesh.areas()(f) * mesh.centroids().col(f);
    area += mesh.areas()(f);
  }
  centre /= area;
  return *std::min_element(target.faces.begin(), target.faces.end(), [&](Eigen::Index a, Eigen::Index b) {
    return (mesh.centroids().col(a) - centre).squaredNorm() < (mesh.centroids().col(b) - centre).squaredNorm();
  });
}

}  // namespace touchfield
