#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include "sim/core/types.h"
#include "sim/mesh/remesh/mesh_quality.h"
#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// Value of an implicit function: about the signed distance [m], negative inside, and its gradient.
struct ImplicitValue {
  double distance;
  Vector3 gradient;
};

/// The function of a body, and the same within a ball, where it takes less.
struct SkinFunction {
  using Distance = std::function<double(const Vector3&)>;

  Vector3 lower;  // a box around the body [m]
  Vector3 upper;
  Distance distance;
  std::function<Distance(const Vector3& centre, double radius)> within;
};

/// The function of a body near its skin: closed, filled and smoothed on a grid.
///
/// Closed by a ball of radius r: everything that the ball cannot touch from outside is filled. So gaps narrower than
/// 2 r merge and no crease is sharper than the ball.
///
///   g(x) = min(f(x), r - dist(x, {f >= r})),   f the body's own function
///
/// Filled: cavities, which cannot be reached from outside, become part of the body.
///
/// Smoothed: g is blurred with a standard deviation of 1.15 grid spacings h and interpolated by cubic B-splines, twice
/// continuously differentiable. This moves a skin of curvature radii R1, R2 inwards by 0.67 h^2 (1/R1 + 1/R2).
class FinishedSkin {
 public:
  /// radius    of the ball [m], > 0
  /// spacing   of the grid [m], at most the radius
  FinishedSkin(const SkinFunction& body, double radius, double spacing);

  /// Whether the field is known at x: within some spacings of the skin.
  bool covers(const Vector3& x) const;
  /// The field's value where it is known.
  ImplicitValue at(const Vector3& x) const;

 private:
  using Node = std::array<int, 3>;

  std::size_t index(const Node& n) const {
    return (static_cast<std::size_t>(n[2]) * static_cast<std::size_t>(nodes_[1]) + static_cast<std::size_t>(n[1])) *
               static_cast<std::size_t>(nodes_[0]) +
           static_cast<std::size_t>(n[0]);
  }
  std::size_t block_index(const Node& block) const {
    const int place = (block[2] * blocks_[1] + block[1]) * blocks_[0] + block[0];
    return static_cast<std::size_t>(place);
  }
  Vector3 point(const Node& n) const { return origin_ + spacing_ * Vector3(n[0], n[1], n[2]); }
  template <class Visit>
  void for_each_block(const Visit& visit) const;
  template <class Visit>
  void for_each_node(const Node& block, const Visit& visit) const;

  void sample(const SkinFunction& body);
  Points free_surface(std::vector<int>& nearest) const;
  void close_gaps();
  void fill_cavities();
  void blur();

  double radius_;
  double spacing_;
  Vector3 origin_;
  Node nodes_;   // along each axis
  Node blocks_;  // of nodes, along each axis
  std::vector<float> values_;
  std::vector<char> known_;      // by block
  std::vector<Node> near_skin_;  // where the closing may change f; of use only while the field is built
};

/// A ball that glides along a segment, from radius to radius: a tapered capsule. Its distance function is exact.
struct Cone {
  Vector3 a;
  Vector3 b;
  double radius_a;  // [m]
  double radius_b;
};

/// A ball that glides over a triangle, its radius linear between the corners: a thick plate with round rims.
struct Plate {
  Eigen::Matrix3d corners;  // as columns [m]
  Vector3 radii;            // [m]
};

/// Cones and plates that blend into each other.
struct SoftPart {
  std::vector<Cone> cones;
  std::vector<Plate> plates;
  double blend = 0;          // [m], among themselves: fillets of about this size
  double outward_blend = 0;  // [m], with the parts before this one
};

/// Flat end of a body: cuts off what lies beyond the point along the normal, with a rim rounded over `blend` [m].
struct SoftCut {
  Vector3 point;
  Vector3 normal;
  double blend;
};

/// What is done to the union of the parts; see FinishedSkin.
struct SoftFinish {
  double least_gap;  // narrower gaps are filled [m]
  double grid;       // the skin is smoothed at about this length [m]
};

/// A body bounded by a smooth surface: the smooth union of soft parts.
///
/// Its function is negative inside, about the signed distance [m] near the surface, and has gradients of length at most
/// about 1. The union of d1 and d2 with blend k is min(d1, d2) - k/6 max(1 - |d1 - d2|/k, 0)^3, which is twice
/// continuously differentiable; surfaces nearer than k/3 to each other merge.
class SoftBody {
 public:
  using Value = ImplicitValue;

  /// finish   without one, the union is taken as it is
  /// throws   InputError if there is no cone and no plate
  explicit SoftBody(std::vector<SoftPart> parts, std::optional<SoftCut> cut = std::nullopt,
                    std::optional<SoftFinish> finish = std::nullopt);

  Value at(const Vector3& x) const;
  double distance(const Vector3& x) const { return at(x).distance; }

  /// The unfinished body of the shapes that decide its function within a ball: there its values are the very same.
  SoftBody within(const Vector3& centre, double radius) const;

  /// Moves points within `reach` [m] of the surface onto it along the gradient, to 1e-9 m where the surface is smooth.
  void project(Points& points, double reach) const;

  /// A box around the body.
  Vector3 lower() const { return lower_; }
  Vector3 upper() const { return upper_; }

 private:
  /// What bounds a value.
  struct Extremes {
    double least;
    double most;
  };
  /// A ball that no point of a shape is outside of: saves evaluating what is far away.
  struct Bound {
    Vector3 centre;
    double radius;
    double least(const Vector3& x) const { return (x - centre).norm() - radius; }
  };
  /// A cone or a plate with what its value at any point takes.
  struct ConeShape {
    explicit ConeShape(const Cone& cone);
    Value at(const Vector3& x) const;
    Extremes within(const Vector3& centre, double radius) const;

    Cone cone;
    Vector3 axis;
    double length;
    double slope;  // of the side; of no use where one ball lies within the other
    Bound bound;
  };
  struct PlateShape {
    explicit PlateShape(const Plate& plate);
    Value at(const Vector3& x) const;
    Extremes within(const Vector3& centre, double radius) const;

    Plate plate;
    Eigen::Matrix3d sides;  // from each corner to the next
    Vector3 squared_sides;
    Vector3 normal;
    double size;
    Bound bound;
  };
  struct Part {
    explicit Part(const SoftPart& part);
    Value at(const Vector3& x) const;

    std::vector<ConeShape> cones;
    std::vector<PlateShape> plates;
    double blend;
    double outward_blend;
    Bound whole;
  };

  SoftBody(std::optional<SoftCut> cut, Vector3 lower, Vector3 upper)
      : cut_(std::move(cut)), lower_(std::move(lower)), upper_(std::move(upper)) {}
  Value raw_at(const Vector3& x) const;

  std::vector<Part> parts_;
  std::optional<SoftCut> cut_;
  Vector3 lower_;
  Vector3 upper_;
  std::optional<FinishedSkin> finished_;
};

/// Longest edge over the thickness of the body and the width of a cleft. Measured on hands with far edges of 12 mm:
/// with 0.45 the fingers keep their volume within 4 %, with 0.55 they lose up to 8 %, without a bound up to 54 %.
/// Without a bound in clefts, 24 of 60 poses that such a mesh is carried to cut themselves; with it 3.
inline constexpr double kOfRoom = 0.45;
/// Edges that are met however little room there is [m]: skin that closes a cleft may be of any thickness.
inline constexpr double kAlwaysPossible = 5e-3;

/// A closed manifold of nearly equilateral triangles on the surface of a body. Inner cavities are filled.
///
/// Edges above kAlwaysPossible are at most kOfRoom times as long as the body is thick there, and as the air before it
/// is wide. So no thin part becomes a prism or is lost, and clefts stay clear.
///
/// The vertices stand off the surface by the mean sagitta of their faces, by 0.1 of the edge at most. So area and
/// volume are those of the body to second order in edge over radius of curvature.
///
/// sizing         wanted edge lengths: 99 % of the edges are 0.6 to 1.6 times as long as asked at their middles. The
///                number of faces is that of equilateral ones of the lengths asked for within 6 %
/// coarsest_grid  spacing [m] at which the body is sampled first, if `far` of the sizing is not finer: details below
///                are lost, gaps wider stay open; finer zones only follow the surface more closely
/// throws         NumericalError if the body falls into several pieces
TriangleMesh skin_mesh(const SoftBody& body, const EdgeSizing& sizing, double coarsest_grid);

/// The same with one edge length [m] everywhere, met by the mean edge within 2 %.
TriangleMesh skin_mesh(const SoftBody& body, double edge, double coarsest_grid);

}  // namespace touchfield
