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
constexpr double kSoft = 0.4;  // w nearer to 1/2 than this was not decided by a face beside it

// Sides: the sign, and how it is known.
constexpr signed char kFilledIn = 1;
constexpr signed char kSampled = 2;
constexpr signed char kSampledSoft = 3;
constexpr signed char kChanged = 4;  // dropped or filled

bool inside(signed char side) { return side < 0; }
bool is_soft(signed char side) { return std::abs(side) == kSampledSoft; }
bool is_sampled(signed char side) { return std::abs(side) == kSampled || is_soft(side); }
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

InsideGrid::InsideGrid(const TriangleMesh& soup, double spacing) : tree_(soup), grid_(grid_about(soup, spacing)) {
  stride_ = {1, static_cast<std::size_t>(grid_.count[0]),
             static_cast<std::size_t>(grid_.count[0]) * static_cast<std::size_t>(grid_.count[1])};
  sides_.assign(grid_.size(), kFilledIn);
  find_crossings(soup);
  std::vector<std::size_t> seeds;
  seeds.reserve(2 * crossings_.size());
  for (const Crossing& crossing : crossings_) {
    seeds.push_back(crossing.edge / 3);
    seeds.push_back(crossing.edge / 3 + stride_[crossing.edge % 3]);
  }
  while (!seeds.empty()) {
    for (std::vector<std::size_t> fresh = sample(std::move(seeds)); !fresh.empty();) {
      fresh = sample(about_soft_edges(fresh));
    }
    fill_rows();
    seeds = about_open_edges();
  }
  dropped_ = turn_thin(true);
  filled_ = turn_thin(false);
  part_crossed_sides();
}

std::array<int, 3> InsideGrid::place(std::size_t node) const {
  return {static_cast<int>(node % stride_[1]), static_cast<int>(node % stride_[2] / stride_[1]),
          static_cast<int>(node / stride_[2])};
}

Vector3 InsideGrid::point(std::size_t node) const {
  const auto [i, j, k] = place(node);
  return grid_.origin + grid_.spacing * Vector3(i, j, k);
}

double InsideGrid::winding_along(std::size_t node, int axis, double at) const {
  Vector3 x = point(node);
  x(axis) += at * grid_.spacing;
  return tree_.winding_number(x);
}

/// Goes through the grid's lines along each axis that meet a face's box.
void InsideGrid::find_crossings(const TriangleMesh& soup) {
  for (Eigen::Index f = 0; f < soup.face_count(); ++f) {
    Eigen::Matrix3d corners;  // in spacings from the first node
    for (int c = 0; c < 3; ++c) {
      corners.col(c) = (soup.corner(f, c) - grid_.origin) / grid_.spacing;
    }
    const Vector3 lower = corners.rowwise().minCoeff().array().ceil();
    const Vector3 upper = corners.rowwise().maxCoeff().array().floor();
    for (int axis = 0; axis < 3; ++axis) {
      const int u = (axis + 1) % 3;
      const int v = (axis + 2) % 3;
      const auto cross = [&](int a, int b, double x, double y) {
        return (corners(u, a) - x) * (corners(v, b) - y) - (corners(v, a) - y) * (corners(u, b) - x);
      };
      for (auto i = static_cast<Eigen::Index>(lower(u)); i <= static_cast<Eigen::Index>(upper(u)); ++i) {
        for (auto j = static_cast<Eigen::Index>(lower(v)); j <= static_cast<Eigen::Index>(upper(v)); ++j) {
          const auto x = static_cast<double>(i);
          const auto y = static_cast<double>(j);
          const Vector3 weights(cross(1, 2, x, y), cross(2, 0, x, y), cross(0, 1, x, y));
          const double sum = weights.sum();
          if (sum == 0 || (weights.array() * sum < 0).any()) {
            continue;
          }
          const double along = corners.row(axis).dot(weights) / sum;
          const double below = std::floor(along);
          Eigen::Array3i node;
          node(axis) = static_cast<int>(below);
          node(u) = static_cast<int>(i);
          node(v) = static_cast<int>(j);
          crossings_.push_back({edge(grid_.index(node(0), node(1), node(2)), axis), static_cast<float>(along - below)});
        }
      }
    }
  }
  std::sort(crossings_.begin(), crossings_.end());
}

/// Computes w at those of the nodes where it is not known yet, and returns them.
std::vector<std::size_t> InsideGrid::sample(std::vector<std::size_t> nodes) {
  std::sort(nodes.begin(), nodes.end());
  nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
  std::erase_if(nodes, [&](std::size_t node) { return is_sampled(sides_[node]); });
#pragma omp parallel for schedule(dynamic, 256)
  for (const std::size_t node : nodes) {
    const double w = tree_.winding_number(point(node));
    const signed char known = std::abs(w - kInsideAbove) < kSoft ? kSampledSoft : kSampled;
    sides_[node] = w > kInsideAbove ? static_cast<signed char>(-known) : known;
  }
  return nodes;
}

/// The nodes of the cells about edges on which w passes 1/2 with no face to blame.
std::vector<std::size_t> InsideGrid::about_soft_edges(const std::vector<std::size_t>& fresh) const {
  std::vector<std::size_t> found;
  for (const std::size_t node : fresh) {
    const std::array<int, 3> at = place(node);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      for (const int step : {-1, 1}) {
        if (at[axis] + step < 0 || at[axis] + step >= grid_.count[axis]) {
          continue;
        }
        const std::size_t other = step > 0 ? node + stride_[axis] : node - stride_[axis];
        if (!is_sampled(sides_[other]) || inside(sides_[other]) == inside(sides_[node]) ||
            !(is_soft(sides_[node]) || is_soft(sides_[other]))) {
          continue;
        }
        const std::size_t u = (axis + 1) % 3;
        const std::size_t v = (axis + 2) % 3;
        for (const int du : {-1, 0, 1}) {
          for (const int dv : {-1, 0, 1}) {
            if (at[u] + du < 0 || at[u] + du >= grid_.count[u] || at[v] + dv < 0 || at[v] + dv >= grid_.count[v]) {
              continue;
            }
            for (const std::size_t end : {node, other}) {
              found.push_back(static_cast<std::size_t>(static_cast<std::ptrdiff_t>(end) +
                                                       du * static_cast<std::ptrdiff_t>(stride_[u]) +
                                                       dv * static_cast<std::ptrdiff_t>(stride_[v])));
            }
          }
        }
      }
    }
  }
  return found;
}

/// Nodes next to one on the other side where w of one of the two was not computed.
std::vector<std::size_t> InsideGrid::about_open_edges() const {
  std::vector<std::size_t> found;
  for_each_inner_node([&](std::size_t node) {
    for (const std::size_t stride : stride_) {
      const std::size_t other = node + stride;
      if (inside(sides_[node]) != inside(sides_[other]) && !(is_sampled(sides_[node]) && is_sampled(sides_[other]))) {
        found.push_back(node);
        found.push_back(other);
      }
    }
  });
  return found;
}

/// A node where w was not computed is on the side of the one before it.
void InsideGrid::fill_rows() {
  const auto rows = static_cast<std::ptrdiff_t>(sides_.size() / stride_[1]);
#pragma omp parallel for schedule(static)
  for (std::ptrdiff_t row = 0; row < rows; ++row) {
    signed char side = kFilledIn;
    signed char* const first = sides_.data() + static_cast<std::size_t>(row) * stride_[1];
    for (signed char* node = first; node != first + stride_[1]; ++node) {
      if (is_sampled(*node)) {
        side = inside(*node) ? -kFilledIn : kFilledIn;
      } else {
        *node = side;
      }
    }
  }
}

/// The nodes off the grid's border, where w was not computed and no face reaches.
template <class Visit>
void InsideGrid::for_each_inner_node(const Visit& visit) const {
  for (int k = 1; k < grid_.count[2] - 1; ++k) {
    for (int j = 1; j < grid_.count[1] - 1; ++j) {
      const std::size_t row = static_cast<std::size_t>(j) * stride_[1] + static_cast<std::size_t>(k) * stride_[2];
      for (std::size_t node = row + 1; node < row + stride_[1] - 1; ++node) {
        visit(node);
      }
    }
  }
}

/// Changes the nodes on one side that have neighbours on the other on both sides along an axis. Returns how many.
std::size_t InsideGrid::turn_thin(bool are_inside) {
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
  return thin.size();
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
          ++filled_;
          found = true;
        }
      }
    });
  }
}

/// Where between two nodes on different sides w passes 1/2, 0..1.
double InsideGrid::crossing(std::size_t node, int axis) const {
  const std::size_t other = node + stride_[static_cast<std::size_t>(axis)];
  // Of a node that was dropped or filled as little as possible is lost or gained.
  constexpr double kLittle = 0.1;
  if (const bool begin = is_changed(sides_[node]), end = is_changed(sides_[other]); begin || end) {
    return begin == end ? 0.5 : (begin ? kLittle : 1.0 - kLittle);
  }
  const auto [first, last] = std::equal_range(crossings_.begin(), crossings_.end(), Crossing{edge(node, axis), 0},
                                              [](const Crossing& a, const Crossing& b) { return a.edge < b.edge; });
  double low = 0;
  double high = 1;
  if (last - first == 1 && !is_soft(sides_[node]) && !is_soft(sides_[other])) {
    return first->at;
  }
  // Between its faces w is smooth: among them, then by halves.
  constexpr double kNear = 1e-4;
  constexpr double kClose = 1e-3;
  const bool begins_inside = inside(sides_[node]);
  for (auto face = first; face != last; ++face) {
    const double before = face->at - kNear;
    const double behind = face->at + kNear;
    if (before > low && (winding_along(node, axis, before) > kInsideAbove) != begins_inside) {
      high = before;
      break;
    }
    if (behind < high && (winding_along(node, axis, behind) > kInsideAbove) != begins_inside) {
      return face->at;
    }
    low = std::max(low, behind);
  }
  while (high - low > kClose) {
    const double middle = 0.5 * (low + high);
    ((winding_along(node, axis, middle) > kInsideAbove) == begins_inside ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

Isosurface InsideGrid::surface() const {
  // In spacings from the first node, so that a vertex says which edge it is on.
  Isosurface result = isosurface({Vector3::Zero(), 1.0, grid_.count}, sides_);
  constexpr double kLeast = 1e-3;  // off the nodes, where several vertices would be one
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
    const std::size_t node = grid_.index(place(0), place(1), place(2));
    start(axis) += std::clamp(crossing(node, axis), kLeast, 1.0 - kLeast);
    result.points.col(i) = grid_.origin + grid_.spacing * start;
  }
  return result;
}

}  // namespace touchfield
