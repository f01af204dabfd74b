#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <set>
#include <unordered_set>
#include <vector>

#include <fmt/format.h>

#include "sim/core/counted.h"
#include "sim/core/place_text.h"
#include "sim/core/units.h"
#include "sim/mesh/face_shape.h"
#include "sim/mesh/query/inspect.h"
#include "sim/mesh/query/pieces.h"
#include "sim/mesh/query/self_intersections.h"
#include "sim/mesh/remesh/edit_mesh.h"
#include "sim/mesh/remesh/flat_faces.h"
#include "sim/mesh/repair/fill_holes.h"
#include "sim/mesh/repair/repair_steps.h"
#include "sim/mesh/subset.h"
#include "sim/mesh/topology.h"

namespace touchfield {

namespace {

using Index = Eigen::Index;
using Loop = std::vector<int>;

std::uint64_t edge_key(int a, int b) {
  const auto [low, high] = std::minmax(a, b);
  return (static_cast<std::uint64_t>(low) << 32) | static_cast<std::uint64_t>(high);
}

double length(const Points& points, const Loop& loop) {
  double sum = 0;
  for (std::size_t i = 0; i < loop.size(); ++i) {
    sum += (points.col(loop[(i + 1) % loop.size()]) - points.col(loop[i])).norm();
  }
  return sum;
}

Vector3 middle(const Points& points, const Loop& loop) { return points(Eigen::all, loop).rowwise().mean(); }

/// The edges that a filling has inside the loop, or nothing if one of them is in the surface already.
bool add_inner_edges(const Loop& loop, const std::vector<std::array<int, 3>>& filling,
                     std::unordered_set<std::uint64_t>& edges) {
  std::unordered_set<std::uint64_t> rim;
  for (std::size_t i = 0; i < loop.size(); ++i) {
    rim.insert(edge_key(loop[i], loop[(i + 1) % loop.size()]));
  }
  std::vector<std::uint64_t> inner;
  for (const auto& face : filling) {
    for (std::size_t c = 0; c < 3; ++c) {
      const std::uint64_t key = edge_key(face[c], face[(c + 1) % 3]);
      if (rim.count(key) == 0) {
        inner.push_back(key);
      }
    }
  }
  const auto taken = [&](std::uint64_t key) { return edges.count(key) > 0; };
  if (std::any_of(inner.begin(), inner.end(), taken)) {
    return false;
  }
  edges.insert(inner.begin(), inner.end());
  return true;
}

std::vector<std::array<int, 3>> fan_round(const Loop& loop, int centre) {
  std::vector<std::array<int, 3>> fan;
  for (std::size_t i = 0; i < loop.size(); ++i) {
    fan.push_back({loop[i], loop[(i + 1) % loop.size()], centre});
  }
  return fan;
}

void append(RawSurface& surface, const std::vector<std::array<int, 3>>& faces) {
  const auto count = static_cast<Index>(faces.size());
  surface.triangles.conservativeResize(3, surface.triangles.cols() + count);
  surface.triangles.rightCols(count) = as_columns(faces);
}

/// The faces that have a vertex on a loop.
Triangles faces_at(const Loop& loop, const RawSurface& surface, const FacesRound& round) {
  std::set<Index> found;
  for (const int v : loop) {
    found.insert(round.of(v).begin(), round.of(v).end());
  }
  return surface.triangles(Eigen::all, std::vector<Index>(found.begin(), found.end()));
}

std::string hole_text(const Points& points, const Loop& loop) {
  return fmt::format("{} edges, {:.2f} mm round, near {}", loop.size(), length(points, loop) / kMillimetre,
                     place_text(middle(points, loop), 2));
}

// Faces this thin do not survive the digits of a single-precision file: on a 10 mm edge 20 nm high.
constexpr double kSliver = 1e-6;  // area over longest edge squared

bool is_closed_manifold(const RawSurface& surface) {
  bool closed = true;
  for_each_edge(sorted_sides(surface.triangles), [&](std::span<const Side> edge) {
    closed = closed && edge.size() == 2 && edge[0].upwards != edge[1].upwards;
  });
  return closed;
}

std::size_t piece_count(const RawSurface& surface) {
  return find_pieces(surface.points, surface.triangles, sorted_sides(surface.triangles)).list.size();
}

/// The surface without the faces that cut each other and all that share a vertex with them, and their area; nothing if
/// that is more than `most` of all.
std::optional<double> cut_out(RawSurface& surface, const std::vector<std::pair<Index, Index>>& crossings, double most) {
  std::vector<bool> near(at(surface.points.cols()), false);
  for (const auto& [one, other] : crossings) {
    for (const Index face : {one, other}) {
      for (const int v : surface.triangles.col(face)) {
        near[at(v)] = true;
      }
    }
  }
  double area = 0;
  double area_cut = 0;
  Triangles kept = faces_where(surface.triangles, [&](Index f) {
    const auto corners = surface.triangles.col(f);
    const double face_area = 0.5 * twice_area_vector(surface.points, corners).norm();
    const bool cut = near[at(corners(0))] || near[at(corners(1))] || near[at(corners(2))];
    area += face_area;
    area_cut += cut ? face_area : 0.0;
    return !cut;
  });
  if (area_cut > most * area) {
    return std::nullopt;
  }
  surface.triangles = std::move(kept);
  return area_cut;
}

}  // namespace

std::vector<std::string> fill_small_holes(RawSurface& surface, double limit, StepLog& log,
                                          const std::function<bool(const Vector3&)>& unwanted) {
  constexpr std::size_t kMostEdges = 2000;  // of fill_loop
  constexpr std::size_t kMostNamed = 5;
  std::vector<std::string> left;
  std::size_t left_count = 0;
  std::size_t filled = 0;
  Loop longest;
  std::unordered_set<std::uint64_t> edges;
  std::optional<FacesRound> round;
  for (const Loop& loop : boundary_loops(surface.triangles, static_cast<int>(surface.points.cols()))) {
    const bool cut_off = unwanted && std::ranges::all_of(loop, [&](int v) { return unwanted(surface.points.col(v)); });
    if ((length(surface.points, loop) > limit && !cut_off) || loop.size() > kMostEdges) {
      if (++left_count <= kMostNamed) {
        left.push_back(fmt::format("a hole of {} is {}", hole_text(surface.points, loop),
                                   loop.size() > kMostEdges
                                       ? fmt::format("longer than {} edges", kMostEdges)
                                       : fmt::format("above the limit of {:.2f} mm (--hole-mm raises it, "
                                                     "--resurface MM closes any hole)",
                                                     limit / kMillimetre)));
      }
      continue;
    }
    if (!round) {
      round.emplace(surface.triangles, surface.points.cols());
      for (const Side& side : sorted_sides(surface.triangles)) {
        edges.insert(edge_key(side.low, side.high));
      }
    }
    std::vector<std::array<int, 3>> filling = fill_loop(surface.points, loop, faces_at(loop, surface, *round));
    if (!add_inner_edges(loop, filling, edges)) {
      const auto centre = static_cast<int>(surface.points.cols());
      filling = fan_round(loop, centre);
      add_inner_edges(loop, filling, edges);
      surface.points.conservativeResize(3, centre + 1);
      surface.points.col(centre) = middle(surface.points, loop);
    }
    append(surface, filling);
    longest = filled++ == 0 || length(surface.points, loop) > length(surface.points, longest) ? loop : longest;
  }
  if (filled > 0) {
    log.push_back(fmt::format("filled {} {} of {}", filled, filled == 1 ? "hole," : "holes, the longest",
                              hole_text(surface.points, longest)));
  }
  if (left_count > kMostNamed) {
    left.push_back(fmt::format("{} more holes are above the limit", left_count - kMostNamed));
  }
  return left;
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

  const std::vector<bool> inner = nested(surface.points, surface.triangles, pieces);
  if (const Dropped dropped = drop_pieces(surface, pieces, inner); dropped.pieces > 0) {
    log.push_back(fmt::format("dropped {} inside another, where no sound comes ({}, {}), the first at {}",
                              counted(dropped.pieces, "piece", "pieces"), dropped.faces, dropped.area, dropped.place));
  }
}

void cut_out_crossings(RawSurface& surface, double share, StepLog& log) {
  constexpr int kRounds = 3;
  constexpr double kMostArea = 0.03;
  const std::size_t pieces = piece_count(surface);
  RawSurface trial = surface;
  std::size_t pairs = 0;
  double area = 0;
  StepLog dropped;
  Vector3 first = Vector3::Zero();
  for (int round = 0; round <= kRounds; ++round) {
    const TriangleMesh mesh(trial.points, trial.triangles);
    const auto crossings = self_intersections(mesh);
    if (crossings.empty()) {
      if (round > 0) {
        log.push_back(fmt::format(
            "cut out the surroundings of {} {} of intersecting faces ({}) and filled the holes, the first at {}", pairs,
            pairs == 1 ? "pair" : "pairs", area_text(area), place_text(first, 2)));
        log.insert(log.end(), dropped.begin(), dropped.end());
        surface = std::move(trial);
      }
      return;
    }
    first = pairs == 0 ? mesh.centroids().col(crossings.front().first) : first;
    pairs += crossings.size();
    StepLog details;
    const std::optional<double> cut = round == kRounds ? std::nullopt : cut_out(trial, crossings, kMostArea);
    if (!cut) {
      return;
    }
    area += *cut;
    drop_stray_pieces(trial, share, dropped);
    const bool fell_apart = piece_count(trial) != pieces;
    if (fell_apart || !fill_small_holes(trial, std::numeric_limits<double>::infinity(), details).empty()) {
      return;
    }
    split_pinched_vertices(trial, details);
    drop_unused_points(trial.points, trial.triangles);
    if (!is_closed_manifold(trial)) {
      return;
    }
    remove_slivers(trial, details);
    turn_outwards(trial, dropped);
    const auto columns = trial.triangles.colwise();
    if (std::any_of(columns.begin(), columns.end(), [&](const auto& face) { return is_flat(trial.points, face); })) {
      return;
    }
  }
}

}  // namespace touchfield
