#include "sim/hand/shapes.h"

#include <algorithm>
#include <functional>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "python/src/arrays.h"
#include "python/src/job.h"
#include "python/src/parts.h"
#include "sim/core/errors.h"
#include "sim/core/rigid_motion.h"
#include "sim/core/units.h"
#include "sim/mesh/io/mesh_files.h"
#include "sim/mesh/io/unit_guess.h"
#include "sim/model/bodies.h"

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

/// The bodies of a scene in their places, without what a model asks of them.
SkinMesh bodies_of_scene(nb::handle scene) {
  return computed(0, [input = scene_input(scene)](Progress&) {
    const Scene read = input.read({});
    const BodyPlan plan = plan_bodies(read, [](const TriangleMesh& mesh) { return Vector3(mesh.vertices().col(0)); });
    return skin_mesh(build_bodies(read, plan, {}, Extent::kWhole).body);
  });
}

std::map<std::string, Vector3> landmarks_of(nb::handle landmarks) {
  std::map<std::string, Vector3> points;
  if (!landmarks.is_none()) {
    for (const auto& [name, point] : dict_of(landmarks, "landmarks")) {
      const std::string text = text_of(name, "landmarks: a name");
      const Eigen::VectorXd values = real_list(point, fmt::format("Mesh: landmarks['{}']", text));
      require_count(fmt::format("Mesh: landmarks['{}']", text), values.size(), 3, "per axis");
      points[text] = values;
    }
  }
  return points;
}

TriangleMesh mesh_of(nb::handle vertices, nb::handle triangles) {
  return {point_rows(vertices, "Mesh: vertices"), triangle_rows(triangles, "Mesh: triangles")};
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
          [](SkinMesh* self, nb::handle vertices, nb::handle triangles, nb::handle landmarks) {
            TriangleMesh mesh = mesh_of(vertices, triangles);
            check_size(mesh, "Mesh: vertices in m");
            new (self) SkinMesh{shared(std::move(mesh)), landmarks_of(landmarks)};
          },
          nb::arg("vertices"), nb::arg("triangles"), nb::arg("landmarks") = nb::none(),
          nb::sig("def __init__(self, vertices: numpy.typing.ArrayLike, triangles: numpy.typing.ArrayLike, landmarks: "
                  "dict[str, numpy.typing.ArrayLike] | None = None) -> None"))
      .def_static("of_scene", &bodies_of_scene, nb::arg("scene"),
                  nb::sig("def of_scene(scene: str | os.PathLike | tuple[str, str]) -> Mesh"),
                  "The bodies of a scene as one mesh, in their places.")
      .def(
          "__getstate__",
          [](const SkinMesh& self) {
            return nb::make_tuple(owned(self.mesh->vertices()), owned(self.mesh->triangles()), landmark_dict(self));
          },
          nb::sig("def __getstate__(self) -> tuple[typing.Any, ...]"))
      .def(
          "__setstate__",
          [](SkinMesh& self, const nb::tuple& state) {
            new (&self) SkinMesh{shared(mesh_of(state[0], state[1])), landmarks_of(state[2])};
          },
          nb::sig("def __setstate__(self, state: tuple[typing.Any, ...]) -> None"))
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
      "Reads an STL, OBJ, PLY, OFF or GLB file. `unit`: the unit of the file in metres. Without it the file must "
      "be in "
      "mm, and its size must confirm that.");
  module.def(
      "rotation",
      [](nb::handle angles) {
        const Eigen::VectorXd values = real_list(angles, "rotation: angles");
        require_count("rotation: angles", values.size(), 3, "per axis");
        return owned(Eigen::MatrixXd(extrinsic_rotation(values)));
      },
      nb::arg("angles"), nb::sig("def rotation(angles: numpy.typing.ArrayLike) -> numpy.typing.NDArray[numpy.float64]"),
      "The matrix of a rotation about the fixed x, then y, then z axis [rad].");
  module.def(
      "sphere",
      [](double radius, double edge) {
        require_body_size(2 * radius, "sphere: radius in m");
        return skin_mesh(sphere(radius, edge));
      },
      nb::arg("radius"), nb::arg("edge"), "A sphere about the origin [m].");
}

}  // namespace touchfield::python
