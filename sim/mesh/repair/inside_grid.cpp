#include "sim/mesh/repair/inside_grid.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <Eigen/Geometry>

namespace touchfield {

namespace {

constexpr double kMargin = 2.0;  // spacings about the surface
// Off the planes that files like to put faces in, other along each axis.
constexpr std::array<double, 3> kOffset = {0.3819, 0.4142, 0.2679};

// Sides: the sign, and how it is known.
constexpr signed char kAsked = 1;
constexpr signed char kChanged = 2;  // dropped or filled

bool inside(signed char side) { return side < 0; }
bool is_changed(signed char side) { return std::abs(side) == kChanged; }

NodeGrid grid_about(const TriangleMesh& surface, double spacing) {
  NodeGrid grid{surface.vertices().rowwise().minCoeff(), spacing, {}};
  const Vector3 size = surface.vertices().rowwise().maxCoeff() - grid.origin;
  for (int axis = 0; axis < 3; ++axis) {
    grid.origin(axis) -= (kMargin + kOffset[static_cast<std::size_t>(axis)]) * spacing;
    grid.count[static_cast<std::size_t>(axis)] = static_cast<int>(size(axis) / spacing + 2.0 * kMargin) + 2;
  }
  return grid;
}

}  // namespace

double node_count(const Vector3& box, double spacing) { return ((box / spacing).array() + 2.0 * kMargin + 2.0).prod(); }

InsideGrid::InsideGrid(const TriangleMesh& soup, double spacing)
    : soup_(soup), tree_(soup), grid_(grid_about(soup, spacing)) {
  stride_ = {1, grid_.index(0, 1, 0), grid_.index(0, 0, 1)};
  sides_.assign(grid_.size(), kAsked);
  constexpr int kBox = 16;
  Node boxes;
  std::ranges::transform(grid_.count, boxes.begin(), [](int count) { return (count + kBox - 1) / kBox; });
#pragma omp parallel for schedule(dynamic)
  for (int box = 0; box < boxes[0] * boxes[1] * boxes[2]; ++box) {
    sample({box % boxes[0] * kBox, box / boxes[0] % boxes[1] * kBox, box / boxes[0] / boxes[1] * kBox}, kBox);
  }
  turn_thin(true);
  turn_thin(false);
  part_crossed_sides();
}

/// Finds the sides of a box of side^3 nodes.
void InsideGrid::sample(const Node& first, int side) {
  constexpr double kClear = 0.4;  // of w from 1/2: it does not pass 1/2 nearby without a face
  const Vector3 middle = point(first).array() + 0.5 * (side - 1) * grid_.spacing;
  const double reach = 0.5 * std::sqrt(3.0) * side * grid_.spacing;
  const bool near = side > 1 && tree_.nearest(middle, reach).face >= 0;
  const double w = near ? kInsideAbove : tree_.winding_number(middle);
  if (side > 1 && std::abs(w - kInsideAbove) < kClear) {
    for (int part = 0; part < 8; ++part) {
      const int half = side / 2;
      const Node corner{first[0] + part % 2 * half, first[1] + part / 2 % 2 * half, first[2] + part / 4 * half};
      if (corner[0] < grid_.count[0] && corner[1] < grid_.count[1] && corner[2] < grid_.count[2]) {
        sample(corner, half);
      }
    }
    return;
  }
  const auto end = [&](std::size_t axis) { return std::min(first[axis] + side, grid_.count[axis]); };
  for (int k = first[2]; k < end(2); ++k) {
    for (int j = first[1]; j < end(1); ++j) {
      std::fill_n(sides_.begin() + static_cast<std::ptrdiff_t>(grid_.index(first[0], j, k)), end(0) - first[0],
                  static_cast<signed char>(w > kInsideAbove ? -kAsked : kAsked));
    }
  }
}

/// The nodes off the grid's border, which no face reaches.
template <class Visit>
void InsideGrid::for_each_inner_node(const Visit& visit) const {
  for (int k = 1; k < grid_.count[2] - 1; ++k) {
    for (int j = 1; j < grid_.count[1] - 1; ++j) {
      for (int i = 1; i < grid_.count[0] - 1; ++i) {
        visit(grid_.index(i, j, k));
      }
    }
  }
}

/// Changes the nodes on one side that have neighbours on the other on both sides along an axis.
void InsideGrid::turn_thin(bool are_inside) {
  std::vector<std::size_t> thin;
  for_each_inner_node([&](std::size_t node) {
    if (inside(sides_[node]) == are_inside && std::ranges::any_of(stride_, [&](std::size_t stride) {
          return inside(sides_[node - stride]) != are_inside && inside(sides_[node + stride]) != are_inside;
        })) {
      thin.push_back(node);
    }
  });
  for (const std::size_t node : thin) {
    sides_[node] = are_inside ? kChanged : -kChanged;
  }
}

/// Fills a node wherever two nodes inside face each other across a side of a cell whose other two nodes are outside:
/// there the surface's edges would have four faces.
void InsideGrid::part_crossed_sides() {
  for (bool found = true; found;) {
    found = false;
    for_each_inner_node([&](std::size_t node) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const std::size_t u = stride_[(axis + 1) % 3];
        const std::size_t v = stride_[(axis + 2) % 3];
        const bool here = inside(sides_[node]);
        if (here == inside(sides_[node + u + v]) && here != inside(sides_[node + u]) &&
            here != inside(sides_[node + v])) {
          sides_[here ? node + u : node] = -kChanged;
          found = true;
        }
      }
    });
  }
}

/// Where between two nodes on different sides w passes 1/2, 0..1.
double InsideGrid::crossing(const Node& node, std::size_t axis) const {
  const std::size_t index = grid_.index(node[0], node[1], node[2]);
  const bool begin = is_changed(sides_[index]);
  const bool end = is_changed(sides_[index + stride_[axis]]);
  // Of a node that was dropped or filled as little as possible is lost or gained.
  constexpr double kLittle = 0.1;
  if (begin || end) {
    return begin == end ? 0.5 : (begin ? kLittle : 1.0 - kLittle);
  }
  const bool begins_inside = inside(sides_[index]);
  const Vector3 start = point(node);
  const Vector3 along = grid_.spacing * Vector3::Unit(static_cast<Eigen::Index>(axis));
  const auto passed = [&](double at) { return is_inside(start + at * along) != begins_inside; };
  // Mostly it does so on the nearest face.
  constexpr double kNear = 0.01;
  if (const SkinPoint skin = tree_.nearest(start + 0.5 * along, grid_.spacing); skin.face >= 0) {
    const Vector3 normal = soup_.normals().col(skin.face);
    const double at = normal.dot(skin.at - start) / normal.dot(along);
    if (at > kNear && at < 1.0 - kNear && !passed(at - kNear) && passed(at + kNear)) {
      return at;
    }
  }
  double at = 0.5;
  for (double step = 0.25; step > 0.5 * kNear; step *= 0.5) {
    at += passed(at) ? -step : step;
  }
  return at;
}

Isosurface InsideGrid::surface() const {
  // In spacings from the first node, so that a vertex says which edge it is on.
  Isosurface result = isosurface({Vector3::Zero(), 1.0, grid_.count}, sides_);
#pragma omp parallel for schedule(dynamic, 256)
  for (Eigen::Index i = 0; i < result.points.cols(); ++i) {
    const Vector3 vertex = result.points.col(i);
    const Vector3 below = vertex.array().floor();
    int axis = 0;
    (vertex - below).maxCoeff(&axis);
    // Rounding may leave the other two just below a node.
    Vector3 start = vertex.array().round();
    start(axis) = below(axis);
    const Eigen::Array3i place = start.cast<int>();
    start(axis) += crossing({place(0), place(1), place(2)}, static_cast<std::size_t>(axis));
    result.points.col(i) = grid_.origin + grid_.spacing * start;
  }
  return result;
}

}  // namespace touchfield
