#include "sim/run/model.h"

#include <stdexcept>
#include <type_traits>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/rotation.h"
#include "sim/core/units.h"
#include "sim/field/evaluate.h"
#include "sim/mesh/mesh_io.h"
#include "sim/mesh/shapes.h"
#include "sim/mesh/subdivide.h"

namespace touchfield {

namespace {

constexpr double kClearance = 1.0 * kMillimetre;  // between a transducer and the skin

ArrayLayout placed_layout(const ArrayLayout& layout, const Vector3& at, const Vector3& angles) {
  return transformed(layout, extrinsic_rotation(angles), at);
}

struct LayoutBuilder {
  ArrayLayout operator()(const GridArray& grid) const { return grid_layout(grid.count[0], grid.count[1], grid.pitch); }
  ArrayLayout operator()(const Autd3Array& autd3) const {
    if (autd3.layout) {
      return autd3_tiles((*autd3.layout)[0], (*autd3.layout)[1], autd3.pitch);
    }
    std::vector<ArrayLayout> units;
    for (const Placement& unit : autd3.units) {
      units.push_back(placed_layout(autd3_unit(autd3.pitch), unit.at, unit.angles));
    }
    return joined(units);
  }
  ArrayLayout operator()(const SonicsurfaceArray&) const { return sonicsurface_layout(); }
  ArrayLayout operator()(const PositionsArray& list) const {
    const Eigen::Index n = list.points.cols();
    return {list.points, list.axes, Eigen::VectorXi::Zero(n),
            Eigen::VectorXi::LinSpaced(n, 0, static_cast<int>(n) - 1)};
  }
  ArrayLayout operator()(const PlaneWaveArray&) const { throw std::logic_error("a plane wave has no layout"); }
};

Directivity build_directivity(const ArraySpec& spec, const Wave& wave) {
  switch (spec.directivity) {
    case Directivity::Kind::kOmni:
      return Directivity::omni();
    case Directivity::Kind::kPiston:
      return Directivity::piston(wave.k(), spec.piston_radius);
    case Directivity::Kind::kT4010a1:
      return Directivity::t4010a1();
  }
  throw std::logic_error("unknown directivity");
}

TransducerArray build_array(const ArraySpec& spec, const Wave& wave) {
  if (const auto* plane = std::get_if<PlaneWaveArray>(&spec.layout)) {
    return plane_wave(extrinsic_rotation(spec.angles) * plane->direction, spec.level * plane->amplitude);
  }
  const ArrayLayout layout = placed_layout(std::visit(LayoutBuilder{}, spec.layout), spec.at, spec.angles);
  return make_array(layout, build_directivity(spec, wave), spec.level, spec.source_strength);
}

Body build_shape(const BodySpec& spec) {
  const auto make = [&](const auto& shape) -> Body {
    using Shape = std::decay_t<decltype(shape)>;
    if constexpr (std::is_same_v<Shape, HandShape>) {
      return hand({shape.pose, shape.breadth, shape.length, shape.side, spec.edge.value()});
    } else if constexpr (std::is_same_v<Shape, SphereShape>) {
      return sphere(shape.radius, spec.edge.value());
    } else if constexpr (std::is_same_v<Shape, CapsuleShape>) {
      return capsule(shape.radius, shape.length, spec.edge.value());
    } else if constexpr (std::is_same_v<Shape, BoxShape>) {
      return box(shape.size, spec.edge.value());
    } else {
      Body body{read_mesh(shape.file, shape.unit), {}};
      require_closed_surface(body.mesh, shape.file);
      for (const auto& [name, point] : shape.landmarks) {
        body.landmarks.push_back(nearest_landmark(body.mesh, name, point));
      }
      return body;
    }
  };
  return std::visit(make, spec.shape);
}

Vector3 anchor_of(const BodySpec& spec, const Body& body) {
  return spec.place.landmark.empty() ? Vector3::Zero() : position(body.mesh, find_landmark(body, spec.place.landmark));
}

std::vector<TargetBox> build_boxes(const TargetSpec& spec, const Body& body) {
  std::vector<TargetBox> boxes;
  for (const TargetBoxSpec& box : spec.boxes) {
    const Vector3 centre = box.at.empty() ? box.centre : position(body.mesh, find_landmark(body, box.at)) + box.offset;
    boxes.push_back({centre, box.size, extrinsic_rotation(box.angles)});
  }
  return boxes;
}

std::string place_of(const Vector3& x) {
  return fmt::format("({:.2f}, {:.2f}, {:.2f}) mm", x.x() / kMillimetre, x.y() / kMillimetre, x.z() / kMillimetre);
}

/// A transducer inside the body or on its skin has no pressure there that means anything.
void require_clear_array(const TransducerArray& array, const TriangleMesh& mesh) {
  if (array.kind == TransducerArray::Kind::kPlaneWave) {
    return;
  }
  Eigen::AlignedBox3d reach(mesh.vertices().rowwise().minCoeff().eval(), mesh.vertices().rowwise().maxCoeff().eval());
  reach.min().array() -= kClearance;
  reach.max().array() += kClearance;
  for (Eigen::Index n = 0; n < array.size(); ++n) {
    const Vector3 x = array.positions.col(n);
    if (!reach.contains(x)) {
      continue;
    }
    if (inside_mask(mesh, x).front() != 0) {
      throw InputError(fmt::format(
          "array: transducer {} at {} lies inside the body; move body.place.at_mm or array.at_mm", n, place_of(x)));
    }
    const Landmark nearest = nearest_landmark(mesh, "nearest", x);
    const double distance = (position(mesh, nearest) - x).norm();
    if (distance < kClearance) {
      throw InputError(
          fmt::format("array: transducer {} at {} is {:.3f} mm from face {} of the body, it must be >= {} mm away", n,
                      place_of(x), distance / kMillimetre, nearest.face, kClearance / kMillimetre));
    }
  }
}

void require_fitting_phases(const std::vector<MethodSpec>& methods, Eigen::Index channels) {
  for (const MethodSpec& method : methods) {
    const auto count = static_cast<Eigen::Index>(method.phases.size());
    if (method.kind == MethodKind::kFixed && count != 1 && count != channels) {
      throw InputError(fmt::format("solve.methods: {} has {} phases, it must have 1 or one for each of the {} channels",
                                   method.name, count, channels));
    }
  }
}

}  // namespace

Medium build_medium(const MediumSpec& spec, double frequency) {
  Medium medium = air(spec.temperature);
  medium.sound_speed = spec.sound_speed.value_or(medium.sound_speed);
  medium.density = spec.density.value_or(medium.density);
  medium.absorption = spec.absorption ? air_absorption(spec.temperature, spec.humidity, frequency) : 0.0;
  return medium;
}

Target build_target(const Scene& scene, const Model& model) {
  if (!scene.target) {
    throw std::logic_error("the scene has no target");
  }
  return build_target(scene, model, model.body.mesh);
}

Target build_target(const Scene& scene, const Model& model, const TriangleMesh& mesh) {
  return make_target(mesh, model.boxes, scene.target->profile, scene.target->pressure.value_or(1.0));
}

TriangleMesh build_judge_mesh(const Scene& scene, const Model& model) {
  switch (scene.judge.kind) {
    case JudgeSpec::Kind::kEdge: {
      BodySpec spec = scene.body;
      spec.edge = scene.judge.edge;
      // The solving mesh's own motion: a landmark of another mesh of the body lies a little elsewhere.
      TriangleMesh mesh = placed(build_shape(spec), model.anchor, spec.place.at, spec.place.angles).mesh;
      require_closed_surface(mesh, "judge");
      return mesh;
    }
    case JudgeSpec::Kind::kSplit: {
      TriangleMesh mesh = model.body.mesh;
      for (int i = 0; i < scene.judge.splits; ++i) {
        mesh = split_faces(mesh);
      }
      return mesh;
    }
    case JudgeSpec::Kind::kNone:
    case JudgeSpec::Kind::kSame:
      break;
  }
  throw std::logic_error("this judge has no mesh of its own");
}

Model build_model(const Scene& scene) {
  const Wave wave(build_medium(scene.medium, scene.frequency), scene.frequency);
  const Body shape = build_shape(scene.body);
  const Vector3 anchor = anchor_of(scene.body, shape);
  const Placement& place = scene.body.place;
  Model model{wave, build_array(scene.array, wave), placed(shape, anchor, place.at, place.angles), anchor, {}, {}, {}};
  require_closed_surface(model.body.mesh, "body");
  model.report = inspect(model.body.mesh);
  require_clear_array(model.array, model.body.mesh);
  require_fitting_phases(scene.solve.methods, model.array.size());
  if (scene.target) {
    model.boxes = build_boxes(*scene.target, model.body);
    build_target(scene, model);
  }
  for (const FieldSpec& field : scene.fields) {
    model.fields.push_back(centred_grid(field.name, field.centre, field.size, field.spacing));
  }
  return model;
}

}  // namespace touchfield
