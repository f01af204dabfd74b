#include "sim/mesh/repair/closed_mesh.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/text.h"
#include "sim/mesh/face_shape.h"
#include "sim/mesh/io/weld.h"
#include "sim/mesh/query/inspect.h"
#include "sim/mesh/remesh/flat_faces.h"

namespace touchfield {

namespace {

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

}  // namespace

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

}  // namespace touchfield
