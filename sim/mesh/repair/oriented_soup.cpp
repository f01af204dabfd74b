#include "sim/mesh/repair/oriented_soup.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <utility>

#include <fmt/format.h>

#include "sim/core/counted.h"
#include "sim/core/errors.h"
#include "sim/mesh/face_shape.h"
#include "sim/mesh/io/weld.h"
#include "sim/mesh/query/face_tree.h"
#include "sim/mesh/query/inspect.h"
#include "sim/mesh/query/pieces.h"
#include "sim/mesh/subset.h"
#include "sim/mesh/topology.h"

namespace touchfield {

namespace {

using Index = Eigen::Index;

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

/// Turns faces so that the two at each edge run opposite ways, in each piece as most of its faces ran. Edges of more
/// than two faces connect nothing. What is not orientable keeps misoriented edges.
void make_consistent(Triangles& triangles, std::vector<std::string>& log) {
  const Neighbours neighbours = find_neighbours(sorted_sides(triangles));
  const auto count = at(triangles.cols());
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
  for (Index f = 0; f < triangles.cols(); ++f) {
    if (turned[at(f)]) {
      std::swap(triangles(1, f), triangles(2, f));
    }
  }
  log.push_back(
      fmt::format("turned {} to run the same way round as most of its piece", counted(turned_count, "face", "faces")));
}

/// Faces connected by edges of two faces.
struct Patch {
  std::vector<Index> faces;
  double area = 0;
  Vector3 middle = Vector3::Zero();
  double volume = 0;  // about its middle
  bool closed = true;
};

std::vector<Patch> find_patches(const TriangleMesh& mesh) {
  const std::vector<Side> sides = sorted_sides(mesh.triangles());
  const Pieces pieces = find_pieces(mesh.vertices(), mesh.triangles(), sides, 2);
  std::vector<Patch> patches(pieces.list.size());
  const auto patch = [&](Index f) -> Patch& { return patches[at(pieces.of_face[at(f)])]; };
  for_each_edge(sides, [&](std::span<const Side> edge) {
    if (edge.size() != 2) {
      std::ranges::for_each(edge, [&](const Side& side) { patch(side.face).closed = false; });
    }
  });
  for (Index f = 0; f < mesh.face_count(); ++f) {
    patch(f).faces.push_back(f);
    patch(f).area += mesh.areas()(f);
    patch(f).middle += mesh.areas()(f) * mesh.centroids().col(f);
  }
  for (Patch& p : patches) {
    p.middle /= p.area;
    for (const Index f : p.faces) {
      p.volume += mesh.areas()(f) * mesh.normals().col(f).dot(mesh.centroids().col(f) - p.middle) / 3.0;
    }
  }
  return patches;
}

void turn(Triangles& triangles, const Patch& patch) {
  for (const Index f : patch.faces) {
    std::swap(triangles(1, f), triangles(2, f));
  }
}

/// How much the winding number of other faces rises along a patch's normals, over half its size: the mean over some of
/// its faces.
double rise_along(const FaceTree& others, const TriangleMesh& mesh, const Patch& patch) {
  constexpr std::size_t kMostFaces = 64;
  const double step = 0.25 * std::sqrt(patch.area);
  const std::size_t stride = (patch.faces.size() + kMostFaces - 1) / kMostFaces;
  double rise = 0;
  double area = 0;
  for (std::size_t i = 0; i < patch.faces.size(); i += stride) {
    const Index f = patch.faces[i];
    const Vector3 x = mesh.centroids().col(f);
    const Vector3 along = step * mesh.normals().col(f);
    rise += mesh.areas()(f) * (others.winding_number(x + along) - others.winding_number(x - along));
    area += mesh.areas()(f);
  }
  return rise / area;
}

bool looks_inwards(const TriangleMesh& mesh, const Patch& patch, const FaceTree* others) {
  constexpr double kClearRise = 0.1;      // above what winding numbers are accurate to
  constexpr double kClearVolume = 0.005;  // over area^1.5: a cap as high as a twelfth of its radius
  if (!patch.closed && others != nullptr) {
    const double rise = rise_along(*others, mesh, patch);
    if (std::abs(rise) > kClearRise) {
      return rise > 0;
    }
  }
  return patch.volume < (patch.closed ? 0.0 : -kClearVolume * std::pow(patch.area, 1.5));
}

/// The faces with those of whole patches turned; counts these patches.
Triangles turned_outwards(const TriangleMesh& mesh, Index& turned) {
  std::vector<Patch> patches = find_patches(mesh);
  std::ranges::stable_sort(
      patches, [](const Patch& a, const Patch& b) { return a.closed != b.closed ? a.closed : a.area > b.area; });
  Triangles triangles = mesh.triangles();
  std::vector<Index> placed;
  for (std::size_t first = 0; first < patches.size();) {
    // Those of one class do not see each other: a tree is built for each halving of the area only.
    constexpr double kClass = 0.5;
    const auto end =
        std::find_if(patches.begin() + static_cast<std::ptrdiff_t>(first), patches.end(), [&](const Patch& p) {
          return p.closed != patches[first].closed || (!p.closed && p.area <= kClass * patches[first].area);
        });
    const auto last = static_cast<std::size_t>(end - patches.begin());
    std::optional<FaceTree> tree;
    if (!placed.empty() && !patches[first].closed) {
      tree.emplace(TriangleMesh(mesh.vertices(), triangles(Eigen::all, placed)));
    }
    std::vector<char> inwards(last - first);
#pragma omp parallel for schedule(dynamic)
    for (std::size_t i = first; i < last; ++i) {
      inwards[i - first] = looks_inwards(mesh, patches[i], tree ? &*tree : nullptr) ? 1 : 0;
    }
    for (std::size_t i = first; i < last; ++i) {
      if (inwards[i - first] != 0) {
        turn(triangles, patches[i]);
        ++turned;
      }
      placed.insert(placed.end(), patches[i].faces.begin(), patches[i].faces.end());
    }
    first = last;
  }
  return triangles;
}

}  // namespace

OrientedSoup oriented_soup(const FileSurface& surface, double unit, const std::string& name) {
  std::vector<std::string> steps;
  WeldedSurface merged = welded(surface, unit);
  Points points = std::move(merged.points);
  Triangles triangles = without_duplicates(merged.triangles);
  triangles = faces_where(triangles, [&](Index f) { return !is_flat(points, triangles.col(f)); });
  const Index count = triangles.cols();
  if (count == 0) {
    throw InputError(fmt::format("{}: no face has an area", name));
  }
  if (const Index left_out = static_cast<Index>(surface.triangles.size()) - count; left_out > 0) {
    steps.push_back(fmt::format("left out {} without area or with the corners of an earlier one",
                                counted(left_out, "face", "faces")));
  }
  drop_unused_points(points, triangles);
  make_consistent(triangles, steps);
  const TriangleMesh mesh(points, triangles);
  Index turned = 0;
  Triangles outward = turned_outwards(mesh, turned);
  if (turned > 0) {
    steps.push_back(fmt::format("turned {} outwards", counted(turned, "patch", "patches")));
  }
  return {TriangleMesh(std::move(points), std::move(outward)), std::move(steps)};
}

}  // namespace touchfield
