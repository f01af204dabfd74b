#include "sim/body/shapes.h"

#include <functional>

#include <fmt/format.h>

#include "python/src/arrays.h"
#include "python/src/job.h"
#include "python/src/parts.h"
#include "sim/body/hand.h"
#include "sim/core/errors.h"
#include "sim/mesh/io/mesh_io.h"

namespace touchfield::python {

namespace {

/// Landmarks as Python gets them, each an array of three numbers.
nb::dict landmark_dict(const SkinMesh& skin) {
  nb::dict landmarks;
  for (const auto& [name, point] : skin.landmarks) {
    landmarks[name.c_str()] = owned(Eigen::VectorXd(point));
  }
  return landmarks;
}

SkinMesh hand_mesh(const std::string& pose, double edge, double breadth, double length, const std::string& side) {
  if (side != "right" && side != "left") {
    throw InputError(fmt::format("hand: side = '{}' must be right or left", side));
  }
  HandOptions options;
  options.pose = pose;
  options.edge = edge;
  options.breadth = breadth;
  options.length = length;
  options.side = side == "right" ? HandSide::kRight : HandSide::kLeft;
  return computed(0, [options](Progress&) { return skin_mesh(hand(options)); });
}

void add_mesh_class(nb::module_& module) {
  const auto part = [](auto get) {
    return [get](nb::handle_t<SkinMesh> self) {
      return view(std::invoke(get, *nb::cast<const SkinMesh&>(self).mesh), self);
    };
  };
  nb::class_<SkinMesh>(module, "Mesh", "A triangulated surface; normals outwards, lengths in m. Never changed.")
      .def(
          "__init__",
          [](SkinMesh* self, nb::handle vertices, nb::handle triangles) {
            new (self) SkinMesh{shared(
                TriangleMesh(point_rows(vertices, "Mesh: vertices"), triangle_rows(triangles, "Mesh: triangles")))};
          },
          nb::arg("vertices"), nb::arg("triangles"),
          nb::sig("def __init__(self, vertices: numpy.typing.ArrayLike, triangles: numpy.typing.ArrayLike) -> None"))
      .def_prop_ro("vertices", part(&TriangleMesh::vertices))
      .def_prop_ro("triangles", part(&TriangleMesh::triangles))
      .def_prop_ro("centroids", part(&TriangleMesh::centroids))
      .def_prop_ro("normals", part(&TriangleMesh::normals))
      .def_prop_ro("areas", part(&TriangleMesh::areas))
      .def_prop_ro("mean_edge", [](const SkinMesh& self) { return self.mesh->mean_edge(); })
      .def_prop_ro("volume", [](const SkinMesh& self) { return self.mesh->signed_volume(); })
      .def_prop_ro("landmarks", &landmark_dict,
                   nb::sig("def landmarks(self) -> dict[str, numpy.typing.NDArray[numpy.float64]]"),
                   "Named points on the skin [m], of the shapes that have some.")
      .def(
          "save",
          [](const SkinMesh& self, nb::handle path, double unit) {
            computed(0, [mesh = self.mesh, file = path_of(path), unit](Progress&) {
              write_mesh(file, *mesh, unit);
              return true;
            });
          },
          nb::arg("path"), nb::arg("unit") = 1e-3,
          nb::sig("def save(self, path: str | os.PathLike, unit: float = 1e-3) -> None"),
          "Writes STL, OBJ, PLY, OFF or VTP by the ending, in units of so many metres.")
      .def("__len__", [](const SkinMesh& self) { return self.mesh->face_count(); })
      .def("__repr__", [](const SkinMesh& self) {
        return fmt::format("<touchfield.Mesh: {} faces, mean edge {:.2f} mm>", self.mesh->face_count(),
                           1e3 * self.mesh->mean_edge());
      });
}

}  // namespace

SkinMesh skin_mesh(const Body& body) {
  SkinMesh skin{shared(body.mesh)};
  for (const Landmark& landmark : body.landmarks) {
    skin.landmarks[landmark.name] = position(body.mesh, landmark);
  }
  return skin;
}

void add_shapes(nb::module_& module) {
  add_mesh_class(module);
  module.def(
      "read_mesh",
      [](nb::handle path, double unit) {
        return computed(0, [file = path_of(path), unit](Progress&) { return SkinMesh{shared(read_mesh(file, unit))}; });
      },
      nb::arg("path"), nb::arg("unit") = 1e-3,
      nb::sig("def read_mesh(path: str | os.PathLike, unit: float = 1e-3) -> Mesh"),
      "A mesh of an STL, OBJ, PLY, OFF or VTP file in units of so many metres.");
  module.def("hand", &hand_mesh, nb::arg("pose") = HandOptions{}.pose, nb::kw_only(),
             nb::arg("edge") = HandOptions{}.edge, nb::arg("breadth") = HandOptions{}.breadth,
             nb::arg("length") = HandOptions{}.length, nb::arg("side") = "right",
             "The built-in hand in its own frame [m]: the wrist at the origin, y to the fingertips, z out of its back; "
             "a right "
             "hand's thumb is at negative x.");
  module.def(
      "sphere", [](double radius, double edge) { return skin_mesh(sphere(radius, edge)); }, nb::arg("radius"),
      nb::arg("edge"), "A sphere about the origin [m].");
}

}  // namespace touchfield::python
