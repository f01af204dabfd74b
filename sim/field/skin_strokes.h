#pragma once

#include <string>
#include <vector>

#include "sim/field/target.h"
#include "sim/mesh/query/face_tree.h"

namespace touchfield {

/// Parts of a target that are drawn on the skin: discs and strips, as boxes that lie on it.
///
/// A box reaches 3 mm above and below the skin, along the mean normal of the faces within half its width. It thus holds
/// one side of a finger.
class SkinStrokes {
 public:
  static constexpr double kDepth = 6e-3;       // [m], of a box
  static constexpr double kLongest = 5e-3;     // [m], of a piece of a strip
  static constexpr std::size_t kMost = 1'000;  // pieces of a strip

  /// mesh   must outlive this
  explicit SkinStrokes(const TriangleMesh& mesh) : mesh_(mesh), tree_(mesh) {}

  /// The disc about the point of the skin that is nearest to `at`.
  ///
  /// at         [m]
  /// diameter   [m], > 0
  TargetBox disc(const Vector3& at, double diameter, double level, const std::string& key) const;

  /// The strip on the skin through the points that are nearest to `points`. Its ends are square. It is closed if the
  /// last point is the first.
  /// Between two points it passes through the skin that is nearest to their middle and faces as the skin at both does
  /// on the mean. The halves are divided likewise, until no piece is longer than the width or kLongest. The pieces' own
  /// x is across the strip, own y along it. They overlap. Sharp bends are rounded by a disc behind all pieces.
  ///
  /// points   2 or more [m]
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
