#include "sim/mesh/remesh/closed_mesh.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>
#include <optional>
#include <span>
#include <utility>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/require.h"
#include "sim/core/text.h"
#include "sim/mesh/face_shape.h"
#include "sim/mesh/query/face_tree.h"
#include "sim/mesh/query/self_intersections.h"
#include "sim/mesh/remesh/edit_mesh.h"
#include "sim/mesh/topology.h"

namespace touchfield {

namespace {

using Index = Eigen::Index;

Eigen::Index flat_faces(const WeldedSurface& surface) {
  const auto faces = surface.triangles.colwise();
  return std::count_if(faces.begin(), faces.end(), [&](const auto& face) { return is_flat(surface.points, face); });
}

/// Removes faces with next to no area of a closed surface.
void remove_slivers(WeldedSurface& surface, std::vector<std::string>& steps) {
  // Faces this thin do not survive the digits of a single-precision file: on a 10 mm edge 20 nm high.
  constexpr double kSliver = 1e-6;  // area over longest edge squared
  EditMesh mesh(surface.triangles, surface.points.cols());
  const FlatFaces done = remove_flat_faces(mesh, surface.points, kSliver);
  std::vector<int> numbers;
  surface.triangles = mesh.compact(numbers);
  surface.points = surface.points(Eigen::all, numbers).eval();
  steps.push_back(fmt::format("removed {} with next to no area, the first at {}",
                              counted(done.removed, "face", "faces"), place_text(done.first, 2)));
}

/// Faces connected by edges of two faces.
struct Patch {
  std::vector<Index> faces;
  double area = 0;
  Vector3 middle = Vector3::Zero();
  double volume = 0;   // about its middle
  double border = 0;   // length of its edges of one face, or of more than two
  bool closed = true;  // but for small holes
};

void turn(Triangles& triangles, const std::vector<Index>& faces) {
  for (const Index f : faces) {
    std::swap(triangles(1, f), triangles(2, f));
  }
}

/// The patches, their faces turned so that the two at each edge run opposite ways, as most of the patch's faces ran.
/// What is not orientable keeps edges whose faces run the same way. Says how many faces were turned.
std::vector<Patch> consistent_patches(const Points& points, Triangles& triangles, std::vector<std::string>& log) {
  struct Across {  // a side, 3 face + corner
    Index face = -1;
    bool same_way = false;
  };
  std::vector<Across> across(at(triangles.size()));
  for_each_edge(sorted_sides(triangles), [&](std::span<const Side> edge) {
    if (edge.size() == 2) {
      const bool same_way = edge[0].upwards == edge[1].upwards;
      across[at(edge[0].number())] = {edge[1].face, same_way};
      across[at(edge[1].number())] = {edge[0].face, same_way};
    }
  });
  std::vector<Patch> patches;
  std::vector<char> reached(at(triangles.cols()), 0);
  std::vector<char> against(reached.size(), 0);
  Index turned = 0;
  for (Index start = 0; start < triangles.cols(); ++start) {
    if (reached[at(start)] != 0) {
      continue;
    }
    reached[at(start)] = 1;
    Patch patch{.faces = {start}};
    for (std::size_t next = 0; next < patch.faces.size(); ++next) {
      const std::size_t face = at(patch.faces[next]);
      for (std::size_t side = 3 * face; side < 3 * face + 3; ++side) {
        const auto [other, same_way] = across[side];
        if (other < 0) {
          const auto end = [&](std::size_t corner) { return points.col(triangles(Index(corner % 3), Index(face))); };
          patch.border += (end(side + 1) - end(side)).norm();
        } else if (reached[at(other)] == 0) {
          reached[at(other)] = 1;
          against[at(other)] = (against[face] != 0) != same_way ? 1 : 0;
          patch.faces.push_back(other);
        }
      }
    }
    std::vector<Index> one_way;
    std::vector<Index> other_way;
    for (const Index f : patch.faces) {
      (against[at(f)] != 0 ? one_way : other_way).push_back(f);
    }
    const std::vector<Index>& fewer = one_way.size() > other_way.size() ? other_way : one_way;
    turn(triangles, fewer);
    turned += std::ssize(fewer);
    patches.push_back(std::move(patch));
  }
  if (turned > 0) {
    log.push_back(
        fmt::format("turned {} to run the same way round as most of its piece", counted(turned, "face", "faces")));
  }
  return patches;
}

void measure(Patch& patch, const TriangleMesh& mesh) {
  for (const Index f : patch.faces) {
    patch.area += mesh.areas()(f);
    patch.middle += mesh.areas()(f) * mesh.centroids().col(f);
  }
  patch.middle /= patch.area;
  for (const Index f : patch.faces) {
    patch.volume += mesh.areas()(f) * mesh.normals().col(f).dot(mesh.centroids().col(f) - patch.middle) / 3.0;
  }
  constexpr double kSmallHole = 0.05;  // of the area; a border goes round no more than a circle as long
  patch.closed = patch.border * patch.border / (4.0 * std::numbers::pi) <= kSmallHole * patch.area;
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
Triangles turned_outwards(const TriangleMesh& mesh, std::vector<Patch>& patches, Index& turned) {
  std::ranges::for_each(patches, [&](Patch& patch) { measure(patch, mesh); });
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
        turn(triangles, patches[i].faces);
        ++turned;
      }
      placed.insert(placed.end(), patches[i].faces.begin(), patches[i].faces.end());
    }
    first = last;
  }
  return triangles;
}

}  // namespace

SkinReport inspect_skin(const Points& points, const Triangles& triangles) {
  SkinReport report;
  Index first_flat = -1;
  Triangles solid = faces_where(triangles, [&](Index f) {
    const bool flat = is_flat(points, triangles.col(f));
    first_flat = flat && report.flat_faces++ == 0 ? f : first_flat;
    return !flat;
  });
  if (solid.cols() == 0) {
    report.faults.emplace_back("no face has an area");
    return report;
  }
  if (report.flat_faces > 0) {
    report.faults.push_back(fmt::format("{} without area, the first at {}", counted(report.flat_faces, "face", "faces"),
                                        place_text(points.col(triangles(0, first_flat)), 2)));
  }
  report.mesh = inspect(points, triangles);
  report.faults.insert(report.faults.end(), report.mesh.faults.begin(), report.mesh.faults.end());
  const TriangleMesh mesh(points, std::move(solid));
  report.mean_edge = mesh.mean_edge();
  const auto pairs = self_intersections(mesh, SkinReport::kMostCrossings);
  report.crossings = std::ssize(pairs);
  if (!pairs.empty()) {
    report.faults.push_back(self_intersections_text(mesh, pairs, SkinReport::kMostCrossings));
  }
  return report;
}

SurfaceReport inspect_surface(const FileSurface& surface, double unit) {
  const WeldedSurface merged = welded(surface, unit);
  const Triangles triangles = without_duplicates(merged.triangles);

  SurfaceReport report;
  report.points = static_cast<Index>(surface.points.size());
  report.faces = static_cast<Index>(surface.triangles.size());
  report.unreferenced_points = merged.unreferenced;
  report.repeated_points = merged.welded;
  report.collapsed_faces = merged.collapsed_faces;
  report.duplicate_faces = merged.triangles.cols() - triangles.cols();
  report.skin = inspect_skin(merged.points, triangles);

  std::vector<std::string> faults;
  if (report.collapsed_faces > 0) {
    faults.push_back(counted(report.collapsed_faces, "face has", "faces have") + " two corners in one point");
  }
  if (report.duplicate_faces > 0) {
    faults.push_back(counted(report.duplicate_faces, "face has", "faces have") + " the corners of an earlier one");
  }
  report.skin.faults.insert(report.skin.faults.begin(), faults.begin(), faults.end());
  return report;
}

ClosedMesh closed_mesh(const FileSurface& file, double unit, const std::string& name) {
  WeldedSurface surface = welded(file, unit);
  std::vector<std::string> steps;
  if (surface.collapsed_faces > 0) {
    steps.push_back(
        fmt::format("dropped {} with two corners in one point", counted(surface.collapsed_faces, "face", "faces")));
  }
  std::vector<std::string> faults = {"no face has an area"};
  if (surface.triangles.cols() > 0) {
    faults = inspect(surface.points, surface.triangles).faults;
  }
  if (faults.empty() && flat_faces(surface) > 0) {
    remove_slivers(surface, steps);
    if (const Eigen::Index left = flat_faces(surface); left > 0) {
      faults.push_back(counted(left, "face", "faces") + " without area");
    }
  }
  if (!faults.empty()) {
    throw InputError(
        fmt::format("{}: the mesh must be a closed surface with outward normals: {}; try touchfield mesh "
                    "{} --resurface MM -o fixed.obj with MM the length of its new edges",
                    name, fmt::join(faults, "; "), name));
  }
  return {TriangleMesh(std::move(surface.points), std::move(surface.triangles)), std::move(steps)};
}

OrientedSoup oriented_soup(const FileSurface& surface, double unit, const std::string& name) {
  std::vector<std::string> steps;
  WeldedSurface merged = welded(surface, unit);
  Points points = std::move(merged.points);
  Triangles triangles = without_duplicates(merged.triangles);
  triangles = faces_where(triangles, [&](Index f) { return !is_flat(points, triangles.col(f)); });
  const Index count = triangles.cols();
  require(count != 0, "{}: no face has an area", name);
  if (const Index left_out = static_cast<Index>(surface.triangles.size()) - count; left_out > 0) {
    steps.push_back(fmt::format("left out {} without area or with the corners of an earlier one",
                                counted(left_out, "face", "faces")));
  }
  drop_unused_points(points, triangles);
  std::vector<Patch> patches = consistent_patches(points, triangles, steps);
  const TriangleMesh mesh(points, triangles);
  Index turned = 0;
  Triangles outward = turned_outwards(mesh, patches, turned);
  if (turned > 0) {
    steps.push_back(fmt::format("turned {} outwards", counted(turned, "patch", "patches")));
  }
  return {TriangleMesh(std::move(points), std::move(outward)), std::move(steps)};
}

}  // namespace touchfield
