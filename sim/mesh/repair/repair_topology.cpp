#include <algorithm>
#include <limits>
#include <map>
#include <vector>

#include <fmt/format.h>

#include "sim/core/place_text.h"
#include "sim/core/units.h"
#include "sim/mesh/face_shape.h"
#include "sim/mesh/query/inspect.h"
#include "sim/mesh/query/pieces.h"
#include "sim/mesh/repair/repair_steps.h"
#include "sim/mesh/topology.h"

namespace touchfield {

namespace {

using Index = Eigen::Index;

Triangles picked(const Triangles& triangles, const std::vector<bool>& keep) {
  Triangles kept(3, triangles.cols());
  Index count = 0;
  for (Index f = 0; f < triangles.cols(); ++f) {
    if (keep[at(f)]) {
      kept.col(count++) = triangles.col(f);
    }
  }
  kept.conservativeResize(3, count);
  return kept;
}

Vector3 centroid(const RawSurface& surface, Index face) {
  return surface.points(Eigen::all, surface.triangles.col(face)).rowwise().mean();
}

/// Parts connected by edges of two faces.
struct Patch {
  Index face = -1;
  Index faces = 0;
  double area = 0;
  bool open = false;   // has an edge of one face
  bool hangs = false;  // has an edge of three faces or more
  bool all_copied = true;
};

/// One round; true if it dropped something, which may make another patch hang free.
bool drop_flaps_once(RawSurface& surface, std::vector<bool>& copied, double share, StepLog& log) {
  const std::vector<Side> sides = sorted_sides(surface.triangles);
  DisjointSets faces(surface.triangles.cols());
  bool manifold = true;
  for_each_edge(sides, [&](std::span<const Side> edge) {
    if (edge.size() == 2) {
      faces.join(edge[0].face, edge[1].face);
    }
    manifold = manifold && edge.size() <= 2;
  });
  if (manifold) {
    return false;
  }
  int count = 0;
  const std::vector<int> patch_of = faces.numbered(count);
  std::vector<Patch> patches(at(count));
  for (Index f = 0; f < surface.triangles.cols(); ++f) {
    Patch& patch = patches[at(patch_of[at(f)])];
    patch.face = patch.faces++ == 0 ? f : patch.face;
    patch.area += 0.5 * twice_area_vector(surface.points, surface.triangles.col(f)).norm();
    patch.all_copied = patch.all_copied && copied[at(f)];
  }
  for_each_edge(sides, [&](std::span<const Side> edge) {
    for (const Side& side : edge) {
      Patch& patch = patches[at(patch_of[at(side.face)])];
      patch.open = patch.open || edge.size() == 1;
      patch.hangs = patch.hangs || edge.size() > 2;
    }
  });
  const double largest = std::max_element(patches.begin(), patches.end(), [](const Patch& p, const Patch& q) {
                           return p.area < q.area;
                         })->area;
  const auto is_flap = [&](const Patch& patch) {
    return patch.hangs && (patch.open ? patch.area < share * largest : patch.all_copied);
  };
  Patch dropped;
  for (const Patch& patch : patches) {
    if (is_flap(patch)) {
      dropped.face = dropped.faces == 0 ? patch.face : dropped.face;
      dropped.faces += patch.faces;
      dropped.area += patch.area;
    }
  }
  if (dropped.faces == 0) {
    return false;
  }
  log.push_back(fmt::format("dropped flaps of {} ({}) that hung on edges of three faces or more, the first at {}",
                            counted(dropped.faces, "face", "faces"), area_text(dropped.area),
                            place_text(centroid(surface, dropped.face), 2)));
  std::vector<bool> keep(at(surface.triangles.cols()));
  std::vector<bool> copied_kept;
  for (std::size_t f = 0; f < keep.size(); ++f) {
    keep[f] = !is_flap(patches[at(patch_of[f])]);
    if (keep[f]) {
      copied_kept.push_back(copied[f]);
    }
  }
  surface.triangles = picked(surface.triangles, keep);
  copied = std::move(copied_kept);
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

void drop_stray_pieces(RawSurface& surface, double share, StepLog& log) {
  const Pieces pieces = find_pieces(surface.points, surface.triangles, sorted_sides(surface.triangles));
  double largest = 0;
  for (const Piece& piece : pieces.list) {
    largest = std::max(largest, piece.area);
  }
  Index dropped = 0;
  double area = 0;
  Vector3 first = Vector3::Zero();
  for (const Piece& piece : pieces.list) {
    if (piece.area < share * largest) {
      first = dropped++ == 0 ? centroid(surface, piece.face) : first;
      area += piece.area;
    }
  }
  if (dropped == 0) {
    return;
  }
  std::vector<bool> keep(pieces.of_face.size());
  for (std::size_t f = 0; f < keep.size(); ++f) {
    keep[f] = pieces.list[at(pieces.of_face[f])].area >= share * largest;
  }
  const Index before = surface.triangles.cols();
  surface.triangles = picked(surface.triangles, keep);
  log.push_back(fmt::format("dropped {} ({}, {}), the first at {}", counted(dropped, "stray piece", "stray pieces"),
                            counted(before - surface.triangles.cols(), "face", "faces"), area_text(area),
                            place_text(first, 2)));
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
  std::map<Index, int> vertex_of_fan;  // of the fans at vertices with several
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
  struct Move {
    Vector3 to_rim = Vector3::Zero();  // sum over the fan's sides
    double sides = 0;
    double shortest = std::numeric_limits<double>::infinity();
  };
  std::map<int, Move> moves;
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
    const auto [entry, is_new] = vertex_of_fan.try_emplace(corners.root(corner), vertex);
    if (is_new && number_taken[at(vertex)]) {
      entry->second = static_cast<int>(surface.points.cols()) + static_cast<int>(added.size());
      added.push_back(x);
    } else if (is_new) {
      first = vertex_of_fan.size() == 1 ? x : first;
      number_taken[at(vertex)] = true;
    }
    surface.triangles(corner % 3, corner / 3) = entry->second;
    Move& move = moves[entry->second];
    for (const Index step : {1, 2}) {
      const Vector3 along = surface.points.col(before((corner + step) % 3, corner / 3)) - x;
      move.to_rim += along;
      move.sides += 1;
      move.shortest = std::min(move.shortest, along.norm());
    }
  }
  const Index old_count = surface.points.cols();
  surface.points.conservativeResize(3, old_count + static_cast<Index>(added.size()));
  for (std::size_t i = 0; i < added.size(); ++i) {
    surface.points.col(old_count + static_cast<Index>(i)) = added[i];
  }
  constexpr double kApart = 0.01;  // of the shortest edge: far above the digits that any file keeps
  for (const auto& [vertex, move] : moves) {
    const Vector3 to_rim = move.to_rim / move.sides;
    const double reach = to_rim.norm();
    if (reach > 0) {
      surface.points.col(vertex) += to_rim * std::min(1.0, move.shortest / reach) * kApart;
    }
  }
  log.push_back(fmt::format("split {} in which parts touched, the first at {}",
                            counted(points_pinched, "point", "points"), place_text(first, 2)));
}

void drop_unused_points(RawSurface& surface) {
  std::vector<int> number(at(surface.points.cols()), -1);
  for (const int v : surface.triangles.reshaped()) {
    number[at(v)] = 0;
  }
  int count = 0;
  for (std::size_t v = 0; v < number.size(); ++v) {
    if (number[v] >= 0) {
      number[v] = count;
      surface.points.col(count++) = surface.points.col(static_cast<Index>(v)).eval();
    }
  }
  surface.points.conservativeResize(3, count);
  for (int& v : surface.triangles.reshaped()) {
    v = number[at(v)];
  }
}

}  // namespace touchfield
