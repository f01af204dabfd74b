#pragma once

#include <string>
#include <vector>

#include "sim/field/target_box.h"
#include "sim/mesh/query/face_tree.h"
#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

enum class TargetProfile {
  kUniform,      // the same pressure on every face in a box
  kPenetration,  // proportional to the depth below the face through which the skin enters
};

/// What the levels of boxes and the depths of a profile are shares of.
enum class TargetQuantity {
  kPressure,   // of the amplitude p'
  kRadiation,  // of P' = p'^2 / (4 rho c^2), the radiation pressure of a sound that does not flow along the skin
};

/// How the faces count in the paper's misfit.
enum class FaceWeights {
  kEqual,  // alike, as published: a fine patch counts as often as it has faces
  kArea,   // by their area
};

/// The faces to press on, the share of each that belongs to the target, and the wanted pressure amplitude there. What
/// is left of such a face is to stay silent.
struct Target {
  std::vector<Eigen::Index> faces;  // K, ascending
  Eigen::VectorXd amplitudes;       // p', K [Pa], > 0
  std::vector<int> box;             // K: which box a face belongs to, the first that holds its largest part
  Eigen::VectorXd shares;           // s, K: of the face's area, > 0 and <= 1
  std::vector<TargetBox> boxes{};   // in the mesh's frame; empty if the faces were chosen one by one

  Eigen::Index size() const { return static_cast<Eigen::Index>(faces.size()); }

  /// s A, the area of the target on each of its faces, from A of all faces, K.
  Eigen::VectorXd areas(const Eigen::VectorXd& of_faces) const { return shares.cwiseProduct(of_faces(faces)); }
};

/// The faces of which boxes hold a part (face_parts), with their shares. A part in several boxes belongs to the first.
/// p' of a face, or P' if the levels are of it, is the mean over its parts of the largest one times
///
///   uniform:      level
///   penetration:  level depth / max depth; depth is measured along the box's depth axis from its face through which
///                 the skin enters, the one opposite to the mean outward normal of the skin in that box
///
/// pressure   the largest p' [Pa], > 0
/// accuracy   the shares are those of the flat faces; the area is that of the skin in the boxes within 1 %
/// throws     InputError if a part of the target holds less than half a face (with the distance to the nearest), or the
///            boxes hold all of the skin
Target make_target(const TriangleMesh& mesh, const std::vector<TargetBox>& boxes, TargetProfile profile,
                   double pressure, TargetQuantity levels_of = TargetQuantity::kPressure);

/// Whether every part of the target holds as much skin as make_target asks for.
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

/// Parts of a target that are drawn on the skin: discs and strips, as boxes that lie on it.
///
/// A box reaches 3 mm above and below the skin, along the mean normal of the faces within half its width. It thus holds
/// one side of a finger.
class SkinStrokes {
 public:
  static constexpr double kDepth = 6e-3;       // [m], of a box
  static constexpr double kLongest = 5e-3;     // [m], of a piece of a strip
  static constexpr std::size_t kMost = 1'000;  // pieces of a strip
  static constexpr double kReach = 10e-3;      // [m], of a place from the skin that is meant

  /// mesh    must outlive this
  /// reach   places farther than this from the skin are refused [m]
  explicit SkinStrokes(const TriangleMesh& mesh, double reach = kReach) : mesh_(mesh), tree_(mesh), reach_(reach) {}

  /// The point of the skin that is nearest to a place [m].
  ///
  /// key      what the message calls the place
  /// throws   InputError with the distance and the nearest skin if it is out of reach
  SkinPoint on_skin(const Vector3& at, const std::string& key) const;

  /// The disc about the point of the skin that is nearest to `at`.
  ///
  /// at         [m], as on_skin
  /// diameter   [m], > 0
  TargetBox disc(const Vector3& at, double diameter, double level, const std::string& key) const;

  /// The strip on the skin through the points that are nearest to `points`. Its ends are square. It is closed if the
  /// last point is the first.
  /// Between two points it passes through the skin that is nearest to their middle and faces as the skin at both does
  /// on the mean. The halves are divided likewise, until no piece is longer than the width or kLongest. The pieces' own
  /// x is across the strip, own y along it. They overlap. Sharp bends are rounded by a disc behind all pieces.
  ///
  /// points   2 or more [m], as on_skin
  /// width    [m], > 0
  /// throws   InputError if two points in a row are the same, no skin lies between two, or the strip is longer than
  ///          kMost pieces
  std::vector<TargetBox> strip(const std::vector<Vector3>& points, double width, double level,
                               const std::string& key) const;

 private:
  Vector3 normal_about(const Vector3& x, double radius) const;
  SkinPoint middle_of(const SkinPoint& from, const SkinPoint& to) const;
  void add_nodes(const SkinPoint& to, double longest, const std::string& key, std::vector<SkinPoint>& nodes) const;

  const TriangleMesh& mesh_;
  FaceTree tree_;
  double reach_;
};

/// The box round the faces of a surface whose level is above 0, 3 mm above and below them, as a mask. Its own z is
/// their mean normal, and its own x the direction in which they are spread least.
///
/// levels   one per face, 0 to 1, one of them > 0
TargetBox masked_box(const TriangleMesh& surface, const std::vector<double>& levels, const std::string& key);

/// Points of the faces of a surface whose level is above 0, one in every cube of side SkinStrokes::kLongest that holds
/// the centroid of one [m].
std::vector<Vector3> masked_places(const TriangleMesh& surface, const std::vector<double>& levels);

}  // namespace touchfield
