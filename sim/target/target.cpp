#include "sim/target/target.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/place_text.h"
#include "sim/core/units.h"
#include "sim/mesh/query/mesh_risks.h"

namespace touchfield {

namespace {

/// A point in the box's own frame, from its centre.
Vector3 in_box_frame(const TargetBox& box, const Vector3& x) { return box.rotation.transpose() * (x - box.centre); }

bool holds(const TargetBox& box, const Vector3& x) {
  return (in_box_frame(box, x).cwiseAbs().array() <= 0.5 * box.size.array()).all();
}

double distance_to(const TargetBox& box, const Vector3& x) {
  return (in_box_frame(box, x).cwiseAbs() - 0.5 * box.size).cwiseMax(0.0).norm();
}

/// What messages call a box.
std::string box_key(const std::vector<TargetBox>& boxes, std::size_t index) {
  return boxes.size() == 1 ? "target.box" : fmt::format("target.boxes[{}]", index);
}

void require_face_in(const TriangleMesh& mesh, const std::vector<TargetBox>& boxes, std::size_t index,
                     Eigen::Index count) {
  if (count > 0) {
    return;
  }
  const TargetBox& box = boxes[index];
  double nearest = std::numeric_limits<double>::infinity();
  Eigen::Index face = 0;
  for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
    if (const double distance = distance_to(box, mesh.centroids().col(f)); distance < nearest) {
      nearest = distance;
      face = f;
    }
  }
  throw InputError(fmt::format(
      "{}: no face has its centroid in the box about {} (scene coordinates); the nearest is {:.2f} mm outside the box, "
      "at {}",
      box_key(boxes, index), place_text(box.centre), nearest / kMillimetre, place_text(mesh.centroids().col(face))));
}

[[noreturn]] void refuse_whole_body(const TriangleMesh& mesh, const std::vector<TargetBox>& boxes) {
  const Vector3 size = (mesh.vertices().rowwise().maxCoeff() - mesh.vertices().rowwise().minCoeff()) / kMillimetre;
  throw InputError(fmt::format("{}.size_mm covers the whole body ({:.3g} x {:.3g} x {:.3g} mm); make it smaller",
                               boxes.size() == 1 ? "target.box" : "target.boxes", size.x(), size.y(), size.z()));
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

bool hold_faces(const TriangleMesh& mesh, const std::vector<TargetBox>& boxes) {
  return std::ranges::all_of(boxes, [&](const TargetBox& box) {
    for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
      if (holds(box, mesh.centroids().col(f))) {
        return true;
      }
    }
    return false;
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
  for (std::size_t b = 0; b < boxes.size(); ++b) {
    require_face_in(mesh, boxes, b, count[b]);
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
