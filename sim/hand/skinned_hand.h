#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "sim/core/rigid_motion.h"
#include "sim/hand/hand.h"
#include "sim/hand/hand_pose.h"
#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// The skin of the built-in hand, carried to other poses from the one in which it was meshed. All poses have the same
/// triangles. The skin is carried vertex by vertex, so that any part of a mesh moves as the whole does. Landmarks
/// follow (body.h).
///
/// Every vertex is bound to up to a few of 17 bones: the palm, three of each digit, and the thumb's metacarpal without
/// its turn about itself. q_b are the unit dual quaternions of the bones' motions from the one skeleton to the other.
/// The vertex's weights are w_b >= 0, sum 1. The vertex moves by
///
///   q / |q|,   q = sum_b +-w_b q_b   (each with the sign that turns the same way as that of the heaviest bone)
///
/// Along a digit the weight passes from bone to bone near each joint. It does so within 1.8 radii of the flesh there
/// (knuckles 2, the thumb's base 1.5). The slope is constant over the middle half and falls linearly to 0 outside it.
/// Between digits the weight falls as (1 - d/s)^3. Here d is the vertex's distance from the flesh of one digit minus
/// that from the nearest digit's. s is wide at the webs (5 radii of the base, thumb 3) and narrow along the free digits
/// (0.35, thumb 0.5).
///
/// accuracy   the template's pose gives the template to 1e-12 m. Volume within 3 % of that of hand(), and no face
///            inverted where pose() is given the triangles, in poses that HandContacts has nothing against
///            (docs/bodies.md gives the measurements)
/// source     Kavan, Collins, Zara and O'Sullivan, ACM Trans. Graph. 27 (2008) 105 (dual quaternions)
class SkinnedHand {
 public:
  /// vertices   3 x V [m], of a mesh of the hand in its own frame or of any part of it, caps included
  /// made_in    of the pose that it was meshed in, as posed_skeleton makes it: of the left hand for either side
  /// throws     InputError if there is no vertex or one is not finite
  SkinnedHand(const Points& vertices, const HandSkeleton& made_in, HandSide side = HandSide::kRight);

  /// Places of the vertices in another pose [m], in the hand's own frame; about 30 ns per vertex. No memory is taken if
  /// `vertices` has their size already.
  ///
  /// throws   InputError if the skeleton is of a hand of another length or breadth
  void pose(const HandSkeleton& posed, Points& vertices) const;

  /// The same, with faces kept from turning over. A face is mended if it shows less than 0.02 of its template's area to
  /// the side that its corners turned it to. Its corners then take over its mean motion, in rounds, more of it the less
  /// the face shows. The result is continuous in the pose. All other vertices are as skinned, to the last bit. 0.3 to
  /// 0.5 ms for 2,400 faces.
  ///
  /// triangles   3 x M
  void pose(const HandSkeleton& posed, const Triangles& triangles, Points& vertices) const;

  /// The same as the first with the weights of these vertices and other places of them: of a hand of other proportions.
  ///
  /// rest   3 x V [m], in the hand's own frame, about the bones `from`; `posed` has the same bones in another pose
  void pose(const Points& rest, const HandSkeleton& from, const HandSkeleton& posed, Points& vertices) const;

  static constexpr std::size_t kBones = 17;
  static constexpr std::size_t kPalm = 0;
  static constexpr std::size_t kSwing = 16;  // the thumb's metacarpal without its turn about itself
  /// Bone 0 to 2 of a digit (0 the thumb, then the fingers from index to little).
  static constexpr std::size_t bone_number(std::size_t digit, std::size_t bone) { return 1 + 3 * digit + bone; }

  /// How the bones of a left hand move from one skeleton to another.
  static std::array<RigidMotion, kBones> bone_motions(const HandSkeleton& from, const HandSkeleton& to);

  struct Influence {
    std::size_t bone;
    double weight;
  };
  /// The bones to which a vertex is bound, the heaviest first.
  std::span<const Influence> influences(Eigen::Index vertex) const {
    const auto v = static_cast<std::size_t>(vertex);
    return std::span(influences_).subspan(starts_[v], starts_[v + 1] - starts_[v]);
  }

  /// The faces whose normal in a pose does not point to the side that their bones turned it to: n . sum_c R_c n0 > 0
  /// does not hold, n0 the template's normal and R_c the rotation that moved corner c.
  ///
  /// vertices    3 x V as pose() left them
  /// triangles   3 x M
  std::vector<Eigen::Index> inverted_faces(const HandSkeleton& posed, const Points& vertices,
                                           const Triangles& triangles) const;

  Eigen::Index vertex_count() const { return template_.cols(); }

  /// The bone to which a vertex is bound most, in words: "middle phalanx of the index finger".
  std::string part_of(Eigen::Index vertex) const;

 private:
  /// A rigid motion: (w, x, y, z) of the rotation, and of half the shift times the rotation.
  struct DualQuaternion {
    Eigen::Vector4d real = Eigen::Vector4d::Zero();
    Eigen::Vector4d dual = Eigen::Vector4d::Zero();
    void add(const DualQuaternion& other, double weight);
    void normalize();
  };
  using Motions = std::array<DualQuaternion, kBones>;

  static Motions dual_quaternions(const std::array<RigidMotion, kBones>& motions);
  void add_influences(const Vector3& x);
  Motions motions_to(const HandSkeleton& posed) const;
  void move(const Motions& motions, const Points& rest, double side, Points& vertices) const;
  Points expected_normals(const std::vector<DualQuaternion>& moves, const Triangles& triangles) const;
  static Vector3 placed(const DualQuaternion& q, const Vector3& x);
  DualQuaternion blended(const Motions& motions, Eigen::Index vertex) const;
  std::vector<DualQuaternion> blended(const Motions& motions) const;  // of all vertices

  HandSkeleton made_in_;
  double side_;      // mirror_sign
  Points template_;  // of the left hand
  std::vector<Influence> influences_;
  std::vector<std::size_t>
      starts_;  // of vertex v: influences_[k], starts_[v] <= k < starts_[v + 1], the heaviest first
};

/// A bone of a digit (0 the thumb, then the fingers from index to little) in words.
std::string bone_name(std::size_t digit, std::size_t bone);

/// The frame of a bone, in columns: across it, along it, and to its palm side.
Eigen::Matrix3d bone_frame(const BoneChain& chain, std::size_t bone);

}  // namespace touchfield
