#pragma once

#include <vector>

#include "sim/cameras/depth_camera.h"
#include "sim/cameras/seen_skin.h"
#include "sim/core/rigid_motion.h"
#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// The nearest place of a skin on a grid round it, to ask thousands of times about hundreds of points: 10 ns where a
/// FaceTree of 4,700 faces takes 3 us.
class SkinGrid {
 public:
  struct Near {
    Vector3 at;      // on the skin [m]
    Vector3 normal;  // there
  };

  /// cell     of the grid [m], > 0
  /// margin   of the grid round the skin [m]
  SkinGrid(const TriangleMesh& skin, double cell, double margin);

  /// The nearest point of the skin to the middle of the cell that x is in, or that is nearest to x.
  const Near& near(const Vector3& x) const {
    const Eigen::Array3i i = ((x - least_) / cell_).array().floor().cwiseMax(0).cwiseMin(last_).cast<int>();
    const int place = (i.z() * count_.y() + i.y()) * count_.x() + i.x();
    return nearest_[static_cast<std::size_t>(place)];
  }

  double cell() const { return cell_; }

 private:
  double cell_;
  Vector3 least_;
  Eigen::Array3i count_;
  Eigen::Array3d last_;  // count - 1
  std::vector<Near> nearest_;
};

/// Points of a skin and its normals there.
struct SkinSamples {
  Points at;      // 3 x S [m]
  Points normal;  // 3 x S, unit

  SkinSamples part(const std::vector<Eigen::Index>& which) const {
    return {at(Eigen::all, which), normal(Eigen::all, which)};
  }
  /// Every k-th, k the whole part of S / most or 1: fewer than 2 `most`.
  SkinSamples thinned(Eigen::Index most) const;
};

/// The mean of what was seen in each cube of 8 mm, cube by cube.
SkinSamples thinned_evenly(const HandPoints& points);

/// Connected parts: in cubes of 15 mm that touch. The largest first, four at most, of 20 points at least.
std::vector<SkinSamples> parts_of(const SkinSamples& samples);

/// What of a part a hand would have been seen at.
struct PossibleHand {
  SkinSamples samples;
  int where;  // 0 the whole part, 1 and 2 its ends along the longest axis
};

/// A part as a whole, if it is not longer than 260 mm, and its ends. Ends are 190 mm (a hand) and 120 mm (a fist) long.
/// An end is taken only if the part is longer than it by a tenth. The order is by `where`.
std::vector<PossibleHand> possible_hands(const SkinSamples& part);

/// Columns: across, along the longest axis, along the shortest; a rotation.
Eigen::Matrix3d principal_axes(const Points& at);

/// Where a hand may be, to start a fit from.
struct HandStart {
  std::size_t skin;   // which of the poses
  double size;        // of the hand, relative to that skin's
  RigidMotion place;  // of the hand's own frame in the world
  double cost;        // 0: explains all that is seen and hides nothing; below 1 it may be a hand
};

/// Finds a hand of which nothing is known in what cameras see, among other things and at the end of a sleeve.
///
/// The points seen are thinned to one point per cube of 8 mm and parted where they are more than about 20 mm apart. In
/// each part the hand may be the whole, or either end of it along its longest axis. There 60 turns are tried, the
/// rotations of an icosahedron relative to the part's principal axes. Every rotation is within 45 degrees of one of
/// them. Each is brought closer by point-to-plane steps, in the middle size. Those of the least cost are brought closer
/// again, in all sizes:
///
///   cost = mean over the points of the part of min(d^2, D^2) / D^2 + mean over the skin's points in images of doubt
///
/// d is the distance of a point from the skin, D = 15 mm. It counts as D where their normals differ by more than 78
/// degrees. Doubt is 1 where a camera sees through the skin and 0.7 where it sees nothing. It is 0.5 where the camera
/// sees something before skin that faces it. Points within 70 mm of the hand's axis behind the end of its skin are a
/// sleeve. Such a point costs 0.2 and moves nothing.
///
/// accuracy   right hands of 180 to 205 mm any way round, three cameras with 0.36 mm of noise, a mean hand's skin in
///            the same pose but for 20 to 29 degrees in two joints of the index finger: alone it is the first start;
///            with a sleeve of 35 mm radius, a box in view or both it was among the six in 54 of 54, not always the
///            first, within 13 degrees and 10 mm. 13 to 19 ms per skin on one core
class HandSearch {
 public:
  /// skins   the hand in some poses, in its own frame (hand.h): y to the fingertips, the skin ends at the least y
  /// sizes   of the hands that are looked for, relative to the skins', > 0
  /// throws  InputError if there is none
  explicit HandSearch(const std::vector<TriangleMesh>& skins, std::vector<double> sizes = {1.0});

  std::size_t skin_count() const { return skins_.size(); }

  /// frame    that the points are from, of the same cameras
  /// most     starts, no two of one skin within 25 mm and 30 degrees of each other, and of one end of one part no more
  ///          than its equal share: a thing that is no hand may cost less than a hand of another size
  /// skins    that are tried, by number
  /// returns  the best first; none if nothing is seen that is large enough
  /// throws   InputError as require_frame does
  std::vector<HandStart> starts(const HandPoints& points, const std::vector<DepthCamera>& cameras,
                                const DepthFrame& frame, std::size_t most, const std::vector<std::size_t>& skins) const;

 private:
  struct Skin {
    SkinGrid grid;
    Points at;      // some of its points [m]
    Points normal;  // there
    Vector3 middle;
    double end;  // least y of what is the hand's [m]
  };
  struct Sight;

  double cost(const HandStart& start, const Points& at, const Points& normal, const Sight& sight,
              Eigen::Index stride) const;
  void bring_closer(HandStart& start, const Points& at, const Points& normal, double reach, int steps) const;
  RigidMotion placed_at(const Skin& skin, double size, const Eigen::Matrix3d& rotation, const Vector3& middle,
                        const Sight& sight) const;

  std::vector<Skin> skins_;
  std::vector<double> sizes_;
};

}  // namespace touchfield
