#include "sim/mesh/repair/repair_steps.h"

#include <algorithm>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "sim/core/counted.h"
#include "sim/core/place_text.h"
#include "sim/core/units.h"
#include "sim/mesh/face_shape.h"
#include "sim/mesh/query/pieces.h"
#include "sim/mesh/remesh/edit_mesh.h"
#include "sim/mesh/remesh/flat_faces.h"
#include "sim/mesh/subset.h"
#include "sim/mesh/topology.h"

namespace touchfield {

namespace {

using Index = Eigen::Index;

// Faces this thin do not survive the digits of a single-precision file: on a 10 mm edge 20 nm high.
constexpr double kSliver = 1e-6;  // area over longest edge squared

/// Drops the pieces that are marked, called "stray piece" or "piece", and says so; `why` follows the number.
void drop_pieces(RawSurface& surface, const Pieces& pieces, const std::vector<bool>& marked, const std::string& called,
                 const std::string& why, StepLog& log) {
  const auto first = std::find(marked.begin(), marked.end(), true);
  if (first == marked.end()) {
    return;
  }
  double area = 0;
  Index faces = 0;
  for (std::size_t p = 0; p < marked.size(); ++p) {
    area += marked[p] ? pieces.list[p].area : 0.0;
    faces += marked[p] ? pieces.list[p].faces : 0;
  }
  const Index face = pieces.list[at(first - marked.begin())].face;
  log.push_back(fmt::format("dropped {}{} ({}, {}), the first at {}",
                            counted(std::count(marked.begin(), marked.end(), true), called, called + "s"), why,
                            counted(faces, "face", "faces"), area_text(area),
                            place_text(surface.points(Eigen::all, surface.triangles.col(face)).rowwise().mean(), 2)));
  surface.triangles = faces_where(surface.triangles, [&](Index f) { return !marked[at(pieces.of_face[at(f)])]; });
}

/// The face across each side (3 face + corner) with an edge of two faces, and whether the two run the same way; -1
/// across other sides.
struct Neighbours {
  std::vector<Index> face;
  std::vector<bool> same_way;
};

Neighbours find_neighbours(const std::vector<Side>& sides) {
  Neighbours neighbours{std::vector<Index>(sides.size(), -1), std::vector<bool>(sides.size(), false)};
  for_each_edge(sides, [&](std::span<const Side> edge) {
    if (edge.size() == 2) {
      for (const auto& [side, other] : {std::pair(edge[0], edge[1]), std::pair(edge[1], edge[0])}) {
        neighbours.face[at(3 * side.face + side.corner)] = other.face;
        neighbours.same_way[at(3 * side.face + side.corner)] = edge[0].upwards == edge[1].upwards;
      }
    }
  });
  return neighbours;
}

}  // namespace

std::string area_text(double area) { return fmt::format("{:.3g} mm2", area / (kMillimetre * kMillimetre)); }

void drop_stray_pieces(RawSurface& surface, StepLog& log) {
  constexpr double kStray = 0.01;
  const Pieces pieces = find_pieces(surface.points, surface.triangles, sorted_sides(surface.triangles));
  const double largest = std::ranges::max(pieces.list, {}, &Piece::area).area;
  std::vector<bool> stray;
  for (const Piece& piece : pieces.list) {
    stray.push_back(piece.area < kStray * largest);
  }
  drop_pieces(surface, pieces, stray, "stray piece", "", log);
}

void make_consistent(RawSurface& surface, StepLog& log) {
  const Neighbours neighbours = find_neighbours(sorted_sides(surface.triangles));
  const auto count = at(surface.triangles.cols());
  std::vector<bool> reached(count, false);
  std::vector<bool> turned(count, false);
  std::vector<Index> piece;
  Index turned_count = 0;
  for (std::size_t start = 0; start < count; ++start) {
    if (reached[start]) {
      continue;
    }
    reached[start] = true;
    piece.assign(1, static_cast<Index>(start));
    Index against = 0;
    for (std::size_t next = 0; next < piece.size(); ++next) {
      const std::size_t face = at(piece[next]);
      against += turned[face] ? 1 : 0;
      for (std::size_t side = 3 * face; side < 3 * face + 3; ++side) {
        if (const Index other = neighbours.face[side]; other >= 0 && !reached[at(other)]) {
          reached[at(other)] = true;
          turned[at(other)] = turned[face] != neighbours.same_way[side];
          piece.push_back(other);
        }
      }
    }
    const auto faces = static_cast<Index>(piece.size());
    const bool other_way = 2 * against > faces;
    turned_count += other_way ? faces - against : against;
    for (const Index f : piece) {
      turned[at(f)] = turned[at(f)] != other_way;
    }
  }
  if (turned_count == 0) {
    return;
  }
  for (Index f = 0; f < surface.triangles.cols(); ++f) {
    if (turned[at(f)]) {
      std::swap(surface.triangles(1, f), surface.triangles(2, f));
    }
  }
  log.push_back(
      fmt::format("turned {} to run the same way round as most of its piece", counted(turned_count, "face", "faces")));
}

void remove_slivers(RawSurface& surface, StepLog& log) {
  const auto is_sliver = [&](const auto& face) { return is_flat(surface.points, face, kSliver); };
  const auto columns = surface.triangles.colwise();
  if (std::none_of(columns.begin(), columns.end(), is_sliver)) {
    return;
  }
  EditMesh mesh(surface.triangles, surface.points.cols());
  const FlatFaces done = remove_flat_faces(mesh, surface.points, kSliver);
  if (done.removed == 0) {
    return;
  }
  std::vector<int> old_numbers;
  surface.triangles = mesh.compact(old_numbers);
  surface.points = surface.points(Eigen::all, old_numbers).eval();
  log.push_back(fmt::format("removed {} with next to no area, the first at {}", counted(done.removed, "face", "faces"),
                            place_text(done.first, 2)));
}

void turn_outwards(RawSurface& surface, StepLog& log) {
  Pieces pieces = find_pieces(surface.points, surface.triangles, sorted_sides(surface.triangles));
  const auto turned =
      std::count_if(pieces.list.begin(), pieces.list.end(), [](const Piece& p) { return p.volume < 0; });
  if (turned > 0) {
    for (Index f = 0; f < surface.triangles.cols(); ++f) {
      if (pieces.list[at(pieces.of_face[at(f)])].volume < 0) {
        std::swap(surface.triangles(1, f), surface.triangles(2, f));
      }
    }
    for (Piece& piece : pieces.list) {
      piece.volume = std::abs(piece.volume);
    }
    log.push_back(fmt::format("turned {} outwards", counted(turned, "piece", "pieces")));
  }

  drop_pieces(surface, pieces, nested(surface.points, surface.triangles, pieces), "piece",
              " inside another, where no sound comes", log);
}

}  // namespace touchfield
