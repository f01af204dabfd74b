#pragma once

#include <memory>
#include <string>
#include <vector>

#include "sim/field/skin_mask.h"
#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// What of a box belongs to the target.
enum class TargetShape {
  kBox,       // all of it
  kCylinder,  // the cylinder about its own z of diameter size.x
  kMask,      // the skin that its mask marks
};

/// A virtual box in space, or what it holds of a cylinder or of a mask. Its width axis is its own x, its depth axis its
/// own z.
struct TargetBox {
  Vector3 centre;                                          // [m]
  Vector3 size;                                            // side lengths along its own axes [m]
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();  // own axes as columns
  TargetShape shape = TargetShape::kBox;
  double level = 1.0;  // of the target's pressure, > 0 and <= 1
  std::string key{};   // what messages call the part of the target that it belongs to, with others of the same key;
                       // empty: a part of its own, by its number
  std::shared_ptr<const SkinMask> mask{};  // of kMask, in the box's own frame; null in a result, which does not keep it
};

/// The share of the target's pressure that a box asks for on the skin at x [m]: 0 where it does not hold x.
double level_at(const TargetBox& box, const Vector3& x);

inline bool holds(const TargetBox& box, const Vector3& x) { return level_at(box, x) > 0; }

enum class TargetProfile {
  kUniform,      // the same pressure on every face in a box
  kPenetration,  // proportional to the depth below the face through which the skin enters
};

/// How the faces count in the paper's misfit.
enum class FaceWeights {
  kEqual,  // alike, as published: a fine patch counts as often as it has faces
  kArea,   // by their area
};

/// The faces to press on and the wanted pressure amplitude on each.
struct Target {
  std::vector<Eigen::Index> faces;  // K, ascending
  Eigen::VectorXd amplitudes;       // K [Pa], > 0 except where a penetration is 0
  std::vector<int> box;             // K: which box a face belongs to, the first that holds it
  std::vector<TargetBox> boxes{};   // in the mesh's frame; empty in results of versions that did not keep them

  Eigen::Index size() const { return static_cast<Eigen::Index>(faces.size()); }
};

/// Faces whose centroid lies in a box. A face in several belongs to the first.
///
///   uniform:      p' = level pressure, with level_at the face's centroid
///   penetration:  p' = level pressure depth / max depth; depth is measured along the box's depth axis from its face
///                 through which the skin enters, the one opposite to the mean outward normal of the faces in that box
///
/// pressure   [Pa], > 0
/// throws     InputError if a part holds no face (with the distance to the nearest), or the boxes hold every face
Target make_target(const TriangleMesh& mesh, const std::vector<TargetBox>& boxes, TargetProfile profile,
                   double pressure);

/// Whether every part holds the centroid of a face: what make_target asks for.
bool hold_faces(const TriangleMesh& mesh, const std::vector<TargetBox>& boxes);

/// A target that holds two sides of a body.
struct OppositeSides {
  double share;      // of the target's area: faces that look at another of the same box through the body (Facing) and
                     // whose normal is within 37 degrees of opposite to its normal
  double thickness;  // [m], mean over them of the distance to the nearest such face
  Vector3 at;        // [m], centroid of one of them
};

/// share is 0 where a box lies over one side, even of a ball up to 71 degrees from its pole, and where facing pads meet
/// through the air.
OppositeSides opposite_sides(const TriangleMesh& mesh, const Target& target);

/// The target face nearest to the target's area centroid: where a single focus belongs.
Eigen::Index central_face(const TriangleMesh& mesh, const Target& target);

}  // namespace touchfield
