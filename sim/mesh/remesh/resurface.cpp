#include "sim/mesh/remesh/resurface.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/require.h"
#include "sim/core/text.h"
#include "sim/core/units.h"
#include "sim/mesh/query/inspect.h"
#include "sim/mesh/query/self_intersections.h"
#include "sim/mesh/query/skin_patches.h"
#include "sim/mesh/remesh/closed_mesh.h"
#include "sim/mesh/remesh/edit_mesh.h"
#include "sim/mesh/remesh/remesh.h"
#include "sim/mesh/remesh/surface_remesh.h"
#include "sim/mesh/topology.h"

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

using Index = Eigen::Index;

constexpr double kGrid = 0.5;  // spacing over edge

/// What messages name.
struct Asked {
  std::string name;
  std::string field;
  double edge;

  std::string value() const { return fmt::format("{}: {} = {:.4g} mm", name, field, edge / kMillimetre); }
};

std::string volume_text(double volume) { return fmt::format("{:.4g} cm3", 1e6 * volume); }

/// The outer pieces of the boundary of what the soup winds round that are large enough to be meshed.
TriangleMesh outer_surface(const TriangleMesh& soup, const Asked& asked, std::vector<std::string>& steps) {
  Isosurface surface = InsideGrid(soup, kGrid * asked.edge).surface();
  const Pieces pieces = find_pieces(surface.points, surface.triangles, sorted_sides(surface.triangles));
  const std::vector<bool> inner = nested(surface.points, surface.triangles, pieces);
  std::vector<bool> keep;
  double kept = 0;
  double filled = 0;
  double dropped = 0;
  for (std::size_t p = 0; p < inner.size(); ++p) {
    const double volume = pieces.list[p].volume;
    keep.push_back(!inner[p] && volume >= std::pow(asked.edge, 3));
    (inner[p] ? filled : keep[p] ? kept : dropped) += std::abs(volume);
  }
  require(kept != 0,
          "{} is too long, or the surface has no volume: no part larger and thicker than it encloses its points more "
          "than half",
          asked.value());
  if (filled > 0) {
    steps.push_back(fmt::format("filled cavities of {} in all", volume_text(filled)));
  }
  if (dropped > 0) {
    steps.push_back(fmt::format("dropped pieces smaller than a cube of the edge, {} in all", volume_text(dropped)));
  }
  surface.triangles = faces_where(surface.triangles, [&](Index f) { return keep[at(pieces.of_face[at(f)])]; });
  drop_unused_points(surface.points, surface.triangles);
  return {std::move(surface.points), std::move(surface.triangles)};
}

TriangleMesh meshed(const TriangleMesh& surface, const Asked& asked) {
  try {
    TriangleMesh mesh = remeshed_surface(surface, EdgeSizing(asked.edge), std::numbers::pi);
    const auto crossings = self_intersections(mesh);
    if (!crossings.empty()) {
      throw NumericalError(fmt::format("{}: the resulting skin intersects itself: {}; try another length",
                                       asked.value(), self_intersections_text(mesh, crossings, crossings.size() + 1)));
    }
    return mesh;
  } catch (const RemeshError& error) {
    throw InputError(fmt::format("{}: {}", asked.value(), error.what()));
  }
}

/// From the points of a surface that count to the nearest of another.
template <class Counts>
SurfaceDistance surface_distance(const TriangleMesh& from, const FaceTree& to, double spacing, const Counts& counts) {
  constexpr double kMostPoints = 1e6;
  const SkinPatches pieces = pieces_of(from, std::max(spacing, std::sqrt(4.0 * from.total_area() / kMostPoints)), 0);
  const Points points = pieces.centres();
  const Points normals = pieces.normals();
  std::vector<std::pair<double, Index>> order(at(pieces.size()), {-1.0, 0});
#pragma omp parallel for schedule(dynamic, 256)
  for (Index i = 0; i < pieces.size(); ++i) {
    if (counts(points.col(i), normals.col(i))) {
      order[at(i)] = {to.nearest(points.col(i)).distance, i};
    }
  }
  std::erase_if(order, [](const auto& point) { return point.first < 0; });
  std::ranges::sort(order);
  SurfaceDistance result;
  double area = 0;
  for (const auto& [distance, i] : order) {
    area += pieces.areas(i);
    result.farthest = distance;
    result.at = points.col(i);
  }
  constexpr double kMost = 0.95;
  double below = 0;
  for (auto point = order.begin(); point != order.end() && below < kMost * area; ++point) {
    below += pieces.areas(point->second);
    result.most_of_it = point->first;
  }
  result.counted = area / from.total_area();
  return result;
}

std::string distance_text(const SurfaceDistance& distance) {
  return fmt::format("95 % within {:.2g} mm, all within {:.2g} mm (farthest at {})", distance.most_of_it / kMillimetre,
                     distance.farthest / kMillimetre, place_text(distance.at, 2));
}

/// Measures the skin against its original.
void compare(Resurfaced& result, const Asked& asked) {
  constexpr double kOff = 1e-3;     // of an edge: beside a face
  constexpr double kOutside = 0.3;  // winding numbers before an outer face, at most
  constexpr double kInside = 0.7;   // and behind it, at least
  const FaceTree skin(result.mesh);
  const FaceTree original(result.original);
  result.to_skin = surface_distance(result.original, skin, asked.edge, [&](const Vector3& x, const Vector3& normal) {
    const Vector3 off = kOff * asked.edge * normal;
    return original.winding_number(x + off) < kOutside && original.winding_number(x - off) > kInside;
  });
  result.from_skin =
      surface_distance(result.mesh, original, asked.edge, [](const Vector3&, const Vector3&) { return true; });
  if (result.to_skin.most_of_it > asked.edge) {
    throw InputError(
        fmt::format("{} is too long: parts thinner or gaps "
                    "narrower than it are lost; of the surface's "
                    "outer faces 95 % must be within an edge of "
                    "the skin and are within {:.3g} mm, the "
                    "farthest at {}",
                    asked.value(), result.to_skin.most_of_it / kMillimetre, place_text(result.to_skin.at, 2)));
  }
  result.steps.push_back(fmt::format("from the outer faces ({:.1f} % of the surface) to the skin: {}",
                                     100.0 * result.to_skin.counted, distance_text(result.to_skin)));
  result.steps.push_back(fmt::format("from the skin to the surface: {}", distance_text(result.from_skin)));
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

void require_resurfaceable(const FileSurface& surface, double unit, double edge, const std::string& name,
                           const std::string& field) {
  const Asked asked{name, field, edge};
  constexpr double kMostNodes = 3e8;
  constexpr double kMostFaces = 5e6;
  require(asked.edge > 0 && std::isfinite(asked.edge), "{} must be > 0 and finite", asked.value());
  Eigen::AlignedBox3d box;
  double area = 0;
  for (const auto& face : surface.triangles) {
    const auto corner = [&](std::size_t c) {
      return Vector3(unit * surface.points[static_cast<std::size_t>(face[c])]);
    };
    for (std::size_t c = 0; c < 3; ++c) {
      box.extend(corner(c));
    }
    area += 0.5 * (corner(1) - corner(0)).cross(corner(2) - corner(0)).norm();
  }
  if (box.isEmpty()) {
    return;
  }
  const Vector3 size = box.sizes();
  const double nodes = node_count(size, kGrid * asked.edge);
  const double faces = area / (std::sqrt(3.0) / 4.0 * asked.edge * asked.edge);
  if (nodes > kMostNodes || faces > kMostFaces) {
    const double least = 1.05 * asked.edge * std::max(std::cbrt(nodes / kMostNodes), std::sqrt(faces / kMostFaces));
    throw InputError(
        fmt::format("{} is too short for a surface of {:.4g} x {:.4g} x {:.4g} "
                    "mm and {:.4g} cm2: it would take {:.3g} nodes of a "
                    "grid, {:.0g} are allowed, and {:.3g} faces, {:.0g} are "
                    "allowed; it must be at least {:.2g} mm",
                    asked.value(), size.x() / kMillimetre, size.y() / kMillimetre, size.z() / kMillimetre, 1e4 * area,
                    nodes, kMostNodes, faces, kMostFaces, least / kMillimetre));
  }
}

Resurfaced resurfaced(const FileSurface& surface, double unit, double edge, const std::string& name,
                      const std::string& field) {
  const Asked asked{name, field, edge};
  require_resurfaceable(surface, unit, edge, name, field);
  OrientedSoup soup = oriented_soup(surface, unit, name);
  std::vector<std::string> steps = std::move(soup.steps);
  TriangleMesh mesh = meshed(outer_surface(soup.mesh, asked, steps), asked);
  const bool closed = inspect(soup.mesh.vertices(), soup.mesh.triangles()).closed();
  steps.push_back(fmt::format(
      "resurfaced with edges of {:.4g} mm: {}; area {:.1f} to {:.1f} cm2, volume {} to {}", edge / kMillimetre,
      counted(mesh.face_count(), "face", "faces"), 1e4 * soup.mesh.total_area(), 1e4 * mesh.total_area(),
      closed ? volume_text(soup.mesh.signed_volume()) : "(open)", volume_text(mesh.signed_volume())));
  Resurfaced result{std::move(mesh), std::move(soup.mesh), {}, {}, std::move(steps)};
  compare(result, asked);
  return result;
}

}  // namespace touchfield
