#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <vector>

#include "sim/core/types.h"

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

}  // namespace touchfield
