#include "sim/mesh/repair/resurface.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "sim/core/counted.h"
#include "sim/core/errors.h"
#include "sim/core/place_text.h"
#include "sim/core/units.h"
#include "sim/mesh/query/face_tree.h"
#include "sim/mesh/query/inspect.h"
#include "sim/mesh/query/pieces.h"
#include "sim/mesh/query/self_intersections.h"
#include "sim/mesh/remesh/surface_remesh.h"
#include "sim/mesh/repair/inside_grid.h"
#include "sim/mesh/repair/oriented_soup.h"
#include "sim/mesh/subset.h"

namespace touchfield {

namespace {

using Index = Eigen::Index;

std::string area_text(double area) { return fmt::format("{:.3g} mm2", area / (kMillimetre * kMillimetre)); }

constexpr double kGrid = 0.5;     // spacing over edge
constexpr double kOutside = 0.3;  // winding numbers before an outer face, at most
constexpr double kInside = 0.7;   // and behind it, at least
constexpr double kStray = 0.01;   // pieces below this share of the largest one's area may be lost

/// What messages name.
struct Asked {
  std::string name;
  std::string field;
  double edge;

  std::string value() const { return fmt::format("{}: {} = {:.4g} mm", name, field, edge / kMillimetre); }
};

std::string volume_text(double volume) { return fmt::format("{:.4g} cm3", 1e6 * volume); }

/// The outer pieces of a surface that are large enough to be meshed.
TriangleMesh outer_pieces(const Isosurface& surface, const Asked& asked, std::vector<std::string>& steps) {
  const Pieces pieces = find_pieces(surface.points, surface.triangles, sorted_sides(surface.triangles));
  const std::vector<bool> inner = nested(surface.points, surface.triangles, pieces);
  const double least = std::pow(asked.edge, 3);
  std::vector<bool> keep(pieces.list.size());
  Index filled = 0;
  double filled_volume = 0;
  Index small = 0;
  double largest_small = 0;
  for (std::size_t p = 0; p < keep.size(); ++p) {
    const double volume = pieces.list[p].volume;
    if (volume < 0) {
      ++filled;
      filled_volume -= volume;
    } else if (!inner[p] && volume < least) {
      ++small;
      largest_small = std::max(largest_small, volume);
    }
    keep[p] = volume >= least && !inner[p];
  }
  if (filled > 0) {
    steps.push_back(fmt::format("filled {} of {}", counted(filled, "cavity", "cavities"), volume_text(filled_volume)));
  }
  if (std::ranges::none_of(keep, [](bool kept) { return kept; })) {
    throw InputError(fmt::format(
        "{} is too long: nothing of the surface is left; {} smaller than a cube of it, the "
        "largest of {}",
        asked.value(), small == 1 ? "1 piece is" : fmt::format("{} pieces are", small), volume_text(largest_small)));
  }
  if (small > 0) {
    steps.push_back(fmt::format("dropped {} smaller than a cube of the edge, the largest of {}",
                                counted(small, "piece", "pieces"), volume_text(largest_small)));
  }
  Points points = surface.points;
  Triangles kept = faces_where(surface.triangles, [&](Index f) { return keep[at(pieces.of_face[at(f)])]; });
  drop_unused_points(points, kept);
  return {std::move(points), std::move(kept)};
}

/// Whether some face has the outside before it and the inside behind it.
bool bounds_a_volume(const TriangleMesh& soup) {
  constexpr double kOff = 1e-3;  // of the face's size
  const FaceTree tree(soup);
  for (Index f = 0; f < soup.face_count(); ++f) {
    const Vector3 off = kOff * std::sqrt(soup.areas()(f)) * soup.normals().col(f);
    if (tree.winding_number(soup.centroids().col(f) + off) < kOutside &&
        tree.winding_number(soup.centroids().col(f) - off) > kInside) {
      return true;
    }
  }
  return false;
}

/// The boundary of what the soup winds round.
TriangleMesh inside_surface(const TriangleMesh& soup, const Asked& asked, std::vector<std::string>& steps) {
  const InsideGrid grid(soup, kGrid * asked.edge);
  const Isosurface surface = grid.surface();
  if (surface.triangles.cols() == 0) {
    const bool thin = grid.dropped() > 0 || bounds_a_volume(soup);
    throw InputError(
        thin ? fmt::format("{} is too long: all of the surface is thinner than it, nothing is left", asked.value())
             : fmt::format("{}: the surface has no volume: it does not enclose any point more than half, like a flat "
                           "sheet or a shallow bowl",
                           asked.value()));
  }
  return outer_pieces(surface, asked, steps);
}

/// The surface with faces of the edge asked for, or of one a little shorter where these would cut each other.
TriangleMesh meshed(const TriangleMesh& surface, const Asked& asked) {
  std::vector<std::pair<Index, Index>> crossings;
  std::string first;
  for (const double share : {1.0, 0.96, 0.92, 0.88}) {
    const TriangleMesh mesh = [&] {
      try {
        return remeshed_surface(surface, EdgeSizing(share * asked.edge), std::numbers::pi);
      } catch (const NumericalError& error) {
        throw InputError(fmt::format("{} is too long for parts of the body: {}", asked.value(), error.what()));
      }
    }();
    crossings = self_intersections(mesh);
    if (crossings.empty()) {
      return mesh;
    }
    first = place_text(mesh.centroids().col(crossings[0].first), 2);
  }
  throw NumericalError(
      fmt::format("{}: the resulting skin intersects itself: {} of faces, the first near {}; try another length",
                  asked.value(), counted(std::ssize(crossings), "pair", "pairs"), first));
}

/// Closed pieces of the soup that left nothing of themselves in the skin.
void require_pieces(const TriangleMesh& soup, const FaceTree& skin, const Asked& asked,
                    std::vector<std::string>& steps) {
  constexpr Index kMostAsked = 64;
  constexpr double kNear = 1.0 / 3.0;  // of an edge
  const std::vector<Side> sides = sorted_sides(soup.triangles());
  const Pieces pieces = find_pieces(soup.vertices(), soup.triangles(), sides);
  std::vector<bool> open(pieces.list.size());
  const auto piece_of = [&](Index f) { return at(pieces.of_face[at(f)]); };
  for_each_edge(sides, [&](std::span<const Side> edge) {
    if (edge.size() == 1) {
      open[piece_of(edge[0].face)] = true;
    }
  });
  std::vector<Index> asked_of(pieces.list.size());
  std::vector<bool> found(pieces.list.size());
  for (Index f = 0; f < soup.face_count(); ++f) {
    const std::size_t p = piece_of(f);
    if (!found[p] && asked_of[p]++ < kMostAsked) {
      const Vector3 x = soup.centroids().col(f);
      found[p] = skin.winding_number(x) > kInsideAbove || skin.nearest(x).distance < kNear * asked.edge;
    }
  }
  double largest = 0;
  for (const Piece& piece : pieces.list) {
    largest = std::max(largest, piece.area);
  }
  Index lost = 0;
  Index lost_bodies = 0;
  double lost_area = 0;
  double largest_body = 0;
  for (std::size_t p = 0; p < found.size(); ++p) {
    if (found[p]) {
      continue;
    }
    const Piece& piece = pieces.list[p];
    ++lost;
    lost_area += piece.area;
    if (!open[p] && !piece.flat() && piece.area >= kStray * largest) {
      ++lost_bodies;
      largest_body = std::max(largest_body, piece.area);
    }
  }
  if (lost_bodies > 0) {
    throw InputError(fmt::format("{} is too long: {} of the surface {} lost, the largest with {}", asked.value(),
                                 counted(lost_bodies, "piece", "pieces"), lost_bodies == 1 ? "is" : "are",
                                 area_text(largest_body)));
  }
  if (lost > 0) {
    steps.push_back(fmt::format("dropped {} without a volume, or small ({})", counted(lost, "piece", "pieces"),
                                area_text(lost_area)));
  }
}

std::string distance_text(const SurfaceDistance& distance) {
  return fmt::format("95 % within {:.2g} mm, all within {:.2g} mm (farthest at {})", distance.most_of_it / kMillimetre,
                     distance.farthest / kMillimetre, place_text(distance.at, 2));
}

/// Measures the skin against its original.
void compare(Resurfaced& result, const FaceTree& skin, const Asked& asked) {
  constexpr double kOff = 1e-3;     // of an edge: beside a face
  constexpr double kSpacing = 1.0;  // of an edge, between the points asked
  const FaceTree original(result.original);
  result.to_skin =
      surface_distance(result.original, skin, kSpacing * asked.edge, [&](const Vector3& x, const Vector3& normal) {
        const Vector3 off = kOff * asked.edge * normal;
        return original.winding_number(x + off) < kOutside && original.winding_number(x - off) > kInside;
      });
  result.from_skin = surface_distance(result.mesh, original, kSpacing * asked.edge,
                                      [](const Vector3&, const Vector3&) { return true; });
  if (result.to_skin.most_of_it > asked.edge) {
    throw InputError(
        fmt::format("{} is too long: parts thinner or gaps narrower than it are lost; of the surface's "
                    "outer faces 95 % must be within an edge of the skin and are within {:.3g} mm, the "
                    "farthest at {}",
                    asked.value(), result.to_skin.most_of_it / kMillimetre, place_text(result.to_skin.at, 2)));
  }
  result.steps.push_back(fmt::format("from the outer faces ({:.1f} % of the surface) to the skin: {}",
                                     100.0 * result.to_skin.counted, distance_text(result.to_skin)));
  result.steps.push_back(fmt::format("from the skin to the surface: {}", distance_text(result.from_skin)));
}

}  // namespace

void require_resurfaceable(const FileSurface& surface, double unit, double edge, const std::string& name,
                           const std::string& field) {
  const Asked asked{name, field, edge};
  constexpr double kMostNodes = 3e8;
  constexpr double kMostFaces = 5e6;
  if (!(asked.edge > 0 && std::isfinite(asked.edge))) {
    throw InputError(fmt::format("{} must be > 0 and finite", asked.value()));
  }
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
  const auto too_fine = [&](const std::string& what, double least) {
    return InputError(
        fmt::format("{} is too short for a surface of {:.4g} x {:.4g} x {:.4g} mm and {:.4g} cm2: {}; it "
                    "must be at least {:.2g} mm",
                    asked.value(), size.x() / kMillimetre, size.y() / kMillimetre, size.z() / kMillimetre, 1e4 * area,
                    what, least / kMillimetre));
  };
  if (const double nodes = node_count(size, kGrid * asked.edge); nodes > kMostNodes) {
    double least = asked.edge;
    while (node_count(size, kGrid * least) > kMostNodes) {
      least *= 1.05;
    }
    throw too_fine(fmt::format("its grid would have {:.3g} nodes, {:.0g} are allowed", nodes, kMostNodes), least);
  }
  const double face_area = std::sqrt(3.0) / 4.0 * asked.edge * asked.edge;
  if (const double faces = area / face_area; faces > kMostFaces) {
    throw too_fine(fmt::format("it would take {:.3g} faces, {:.0g} are allowed", faces, kMostFaces),
                   asked.edge * std::sqrt(1.05 * faces / kMostFaces));
  }
}

Resurfaced resurfaced(const FileSurface& surface, double unit, double edge, const std::string& name,
                      const std::string& field) {
  const Asked asked{name, field, edge};
  require_resurfaceable(surface, unit, edge, name, field);
  OrientedSoup soup = oriented_soup(surface, unit, name);
  std::vector<std::string> steps = std::move(soup.steps);
  TriangleMesh mesh = meshed(inside_surface(soup.mesh, asked, steps), asked);
  const FaceTree skin(mesh);
  require_pieces(soup.mesh, skin, asked, steps);
  const bool closed = inspect(soup.mesh.vertices(), soup.mesh.triangles()).closed();
  const std::optional<double> volume = closed ? std::optional(soup.mesh.signed_volume()) : std::nullopt;
  steps.push_back(fmt::format("resurfaced with edges of {:.4g} mm: {}; area {:.1f} to {:.1f} cm2, volume {} to {}",
                              edge / kMillimetre, counted(mesh.face_count(), "face", "faces"),
                              1e4 * soup.mesh.total_area(), 1e4 * mesh.total_area(),
                              volume ? volume_text(*volume) : "(open)", volume_text(mesh.signed_volume())));
  Resurfaced result{std::move(mesh), std::move(soup.mesh), {}, {}, volume, std::move(steps)};
  compare(result, skin, asked);
  return result;
}

}  // namespace touchfield
