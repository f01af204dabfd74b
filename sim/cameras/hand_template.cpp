#include "sim/cameras/hand_template.h"

#include <cmath>
#include <utility>

#include <Eigen/Geometry>

#include "sim/core/units.h"
#include "sim/hand/hand_contact.h"
#include "sim/hand/hand_flesh.h"
#include "sim/mesh/face_shape.h"
#include "sim/mesh/query/face_tree.h"

namespace touchfield {

HandSkeleton proportioned_skeleton(const HandPose& pose, double length, double breadth, const HandProportions& by) {
  HandSkeleton skeleton =
      posed_skeleton(pose, length * std::exp(by(kLengthRatio)), breadth * std::exp(by(kBreadthRatio)));
  for (std::size_t d = 0; d < HandSkeleton::kDigits; ++d) {
    BoneChain& chain = d == 0 ? skeleton.thumb : skeleton.fingers[d - 1];
    const BoneChain before = chain;
    const double stretch = std::exp(by(kDigitRatios + static_cast<Eigen::Index>(d)));
    const double girth = std::exp(by(kGirthRatios + static_cast<Eigen::Index>(d)));
    for (std::size_t i = 0; i < 3; ++i) {
      chain.joints[i + 1] = chain.joints[i] + stretch * (before.joints[i + 1] - before.joints[i]);
    }
    for (double& radius : chain.radii) {
      radius *= girth;
    }
  }
  return skeleton;
}

namespace {

double bone_length(const BoneChain& chain, std::size_t bone) {
  return (chain.joints[bone + 1] - chain.joints[bone]).norm();
}

}  // namespace

ShapeMap::ShapeMap(const HandSkeleton& made_in, const HandSkeleton& of, const HandProportions& by) {
  const double broad = std::exp(by(kBreadthRatio));
  RigidMotion& palm = maps_[SkinnedHand::kPalm];
  palm.rotation = Vector3(broad, std::exp(by(kLengthRatio)), broad * std::exp(by(kPalmRatio))).asDiagonal();
  for (std::size_t d = 0; d < HandSkeleton::kDigits; ++d) {
    const BoneChain& from = made_in.digit(d);
    const BoneChain& to = of.digit(d);
    const double across = broad * std::exp(by(kGirthRatios + static_cast<Eigen::Index>(d)));
    for (std::size_t bone = 0; bone < 3; ++bone) {
      const Vector3 stretch(across, bone_length(to, bone) / bone_length(from, bone), across);
      RigidMotion& map = maps_[SkinnedHand::bone_number(d, bone)];
      map.rotation = bone_frame(to, bone) * stretch.asDiagonal() * bone_frame(from, bone).transpose();
      map.shift = to.joints[bone] - map.rotation * from.joints[bone];
    }
  }
  maps_[SkinnedHand::kSwing] = maps_[SkinnedHand::bone_number(0, 0)];
}

Vector3 ShapeMap::operator()(const Vector3& x, std::span<const SkinnedHand::Influence> influences) const {
  Vector3 sum = Vector3::Zero();
  for (const SkinnedHand::Influence& one : influences) {
    sum += one.weight * maps_[one.bone](x);
  }
  return sum;
}

namespace {

TriangleMesh skin_on_flesh(const HandShape& hand_shape, const HandPose& pose, double edge) {
  const Body body = hand({hand_shape.pose, hand_shape.breadth, hand_shape.length, hand_shape.side, edge,
                          hand_shape.joints, hand_shape.forearm});
  Points vertices = body.mesh.vertices();
  const double side = mirror_sign(hand_shape.side);
  vertices.row(0) *= side;
  hand_flesh(posed_skeleton(pose, hand_shape.length, hand_shape.breadth), hand_shape.forearm)
      .project(vertices, 0.2 * edge);
  vertices.row(0) *= side;
  return {std::move(vertices), body.mesh.triangles()};
}

}  // namespace

void vertex_normals(const Points& vertices, const Triangles& triangles, Points& normals) {
  normals.setZero(3, vertices.cols());
  for (Eigen::Index f = 0; f < triangles.cols(); ++f) {
    const Vector3 area = twice_area_vector(vertices, triangles.col(f));
    for (int c = 0; c < 3; ++c) {
      normals.col(triangles(c, f)) += area;
    }
  }
  normals.colwise().normalize();
}

JointAngles joints_without_contact(const HandPose& pose, double length, double breadth) {
  constexpr double kTurn = 3 * kDegree;
  const HandContacts contacts(posed_skeleton(pose, length, breadth));
  const JointAngles angles = joint_angles(pose);
  JointAngles free = JointAngles::Ones();
  for (Eigen::Index j = 0; j < angles.size(); ++j) {
    for (const double turn : {-kTurn, kTurn}) {
      JointAngles turned = angles;
      turned(j) += turn;
      const auto contact = contacts.at(posed_skeleton(with_angles(pose, turned), length, breadth));
      if (contact && contact->kind == ContactKind::kMoved) {
        free(j) = 0;
      }
    }
  }
  return free;
}

HandTemplate::HandTemplate(const HandShape& hand, double edge)
    : HandTemplate(hand, hand_pose(hand.pose, hand.joints),
                   skin_on_flesh(hand, hand_pose(hand.pose, hand.joints), edge)) {}

HandTemplate::HandTemplate(const HandShape& hand, const HandPose& pose, TriangleMesh mesh)
    : hand_(hand),
      pose_(pose),
      skeleton_(posed_skeleton(pose, hand.length, hand.breadth)),
      mesh_(std::move(mesh)),
      skin_(mesh_.vertices(), skeleton_, hand.side),
      free_(joints_without_contact(pose, hand.length, hand.breadth)),
      round_(mesh_.triangles(), mesh_.vertex_count()) {}

Points HandTemplate::shaped_points(const SkinnedHand& skin, const Points& points, const ShapeMap& map) const {
  Points result(3, points.cols());
  for (Eigen::Index v = 0; v < points.cols(); ++v) {
    const Vector3 x(side() * points(0, v), points(1, v), points(2, v));
    result.col(v) = map(x, skin.influences(v));
  }
  result.row(0) *= side();
  return result;
}

HandSkeleton HandTemplate::skeleton_at(const HandProportions& by, const JointAngles& joints) const {
  return proportioned_skeleton(with_angles(pose_, joints), hand_.length, hand_.breadth, by);
}

ShapedHand HandTemplate::shaped(const HandProportions& by, const Eigen::VectorXd& offset) const {
  ShapedHand shape{by, offset, skeleton_at(by, joint_angles(pose_)), {}, {}};
  shape.rest = shaped_points(skin_, mesh_.vertices(), ShapeMap(skeleton_, shape.skeleton, by));
  if (offset.size() == 0) {
    shape.offset.setZero(mesh_.vertex_count());
  }
  vertex_normals(shape.rest, mesh_.triangles(), shape.displacement);
  shape.displacement = shape.displacement * shape.offset.asDiagonal();
  shape.rest += shape.displacement;
  return shape;
}

HandTemplate::Carrier HandTemplate::carrier(const Points& points) const {
  return {SkinnedHand(points, skeleton_, hand_.side), points, bound(mesh_, points)};
}

void HandTemplate::carry(const ShapedHand& shape, const HandSkeleton& posed, const Carrier& carrier,
                         Points& points) const {
  Points rest = shaped_points(carrier.skin, carrier.rest, ShapeMap(skeleton_, shape.skeleton, shape.proportions));
  for (Eigen::Index i = 0; i < rest.cols(); ++i) {
    const auto face = mesh_.triangles().col(carrier.binding.face[static_cast<std::size_t>(i)]);
    rest.col(i) += shape.displacement(Eigen::all, face) * carrier.binding.weights.col(i);
  }
  carrier.skin.pose(rest, shape.skeleton, posed, points);
}

}  // namespace touchfield
