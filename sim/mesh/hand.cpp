#include "sim/mesh/hand.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/mesh/hand_flesh.h"
#include "sim/mesh/hand_skeleton.h"

namespace touchfield {

namespace {

void require_within(const char* field, double value, double least, double most) {
  if (!(value >= least && value <= most)) {
    throw InputError(fmt::format("hand.{} = {} m must be {} to {} m", field, value, least, most));
  }
}

const HandPose& find_pose(const std::string& name) {
  const std::vector<HandPose>& poses = hand_pose_table();
  const auto found = std::find_if(poses.begin(), poses.end(), [&](const HandPose& pose) { return pose.name == name; });
  if (found != poses.end()) {
    return *found;
  }
  std::string known;
  for (const HandPose& pose : poses) {
    known += (known.empty() ? "" : ", ") + pose.name;
  }
  throw InputError(fmt::format("hand.pose = '{}' must be one of {}", name, known));
}

/// Where a ray from inside the body leaves it.
Vector3 way_out(const SoftBody& body, const Vector3& start, const Vector3& direction) {
  constexpr double kClose = 1e-7;  // [m]
  double reach = 0;
  double distance = body.distance(start);
  while (distance < -kClose) {
    reach -= distance;  // the surface is no nearer
    distance = body.distance(start + reach * direction);
  }
  return start + reach * direction;
}

std::vector<Landmark> place_landmarks(const HandSkeleton& skeleton, const SoftBody& body, const TriangleMesh& mesh) {
  const std::array<const char*, 5> names = {"thumb", "index", "middle", "ring", "little"};
  const auto chain = [&](std::size_t i) -> const BoneChain& {
    return i == 0 ? skeleton.thumb : skeleton.fingers[i - 1];
  };
  std::vector<Landmark> landmarks;
  // The side of a curled finger that presses on the palm has no skin: the nearest there is.
  for (std::size_t i = 0; i < names.size(); ++i) {
    const double radius = 0.5 * (chain(i).radii[2] + chain(i).radii[3]);
    landmarks.push_back(
        nearest_landmark(mesh, std::string(names[i]) + "_pad", chain(i).along(2, 0.5) + radius * chain(i).palmar[2]));
  }
  for (std::size_t i = 0; i < names.size(); ++i) {
    landmarks.push_back(nearest_landmark(mesh, std::string(names[i]) + "_tip", chain(i).joints[3]));
  }
  const auto add = [&](const std::string& name, const Vector3& start, const Vector3& direction) {
    landmarks.push_back(nearest_landmark(mesh, name, way_out(body, start, direction)));
  };
  const Vector3 palm(0, 0.2 * skeleton.length, -0.05 * skeleton.breadth);
  add("palm_centre", palm, -Vector3::UnitZ());
  add("back_centre", palm, Vector3::UnitZ());
  add("wrist", Vector3::Zero(), -Vector3::UnitZ());
  return landmarks;
}

/// Mirror image in x, oriented outwards again. Landmarks keep their places.
Body mirrored(const Body& body) {
  const Eigen::DiagonalMatrix<double, 3> flip(-1, 1, 1);
  Triangles triangles = body.mesh.triangles();
  triangles.row(1).swap(triangles.row(2));
  std::vector<Landmark> landmarks = body.landmarks;
  for (Landmark& landmark : landmarks) {
    std::swap(landmark.barycentric(1), landmark.barycentric(2));
  }
  return {TriangleMesh(flip * body.mesh.vertices(), std::move(triangles)), std::move(landmarks)};
}

}  // namespace

std::vector<std::string> hand_poses() {
  std::vector<std::string> names;
  for (const HandPose& pose : hand_pose_table()) {
    names.push_back(pose.name);
  }
  return names;
}

Body hand(const HandOptions& options) {
  const HandPose& pose = find_pose(options.pose);
  require_within("breadth", options.breadth, 0.05, 0.15);
  require_within("length", options.length, 0.12, 0.26);
  require_within("edge", options.edge, 0.4e-3, 8e-3);
  const HandSkeleton skeleton = posed_skeleton(pose, options.length, options.breadth);
  const SoftBody flesh = hand_flesh(skeleton);
  constexpr double kGrid = 1.2e-3;  // [m]: the gaps of 1.5 mm stay open only if the grid sees them
  TriangleMesh mesh = skin_mesh(flesh, options.edge, kGrid);
  std::vector<Landmark> landmarks = place_landmarks(skeleton, flesh, mesh);
  Body body{std::move(mesh), std::move(landmarks)};
  return options.side == HandSide::kRight ? body : mirrored(body);
}

}  // namespace touchfield
