#include "sim/mesh/cut/boundary_loops.h"

#include <algorithm>
#include <iterator>
#include <span>
#include <utility>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/mesh/topology.h"

namespace touchfield {

namespace {

/// The side 3 f + c of the other face at each side's edge, -1 at the boundary.
std::vector<Eigen::Index> opposite_sides(const Triangles& triangles) {
  std::vector<Eigen::Index> opposite(static_cast<std::size_t>(triangles.size()), -1);
  for_each_edge(sorted_sides(triangles), [&](std::span<const Side> edge) {
    const Side& one = edge.front();
    if (one.low == one.high) {
      throw InputError(fmt::format("mesh: face {} names vertex {} twice", one.face, one.low));
    }
    const auto upwards = std::ranges::count_if(edge, &Side::upwards);
    if (upwards > 1 || std::ssize(edge) - upwards > 1) {
      throw InputError(fmt::format("mesh: two faces run the same way along the edge from vertex {} to {}",
                                   upwards > 1 ? one.low : one.high, upwards > 1 ? one.high : one.low));
    }
    if (edge.size() == 2) {
      opposite[static_cast<std::size_t>(one.number())] = edge[1].number();
      opposite[static_cast<std::size_t>(edge[1].number())] = one.number();
    }
  });
  return opposite;
}

/// Cuts a closed walk at the vertices that it passes twice.
void add_simple_loops(const std::vector<int>& walk, std::vector<int>& place, std::vector<std::vector<int>>& loops) {
  std::vector<int> open;
  for (const int v : walk) {
    int& at = place[static_cast<std::size_t>(v)];
    if (at >= 0) {
      const auto first = open.begin() + at;
      for (auto later = first + 1; later != open.end(); ++later) {
        place[static_cast<std::size_t>(*later)] = -1;
      }
      loops.emplace_back(first, open.end());
      open.erase(first + 1, open.end());
    } else {
      at = static_cast<int>(open.size());
      open.push_back(v);
    }
  }
  for (const int v : open) {
    place[static_cast<std::size_t>(v)] = -1;
  }
  loops.push_back(std::move(open));
}

}  // namespace

std::vector<std::vector<int>> boundary_loops(const Triangles& triangles, int vertex_count) {
  const std::vector<Eigen::Index> opposites = opposite_sides(triangles);
  const auto opposite = [&](Eigen::Index side) { return opposites[static_cast<std::size_t>(side)]; };
  const auto next = [](Eigen::Index side) { return side % 3 == 2 ? side - 2 : side + 1; };

  std::vector<std::vector<int>> loops;
  std::vector<bool> done(static_cast<std::size_t>(triangles.size()), false);
  std::vector<int> place(static_cast<std::size_t>(vertex_count), -1);
  for (Eigen::Index first = 0; first < triangles.size(); ++first) {
    if (done[static_cast<std::size_t>(first)] || opposite(first) >= 0) {
      continue;
    }
    // Along the boundary as the faces run, round the fan of faces at each vertex; a filling runs the other way.
    std::vector<int> walk;
    Eigen::Index side = first;
    do {
      done[static_cast<std::size_t>(side)] = true;
      walk.push_back(triangles(side % 3, side / 3));
      side = next(side);
      for (Eigen::Index beyond = opposite(side); beyond >= 0; beyond = opposite(side)) {
        side = next(beyond);
      }
    } while (side != first);
    std::reverse(walk.begin(), walk.end());
    add_simple_loops(walk, place, loops);
  }
  return loops;
}

}  // namespace touchfield
