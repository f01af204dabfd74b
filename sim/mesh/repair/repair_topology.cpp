#include <algorithm>
#include <limits>
#include <map>
#include <vector>

#include <fmt/format.h>

#include "sim/core/counted.h"
#include "sim/core/place_text.h"
#include "sim/core/units.h"
#include "sim/mesh/query/inspect.h"
#include "sim/mesh/query/pieces.h"
#include "sim/mesh/repair/repair_steps.h"
#include "sim/mesh/subset.h"
#include "sim/mesh/topology.h"

namespace touchfield {

namespace {

using Index = Eigen::Index;

double largest_area(const Pieces& pieces) {
  double largest = 0;
  for (const Piece& piece : pieces.list) {
    largest = std::max(largest, piece.area);
  }
  return largest;
}

/// One round; true if it dropped something, which may make another patch hang free.
bool drop_flaps_once(RawSurface& surface, std::vector<bool>& copied, double share, StepLog& log) {
  const std::vector<Side> sides = sorted_sides(surface.triangles);
  const Pieces patches = find_pieces(surface.points, surface.triangles, sides, 2);
  const std::size_t count = patches.list.size();
  std::vector<bool> open(count);   // has an edge of one face
  std::vector<bool> hangs(count);  // has an edge of three faces or more
  std::vector<bool> genuine(count);
  const auto patch_of = [&](Index face) { return at(patches.of_face[at(face)]); };
  for_each_edge(sides, [&](std::span<const Side> edge) {
    for (const Side& side : edge) {
      open[patch_of(side.face)] = open[patch_of(side.face)] || edge.size() == 1;
      hangs[patch_of(side.face)] = hangs[patch_of(side.face)] || edge.size() > 2;
    }
  });
  for (Index f = 0; f < surface.triangles.cols(); ++f) {
    genuine[patch_of(f)] = genuine[patch_of(f)] || !copied[at(f)];
  }
  const double least = share * largest_area(patches);
  std::vector<bool> flap(count);
  for (std::size_t p = 0; p < count; ++p) {
    flap[p] = hangs[p] && (open[p] ? patches.list[p].area < least : !genuine[p]);
  }
  const Dropped dropped = drop_pieces(surface, patches, flap);
  if (dropped.pieces == 0) {
    return false;
  }
  log.push_back(fmt::format("dropped flaps of {} ({}) that hung on edges of three faces or more, the first at {}",
                            dropped.faces, dropped.area, dropped.place));
  std::vector<bool> left;
  for (std::size_t f = 0; f < copied.size(); ++f) {
    if (!flap[at(patches.of_face[f])]) {
      left.push_back(copied[f]);
    }
  }
  copied = std::move(left);
  return true;
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

void drop_flaps(RawSurface& surface, std::vector<bool>& copied, double share, StepLog& log) {
  while (drop_flaps_once(surface, copied, share, log)) {
  }
}

Dropped drop_pieces(RawSurface& surface, const Pieces& pieces, const std::vector<bool>& marked) {
  Dropped dropped{std::count(marked.begin(), marked.end(), true), {}, {}, {}};
  if (dropped.pieces == 0) {
    return dropped;
  }
  double area = 0;
  for (std::size_t p = 0; p < marked.size(); ++p) {
    area += marked[p] ? pieces.list[p].area : 0.0;
  }
  const Index first = pieces.list[at(std::find(marked.begin(), marked.end(), true) - marked.begin())].face;
  const Index before = surface.triangles.cols();
  dropped.area = area_text(area);
  dropped.place = place_text(surface.points(Eigen::all, surface.triangles.col(first)).rowwise().mean(), 2);
  surface.triangles = faces_where(surface.triangles, [&](Index f) { return !marked[at(pieces.of_face[at(f)])]; });
  dropped.faces = counted(before - surface.triangles.cols(), "face", "faces");
  return dropped;
}

void drop_stray_pieces(RawSurface& surface, double share, StepLog& log) {
  const Pieces pieces = find_pieces(surface.points, surface.triangles, sorted_sides(surface.triangles));
  const double least = share * largest_area(pieces);
  std::vector<bool> stray;
  for (const Piece& piece : pieces.list) {
    stray.push_back(piece.area < least);
  }
  if (const Dropped dropped = drop_pieces(surface, pieces, stray); dropped.pieces > 0) {
    log.push_back(fmt::format("dropped {} ({}, {}), the first at {}",
                              counted(dropped.pieces, "stray piece", "stray pieces"), dropped.faces, dropped.area,
                              dropped.place));
  }
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

void split_pinched_vertices(RawSurface& surface, StepLog& log) {
  DisjointSets corners = fans(surface.triangles, sorted_sides(surface.triangles));
  std::vector<Index> fan_of(at(surface.points.cols()), -1);
  std::vector<bool> pinched(fan_of.size(), false);
  for (Index corner = 0; corner < surface.triangles.size(); ++corner) {
    const auto vertex = at(surface.triangles(corner % 3, corner / 3));
    const Index fan = corners.root(corner);
    pinched[vertex] = pinched[vertex] || (fan_of[vertex] >= 0 && fan_of[vertex] != fan);
    fan_of[vertex] = fan;
  }
  const auto points_pinched = std::count(pinched.begin(), pinched.end(), true);
  if (points_pinched == 0) {
    return;
  }

  // The first fan keeps the vertex's number; all move.
  struct Fan {
    int vertex;
    Vector3 to_rim = Vector3::Zero();  // sum over its sides
    double sides = 0;
    double shortest = std::numeric_limits<double>::infinity();
  };
  std::map<Index, Fan> moving;
  std::vector<bool> number_taken(fan_of.size(), false);
  std::vector<Vector3> added;
  const Triangles before = surface.triangles;
  Vector3 first = Vector3::Zero();
  for (Index corner = 0; corner < before.size(); ++corner) {
    const int vertex = before(corner % 3, corner / 3);
    if (!pinched[at(vertex)]) {
      continue;
    }
    const Vector3 x = surface.points.col(vertex);
    const auto [entry, is_new] = moving.try_emplace(corners.root(corner), Fan{vertex});
    Fan& fan = entry->second;
    if (is_new && number_taken[at(vertex)]) {
      fan.vertex = static_cast<int>(surface.points.cols()) + static_cast<int>(added.size());
      added.push_back(x);
    }
    first = moving.size() == 1 ? x : first;
    number_taken[at(vertex)] = true;
    surface.triangles(corner % 3, corner / 3) = fan.vertex;
    for (const Index step : {1, 2}) {
      const Vector3 along = surface.points.col(before((corner + step) % 3, corner / 3)) - x;
      fan.to_rim += along;
      fan.sides += 1;
      fan.shortest = std::min(fan.shortest, along.norm());
    }
  }
  surface.points.conservativeResize(3, surface.points.cols() + static_cast<Index>(added.size()));
  surface.points.rightCols(static_cast<Index>(added.size())) = as_columns(added);
  constexpr double kApart = 0.01;  // of the shortest edge: far above the digits that any file keeps
  for (const auto& [root, fan] : moving) {
    const Vector3 to_rim = fan.to_rim / fan.sides;
    const double reach = to_rim.norm();
    if (reach > 0) {
      surface.points.col(fan.vertex) += to_rim * std::min(1.0, fan.shortest / reach) * kApart;
    }
  }
  log.push_back(fmt::format("split {} in which parts touched, the first at {}",
                            counted(points_pinched, "point", "points"), place_text(first, 2)));
}

}  // namespace touchfield
