#include "sim/hand/hand.h"

#include <memory>
#include <mutex>
#include <tuple>
#include <utility>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/require.h"
#include "sim/core/text.h"
#include "sim/hand/hand_flesh.h"
#include "sim/hand/implicit_surface.h"
#include "sim/mesh/query/self_intersections.h"

namespace touchfield {

namespace {

void require_within(const char* field, double value, double least, double most) {
  require(value >= least && value <= most, "hand.{} = {} m must be {} to {} m", field, value, least, most);
}

/// A left hand: bones and flesh.
struct Anatomy {
  Anatomy(const HandPose& pose, double length, double breadth, double forearm)
      : skeleton(posed_skeleton(pose, length, breadth)), flesh(hand_flesh(skeleton, forearm)) {}

  HandSkeleton skeleton;
  SoftBody flesh;
};

/// The last one made is kept: the landmarks of a hand and its meshes follow from the same flesh.
std::shared_ptr<const Anatomy> anatomy_of(const HandOptions& options) {
  const HandPose pose = hand_pose(options.pose, options.joints);
  require_within("breadth", options.breadth, 0.05, 0.15);
  require_within("length", options.length, 0.12, 0.26);
  require_within("forearm", options.forearm, 0.0, kMostForearm);
  using Key = std::tuple<JointAngles, double, double, double>;
  static std::mutex mutex;
  static std::pair<Key, std::shared_ptr<const Anatomy>> last;
  const Key key(joint_angles(pose), options.length, options.breadth, options.forearm);
  {
    const std::lock_guard lock(mutex);
    if (last.second && last.first == key) {
      return last.second;
    }
  }
  auto made = std::make_shared<const Anatomy>(pose, options.length, options.breadth, options.forearm);
  const std::lock_guard lock(mutex);
  last = {key, made};
  return made;
}

Vector3 mirrored(const Vector3& x) { return {-x.x(), x.y(), x.z()}; }

EdgeSizing mirrored(const EdgeSizing& sizing) {
  std::vector<SizingZone> zones = sizing.zones();
  for (SizingZone& zone : zones) {
    zone.centre = mirrored(zone.centre);
  }
  return EdgeSizing(sizing.far(), std::move(zones), sizing.growth());
}

/// Mirror image in x, oriented outwards again. Landmarks keep their places.
Body mirrored(const Body& body) {
  Points vertices = body.mesh.vertices();
  vertices.row(0) *= -1.0;
  Triangles triangles = body.mesh.triangles();
  triangles.row(1).swap(triangles.row(2));
  std::vector<Landmark> landmarks = body.landmarks;
  for (Landmark& landmark : landmarks) {
    std::swap(landmark.barycentric(1), landmark.barycentric(2));
  }
  return {TriangleMesh(std::move(vertices), std::move(triangles)), std::move(landmarks)};
}

/// The same with edges half as long where faces cut each other.
EdgeSizing shorter_at(const EdgeSizing& sizing, const TriangleMesh& mesh,
                      const std::vector<std::pair<Eigen::Index, Eigen::Index>>& cuts) {
  std::vector<SizingZone> zones = sizing.zones();
  for (const auto& [face, other] : cuts) {
    const Vector3 at = mesh.centroids().col(face);
    const double edge = sizing.at(at);
    zones.push_back({at, 0.5 * edge, edge});
  }
  return EdgeSizing(sizing.far(), std::move(zones), sizing.growth());
}

/// Parts that touch merge, but an edge that is long against a fold may still draw one side of it through the other.
TriangleMesh mesh_without_cuts(const SoftBody& flesh, EdgeSizing sizing, HandSide side) {
  constexpr int kMostTries = 4;
  for (int tries = 1;; ++tries) {
    TriangleMesh mesh = skin_mesh(flesh, sizing, kHandGrid);
    const auto cuts = self_intersections(mesh);
    if (cuts.empty()) {
      return mesh;
    }
    if (tries == kMostTries) {
      const Vector3 left = mesh.centroids().col(cuts.front().first);
      throw InputError(fmt::format(
          "hand: the skin intersects itself near {} of the hand's own frame, in a fold that is too narrow for these "
          "edges: request shorter edges, or joint angles that keep these parts apart or press them together",
          place_text(side == HandSide::kLeft ? left : mirrored(left))));
    }
    sizing = shorter_at(sizing, mesh, cuts);
  }
}

Body finished(const HandOptions& options, const Anatomy& anatomy, TriangleMesh mesh) {
  std::vector<Landmark> landmarks;
  for (const std::string& name : hand_landmark_names()) {
    landmarks.push_back(nearest_landmark(mesh, name, landmark_on_skin(anatomy.skeleton, anatomy.flesh, name)));
  }
  Body left{std::move(mesh), std::move(landmarks)};
  return options.side == HandSide::kLeft ? std::move(left) : mirrored(left);
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
  require_within("edge", options.edge, kLeastHandEdge, kMostHandEdge);
  return hand(options, EdgeSizing(options.edge));
}

Body hand(const HandOptions& options, const EdgeSizing& sizing) {
  require_within("sizing.finest", sizing.finest(), kLeastHandEdge, kMostHandEdge);
  require_within("sizing.far", sizing.far(), kLeastHandEdge, kMostHandEdge);
  const auto anatomy = anatomy_of(options);
  return finished(
      options, *anatomy,
      mesh_without_cuts(anatomy->flesh, options.side == HandSide::kLeft ? sizing : mirrored(sizing), options.side));
}

SizingZone hand_zone(double length, double edge) {
  return {{0, 0.5 * (length - kHandStub), 0}, edge, 0.5 * (length + kHandStub)};
}

Vector3 hand_landmark(const HandOptions& options, const std::string& name) {
  const auto anatomy = anatomy_of(options);
  const Vector3 left = landmark_on_skin(anatomy->skeleton, anatomy->flesh, name);
  return options.side == HandSide::kLeft ? left : mirrored(left);
}

Eigen::VectorXd hand_distances(const HandOptions& options, const Points& points) {
  const auto anatomy = anatomy_of(options);
  Eigen::VectorXd distances(points.cols());
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    const Vector3 x = points.col(i);
    distances(i) = anatomy->flesh.distance(options.side == HandSide::kLeft ? x : mirrored(x));
  }
  return distances;
}

}  // namespace touchfield
