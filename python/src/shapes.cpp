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
#include "sim/core/require.h"
#include "sim/core/rigid_motion.h"
#include "sim/core/units.h"
#include "sim/mesh/io/mesh_files.h"
#include "sim/mesh/io/unit_guess.h"
#include "sim/model/bodies.h"

namespace touchfield::python {

namespace {

using LandmarksLike = Said<"dict[str, numpy.typing.ArrayLike]">;

/// Landmarks as Python gets them, each an array of three numbers.
RealArrays landmark_dict(const SkinMesh& skin) {
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
SkinMesh mesh_of_file(const std::string& file, std::optional<double> unit, Progress& progress) {
  const double size = surface_size(read_surface(file));
  if (const std::string prescribed = format_unit(file); !unit && !prescribed.empty()) {
    unit = file_unit(prescribed).metres;
  }
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
SkinMesh bodies_of_scene(const SceneLike& scene) {
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
      points[text] = three_numbers(point, fmt::format("Mesh: landmarks['{}']", text));
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
  nb::class_<SkinMesh>(module, "Mesh", nb::type_slots(kOpenInit),
                       R"(A triangulated surface with outward normals. It never changes: its methods return new meshes.

Parameters
----------
vertices : array_like, shape (V, 3)
    Positions [m].
triangles : array_like of int, shape (M, 3)
    Numbers of vertices, counter-clockwise seen from outside.
landmarks : dict of str to array_like, shape (3,), optional
    Named points near the skin [m].

Raises
------
InputError
    On a size that no body has (0.01 mm to 10 m), a face without area, a vertex that is missing.

Examples
--------
>>> mesh = tf.Mesh([[0, 0, 0], [.01, 0, 0], [0, .01, 0], [0, 0, .01]], [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
>>> len(mesh)
4
)")
      .def(
          "__init__",
          [](SkinMesh* self, const ArrayLike& vertices, const ArrayLike& triangles, const LandmarksLike& landmarks) {
            TriangleMesh mesh = mesh_of(vertices, triangles);
            check_size(mesh, "Mesh: vertices in m");
            new (self) SkinMesh{shared(std::move(mesh)), landmarks_of(landmarks)};
          },
          nb::arg("vertices"), nb::arg("triangles"), nb::arg("landmarks") = nb::none())
      .def_static("_of_scene", &bodies_of_scene, nb::arg("scene"))
      .def("__getstate__",
           [](const SkinMesh& self) {
             return nb::make_tuple(owned(self.mesh->vertices()), owned(self.mesh->triangles()), landmark_dict(self));
           })
      .def("__setstate__",
           [](SkinMesh& self, const nb::tuple& state) {
             new (&self) SkinMesh{shared(mesh_of(state[0], state[1])), landmarks_of(state[2])};
           })
      .def_prop_ro("vertices", part(&TriangleMesh::vertices), "Positions, shape (V, 3) [m].")
      .def_prop_ro("triangles", part(&TriangleMesh::triangles), "Numbers of vertices, shape (M, 3).")
      .def_prop_ro("centroids", part(&TriangleMesh::centroids), "Centres of the faces, shape (M, 3) [m].")
      .def_prop_ro("normals", part(&TriangleMesh::normals), "Outward unit normals of the faces, shape (M, 3).")
      .def_prop_ro("areas", part(&TriangleMesh::areas), "Areas of the faces, shape (M,) [m2].")
      .def_prop_ro(
          "mean_edge", [](const SkinMesh& self) { return self.mesh->mean_edge(); },
          "Side of the equilateral triangle of the mean area [m].")
      .def_prop_ro(
          "volume", [](const SkinMesh& self) { return self.mesh->signed_volume(); },
          "Enclosed volume [m3]; positive if the normals point outwards.")
      .def_prop_ro("landmarks", &landmark_dict, "Named points on the skin, each of shape (3,) [m].")
      .def(
          "save",
          [](const SkinMesh& self, const PathLike& path, double unit) {
            do_work(0, [mesh = self.mesh, file = path_of(path), unit](Progress&) { write_mesh(file, *mesh, unit); });
          },
          nb::arg("path"), nb::arg("unit") = 1e-3,
          R"(Writes STL, OBJ, PLY, OFF or VTP, according to the file ending.

Parameters
----------
path : str or os.PathLike
unit : float
    The unit of the file in metres.

Examples
--------
>>> tf.sphere(5e-3, 2e-3).save("ball.stl")
)")
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
      [](const PathLike& path, std::optional<double> unit) {
        return computed(
            0, [file = path_of(path), unit](Progress& progress) { return mesh_of_file(file, unit, progress); });
      },
      nb::arg("path"), nb::arg("unit") = nb::none(),
      R"(Reads an STL, OBJ, PLY, OFF or GLB file.

Parameters
----------
path : str or os.PathLike
unit : float, optional
    The unit of the file in metres. Default: m of GLB, else mm, which the size of the body must confirm.

Raises
------
InputError
    If the file is missing or damaged, or its unit is not certain.

Examples
--------
>>> tf.sphere(5e-3, 2e-3).save("ball.stl")
>>> ball = tf.read_mesh("ball.stl", unit=1e-3)
)");
  module.def(
      "_three",
      [](nb::handle values, const std::string& what) { return owned(Eigen::VectorXd(three_numbers(values, what))); },
      nb::arg("values").none(), nb::arg("what"), "Three numbers of the argument `what`.");
  module.def(
      "_rotation",
      [](const ArrayLike& angles) {
        return owned(Eigen::MatrixXd(extrinsic_rotation(three_numbers(angles, "rotation"))));
      },
      nb::arg("angles"), "The matrix of a rotation about the fixed x, then y, then z axis [rad].");
  module.def(
      "sphere",
      [](double radius, double edge) {
        require(radius > 0, "sphere: radius = {:g} must be > 0", radius);
        require_body_size(2 * radius, "sphere: radius in m");
        return skin_mesh(sphere(radius, edge));
      },
      nb::arg("radius"), nb::arg("edge"),
      R"(A sphere about the origin.

Parameters
----------
radius, edge : float
    Radius and wanted edge length of the mesh [m].

Examples
--------
>>> ball = tf.sphere(radius=8e-3, edge=2e-3)
)");
}

}  // namespace touchfield::python
