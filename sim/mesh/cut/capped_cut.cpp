#include "sim/mesh/cut/capped_cut.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/place_text.h"
#include "sim/mesh/query/inspect.h"
#include "sim/mesh/query/self_intersections.h"

namespace touchfield {

namespace {

/// The skin's faces come first; those of its points that share a face with the rim may change.
TriangleMesh without_thin_faces(const TriangleMesh& mesh, Eigen::Index skin_faces, const CutPlace& place) {
  const auto vertices = static_cast<std::size_t>(mesh.vertex_count());
  CappedSurface surface{mesh.vertices(), mesh.triangles(), {}, std::vector<bool>(vertices, true), place.tolerance};
  std::vector<bool> in_cap(vertices, false);
  for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
    surface.is_cap.push_back(f >= skin_faces);
    for (const int v : mesh.triangles().col(f)) {
      in_cap[static_cast<std::size_t>(v)] = f >= skin_faces || in_cap[static_cast<std::size_t>(v)];
    }
  }
  for (const auto& face : mesh.triangles().colwise()) {
    const bool at_cap =
        std::any_of(face.begin(), face.end(), [&](int v) { return in_cap[static_cast<std::size_t>(v)]; });
    for (const int v : face) {
      if (at_cap && (in_cap[static_cast<std::size_t>(v)] || place.may_change(mesh.vertices().col(v)))) {
        surface.is_fixed[static_cast<std::size_t>(v)] = false;
      }
    }
  }
  remove_thin_faces(surface);
  return {std::move(surface.points), std::move(surface.triangles)};
}

void require_closed(const TriangleMesh& mesh, const CutPlace& place) {
  const MeshReport report = inspect(mesh);
  if (!report.faults.empty()) {
    throw InputError(fmt::format("mesh: {} leaves no closed surface: {}; change it a little", place.what,
                                 fmt::join(report.faults, "; ")));
  }
}

/// The body may cut itself elsewhere: that is not the cut's doing.
void require_no_intersection(const TriangleMesh& mesh, const CutPlace& place) {
  const auto is_near = [&](Eigen::Index face) {
    return place.is_near(mesh.corner(face, 0)) || place.is_near(mesh.corner(face, 1)) ||
           place.is_near(mesh.corner(face, 2));
  };
  for (const auto& [one, other] : self_intersections(mesh)) {
    if (is_near(one) || is_near(other)) {
      throw InputError(fmt::format("mesh: {} leaves a surface that intersects itself near {}; change it a little",
                                   place.what, place_text(mesh.centroids().col(one), 2)));
    }
  }
}

}  // namespace

TriangleMesh first_sound_cut(const std::vector<CutCare>& cares, const CutPlace& place,
                             const std::function<CappedCut(const CutCare&)>& cut) {
  std::string last_error;
  for (const CutCare& care : cares) {
    try {
      const CappedCut capped = cut(care);
      TriangleMesh mesh = as_mesh(capped.surface);
      require_closed(mesh, place);
      if (care.mends) {
        mesh = without_thin_faces(mesh, capped.skin_faces, place);
        require_closed(mesh, place);
      }
      require_no_intersection(mesh, place);
      return mesh;
    } catch (const InputError& error) {
      last_error = error.what();
    }
  }
  throw InputError(last_error);
}

}  // namespace touchfield
