#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include <Eigen/Geometry>

#include "sim/mesh/cut/capped_cut.h"
#include "sim/mesh/face_shape.h"
#include "sim/mesh/remesh/edit_mesh.h"

namespace touchfield {

namespace {

constexpr double kThin = 25.0 * std::numbers::pi / 180;
constexpr double kNoNormal = 3.0 * std::numbers::pi / 180;
constexpr double kBetter = 0.5 * std::numbers::pi / 180;  // the least gain for which a change is made
constexpr double kCrease = 0.64;                          // cosine between the normals of two faces
constexpr double kCoplanar = 0.866;                       // cosine between two faces whose common edge may flip
constexpr double kTurned = 0.8;                           // cosine by which a face may turn
constexpr double kTurnedOnShortWay = 0.3;                 // the same where a point moves by less than kShort
constexpr double kStraight = 0.8;  // cosine by which a rim or crease may bend at a point left out
constexpr double kShort = 0.2;     // of the longest edge at a point
constexpr double kVeryShort = 0.15;

class Mender {
 public:
  explicit Mender(CappedSurface& surface) : surface_(surface), mesh_(surface.triangles, surface.points.cols()) {}

  void mend() {
    constexpr int kRounds = 10;
    for (int i = 0; i < kRounds && round(); ++i) {
    }
    std::vector<int> numbers;
    std::vector<bool> is_cap;
    for (int side = 0; side < mesh_.side_count(); side += 3) {
      if (mesh_.alive(side)) {
        is_cap.push_back(cap(side));
      }
    }
    surface_.triangles = mesh_.compact(numbers);
    std::vector<bool> is_fixed;
    for (const int v : numbers) {
      is_fixed.push_back(surface_.is_fixed[static_cast<std::size_t>(v)]);
    }
    surface_.points = Points(surface_.points(Eigen::all, numbers));
    surface_.is_cap = std::move(is_cap);
    surface_.is_fixed = std::move(is_fixed);
  }

 private:
  enum class Kind { kNone, kFlip, kCollapse };
  struct Change {
    Kind kind = Kind::kNone;
    int side = -1;
    double gain = kBetter;
  };

  Vector3 point(int v) const { return surface_.points.col(v); }
  bool cap(int side) const { return surface_.is_cap[static_cast<std::size_t>(side / 3)]; }
  bool is_rim(int side) const { return cap(side) != cap(mesh_.opposite(side)); }

  Vector3 normal(int side) const {
    const Vector3 a = point(mesh_.from(side));
    return (point(mesh_.to(side)) - a).cross(point(mesh_.apex(side)) - a).normalized();
  }
  double angle(int side) const {
    return smallest_angle(point(mesh_.from(side)), point(mesh_.to(side)), point(mesh_.apex(side)));
  }
  /// The thinnest faces' normals say nothing.
  bool has_normal(int side) const { return angle(side) > kNoNormal; }
  bool is_crease(int side) const {
    const int other = mesh_.opposite(side);
    return is_rim(side) || (has_normal(side) && has_normal(other) && normal(side).dot(normal(other)) < kCrease);
  }

  double length(int side) const { return (point(mesh_.from(side)) - point(mesh_.to(side))).norm(); }

  /// The mean normal of the faces round a vertex that are caps or are not.
  Vector3 normal_about(int v, bool of_cap) const {
    Vector3 sum = Vector3::Zero();
    for (const int around : mesh_.around(v)) {
      if (cap(around) == of_cap && has_normal(around)) {
        sum += normal(around);
      }
    }
    return sum.normalized();
  }

  /// Short edges, then the thinnest faces first. Returns whether anything changed.
  bool round() {
    bool changed = collapse_short_edges();
    std::vector<std::pair<double, int>> thin;
    for (int side = 0; side < mesh_.side_count(); side += 3) {
      if (mesh_.alive(side) && angle(side) < kThin) {
        thin.emplace_back(angle(side), side);
      }
    }
    std::sort(thin.begin(), thin.end());
    for (const auto& [smallest, face] : thin) {
      if (mesh_.alive(face) && angle(face) < kThin) {
        changed = improve(face) || changed;
      }
    }
    return changed;
  }

  bool improve(int face) {
    Change best;
    for (int side = face; side < face + 3; ++side) {
      consider_flip(side, best);
      consider_collapse(side, best);
      consider_collapse(mesh_.opposite(side), best);
    }
    if (best.kind == Kind::kFlip) {
      mesh_.flip(best.side);
    } else if (best.kind == Kind::kCollapse) {
      mesh_.collapse(best.side);
    }
    return best.kind != Kind::kNone;
  }

  static void take(Change& best, Kind kind, int side, double gain) {
    if (gain > best.gain) {
      best = {kind, side, gain};
    }
  }

  void consider_flip(int side, Change& best) const {
    const int other = mesh_.opposite(side);
    if (is_rim(side) || !mesh_.can_flip(side)) {
      return;
    }
    const Vector3 a = point(mesh_.from(side));
    const Vector3 b = point(mesh_.to(side));
    const Vector3 c = point(mesh_.apex(side));
    const Vector3 d = point(mesh_.apex(other));
    // A thin face's own normal says little: the larger of the two faces tells how the surface lies.
    const Vector3 one = (b - a).cross(c - a);
    const Vector3 two = (d - a).cross(b - a);
    const Vector3 surface = (one + two).normalized();
    if (std::min(one.norm(), two.norm()) > 0.1 * std::max(one.norm(), two.norm()) &&
        one.normalized().dot(two.normalized()) < kCoplanar) {
      return;
    }
    if ((d - a).cross(c - a).normalized().dot(surface) < kCoplanar ||
        (b - d).cross(c - d).normalized().dot(surface) < kCoplanar) {
      return;
    }
    const double before = std::min(angle(side), angle(other));
    take(best, Kind::kFlip, side, std::min(smallest_angle(a, d, c), smallest_angle(d, b, c)) - before);
  }

  struct Collapse {
    bool allowed = false;
    double before = kThin;  // smallest angle of the faces round the point that leaves
    double after = kThin;
  };

  /// Moving the start of a side into its end.
  Collapse collapse_of(int side) const {
    Collapse result;
    if (!may_leave(side) || !mesh_.can_collapse(side)) {
      return result;
    }
    const int v = mesh_.from(side);
    const int target = mesh_.to(side);
    const Vector3 x = point(target);
    const double longest_before = longest_at(v);
    const double least_cosine = length(side) < kShort * longest_before ? kTurnedOnShortWay : kTurned;
    result.allowed = true;
    for (const int around : mesh_.around(v)) {
      const int to_b = mesh_.to(around);
      const int to_c = mesh_.apex(around);
      result.before = std::min(result.before, angle(around));
      if (to_b != target && to_c != target) {
        constexpr double kLonger = 1.6;
        const Vector3 turned = (point(to_b) - x).cross(point(to_c) - x).normalized();
        const Vector3 reference = has_normal(around) ? normal(around) : normal_about(v, cap(around));
        result.allowed = result.allowed && turned.dot(reference) > least_cosine &&
                         (point(to_b) - x).norm() < kLonger * longest_before;
        result.after = std::min(result.after, smallest_angle(x, point(to_b), point(to_c)));
      }
    }
    return result;
  }

  void consider_collapse(int side, Change& best) const {
    if (const Collapse collapse = collapse_of(side); collapse.allowed) {
      take(best, Kind::kCollapse, side, collapse.after - collapse.before);
    }
  }

  /// Collapses the edges that are far shorter than others at their ends, the shortest first: faces among them may have
  /// good angles, but those about them cannot.
  bool collapse_short_edges() {
    std::vector<std::pair<double, int>> shorts;
    for (int side = 0; side < mesh_.side_count(); ++side) {
      if (mesh_.alive(side) && side < mesh_.opposite(side) && is_very_short(side)) {
        shorts.emplace_back(length(side), side);
      }
    }
    std::sort(shorts.begin(), shorts.end());
    bool changed = false;
    for (const auto& [length, side] : shorts) {
      if (!mesh_.alive(side) || !is_very_short(side)) {
        continue;
      }
      const Collapse forth = collapse_of(side);
      const Collapse back = collapse_of(mesh_.opposite(side));
      const bool is_forth = forth.allowed && (!back.allowed || forth.after >= back.after);
      if (const Collapse& best = is_forth ? forth : back; best.allowed && best.after > 0.5 * best.before) {
        mesh_.collapse(is_forth ? side : mesh_.opposite(side));
        changed = true;
      }
    }
    return changed;
  }

  double longest_at(int v) const {
    double longest = 0;
    for (const int around : mesh_.around(v)) {
      longest = std::max(longest, length(around));
    }
    return longest;
  }

  bool is_very_short(int side) const {
    return length(side) < kVeryShort * std::max(longest_at(mesh_.from(side)), longest_at(mesh_.to(side)));
  }
  bool is_within_tolerance(int side) const { return length(side) < surface_.tolerance(point(mesh_.from(side))); }

  /// Whether the start of a side may go: a point of a rim along the rim, and one of a rim or crease if that is straight
  /// there or the way is short.
  bool may_leave(int side) const {
    const int v = mesh_.from(side);
    if (surface_.is_fixed[static_cast<std::size_t>(v)]) {
      return false;
    }
    std::array<Vector3, 2> along;
    std::size_t creases = 0;
    std::size_t rims = 0;
    for (const int around : mesh_.around(v)) {
      if (is_crease(around)) {
        if (creases < 2) {
          along[creases] = (point(mesh_.to(around)) - point(v)).normalized();
        }
        ++creases;
        rims += is_rim(around) ? 1 : 0;
      }
    }
    if (rims > 0 && !is_rim(side)) {
      return false;
    }
    if (rims > 2 || creases > 2) {
      return rims <= 2 && is_very_short(side) && is_within_tolerance(side);
    }
    return creases == 0 || (length(side) < kShort * longest_at(v) && is_within_tolerance(side)) ||
           (creases == 2 && rims != 1 && is_crease(side) && along[0].dot(along[1]) < -kStraight);
  }

  CappedSurface& surface_;
  EditMesh mesh_;
};

}  // namespace

void remove_thin_faces(CappedSurface& surface) { Mender(surface).mend(); }

}  // namespace touchfield
