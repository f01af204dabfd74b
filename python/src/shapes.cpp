#include "sim/body/shapes.h"

#include <algorithm>
#include <functional>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "python/src/arrays.h"
#include "python/src/job.h"
#include "python/src/parts.h"
#include "sim/body/hand.h"
#include "sim/core/errors.h"
#include "sim/core/units.h"
#include "sim/mesh/io/mesh_io.h"
#include "sim/mesh/io/unit_guess.h"

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

/// Refuses what is not the size of any body; warns of what is none of a person.
void check_size(const TriangleMesh& mesh, const std::string& name) {
  FileSurface surface;
  for (const auto& point : mesh.vertices().colwise()) {
    surface.points.emplace_back(point);
  }
  for (const auto& corners : mesh.triangles().colwise()) {
    surface.triangles.push_back({corners(0), corners(1), corners(2)});
  }
  const double size = surface_size(surface);
  if (const auto doubt = unit_doubt(size, "m")) {
    const std::string text = fmt::format("{}: {}", name, doubt->text);
    if (doubt->refuse) {
      throw InputError(text);
    }
    require_body_size(size, name);
    say({Remark::Kind::kWarning, "mesh_unit: " + text});
  }
}

/// A mesh of a file in units of so many metres, or in mm where its size leaves no doubt of that.
SkinMesh mesh_of_file(const std::string& file, const std::optional<double>& unit, Progress& progress) {
  const double size = surface_size(read_surface(file));
  const auto known = std::ranges::find(kFileUnits, unit.value_or(0), &LengthUnit::metres);
  if (!unit || known != kFileUnits.end()) {
    const auto doubt = unit_doubt(size, unit ? std::optional<std::string>(known->name) : std::nullopt);
    if (doubt && doubt->refuse) {
      throw InputError(fmt::format("{}: {}. unit=1e-3 is mm, 1e-2 is cm, 1.0 is m", file, doubt->text));
    }
    if (doubt) {
      progress.warn(fmt::format("mesh_unit: {}: {}", file, doubt->text));
    }
  }
  TriangleMesh mesh = read_mesh(file, unit.value_or(kMillimetre));
  require_body_size(size * unit.value_or(kMillimetre), file);
  return {shared(std::move(mesh))};
}

SkinMesh hand_mesh(const std::string& pose, double edge, double breadth, double length, const std::string& side,
                   double forearm) {
  if (side != "right" && side != "left") {
    throw InputError(fmt::format("hand: side = '{}' must be right or left", side));
  }
  HandOptions options;
  options.pose = pose;
  options.edge = edge;
  options.breadth = breadth;
  options.length = length;
  options.forearm = forearm;
  options.side = side == "right" ? HandSide::kRight : HandSide::kLeft;
  return computed(0, [options](Progress&) { return skin_mesh(hand(options)); });
}

void add_mesh_class(nb::module_& module) {
  const auto part = [](auto get) {
    return [get](nb::handle_t<SkinMesh> self) {
      return view(std::invoke(get, *nb::cast<const SkinMesh&>(self).mesh), self);
    };
  };
  nb::class_<SkinMesh>(module, "Mesh", "A triangulated surface with outward normals, lengths in m. Immutable.")
      .def(
          "__init__",
          [](SkinMesh* self, nb::handle vertices, nb::handle triangles) {
            TriangleMesh mesh(point_rows(vertices, "Mesh: vertices"), triangle_rows(triangles, "Mesh: triangles"));
            check_size(mesh, "Mesh: vertices in m");
            new (self) SkinMesh{shared(std::move(mesh))};
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
                   "Named points on the skin [m], if the shape has some.")
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
          "Writes STL, OBJ, PLY, OFF or VTP, according to the file ending. `unit`: the unit of the file in metres.")
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
      [](nb::handle path, std::optional<double> unit) {
        return computed(
            0, [file = path_of(path), unit](Progress& progress) { return mesh_of_file(file, unit, progress); });
      },
      nb::arg("path"), nb::arg("unit") = nb::none(),
      nb::sig("def read_mesh(path: str | os.PathLike, unit: float | None = None) -> Mesh"),
      "Reads an STL, OBJ, PLY, OFF, VTP or GLB file. `unit`: the unit of the file in metres. Without it the file must "
      "be in "
      "mm, and its size must confirm that.");
  module.def("hand", &hand_mesh, nb::arg("pose") = HandOptions{}.pose, nb::kw_only(),
             nb::arg("edge") = HandOptions{}.edge, nb::arg("breadth") = HandOptions{}.breadth,
             nb::arg("length") = HandOptions{}.length, nb::arg("side") = "right",
             nb::arg("forearm") = HandOptions{}.forearm,
             "The built-in hand in its own frame [m]: the wrist at the origin, y towards the fingertips, z out of its "
             "back. The thumb of a right hand is at negative x. `forearm` extends the skin by that length.");
  module.def(
      "sphere",
      [](double radius, double edge) {
        require_body_size(2 * radius, "sphere: radius in m");
        return skin_mesh(sphere(radius, edge));
      },
      nb::arg("radius"), nb::arg("edge"), "A sphere about the origin [m].");
}

}  // namespace touchfield::python
