#include "sim/model/model.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include "sim/acoustics/array_geometry.h"
#include "sim/core/errors.h"
#include "sim/core/require.h"
#include "sim/core/rigid_motion.h"
#include "sim/core/text.h"
#include "sim/core/units.h"
#include "sim/field/metrics.h"
#include "sim/gpu/gpu_library.h"
#include "sim/mesh/query/clearance.h"
#include "sim/mesh/query/face_tree.h"
#include "sim/mesh/remesh/mesh_quality.h"
#include "sim/mesh/topology.h"
#include "sim/model/clear_transducers.h"

namespace touchfield {

namespace {

constexpr double kGoodResolution = 3.0;  // edges per wavelength

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

/// Where a layout comes from in the scene, and what to look at there if nobody can have built it.
struct LayoutAdvice {
  using Texts = std::pair<const char*, const char*>;
  Texts operator()(const GridArray& /*grid*/) const { return {"array.grid", "is pitch_mm in mm?"}; }
  Texts operator()(const Autd3Array& /*autd3*/) const {
    return {"array.autd3", "do units overlap, and are at_mm and pitch_mm in mm?"};
  }
  Texts operator()(const PositionsArray& /*list*/) const {
    return {"array.positions", "are the positions in mm? The header of a file says what they are in: x_m,y_m,z_m"};
  }
  Texts operator()(const auto& /*other*/) const { return {"array", "are its lengths in mm?"}; }
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

/// The point of a surface that is nearest to a transducer, or that a plane wave meets first.
Vector3 nearest_to_array(const TransducerArray& array, const TriangleMesh& mesh) {
  if (array.kind == TransducerArray::Kind::kPlaneWave) {
    Eigen::Index first = 0;
    (array.axes.col(0).transpose() * mesh.vertices()).minCoeff(&first);
    return mesh.vertices().col(first);
  }
  const FaceTree tree(mesh);
  SkinPoint nearest{-1, Vector3::Zero(), std::numeric_limits<double>::infinity()};
  for (Eigen::Index n = 0; n < array.size(); ++n) {
    const SkinPoint point = tree.nearest(array.positions.col(n), nearest.distance);
    if (point.face >= 0 && point.distance < nearest.distance) {
      nearest = point;
    }
  }
  return nearest.at;
}

/// A target reaches no cap: there is no skin to press on.
void require_skin(const Target& target, const Model& model) {
  const auto caps = std::count_if(target.faces.begin(), target.faces.end(),
                                  [&](Eigen::Index f) { return model.fixed->skin[static_cast<std::size_t>(f)] == 0; });
  if (caps > 0) {
    throw InputError(
        fmt::format("body.keep_within_mm: {} of the target's {} faces are beyond 0.9 of it from the target's centre, "
                    "where the body is cut; make it larger",
                    caps, target.size()));
  }
}

/// M: 1 on faces near a box. About the box and not about its faces, which takes no search: this comes before a mesh may
/// prove too large for the memory.
std::vector<unsigned char> faces_about(const TargetBox& box, const TriangleMesh& mesh) {
  std::vector<unsigned char> near(static_cast<std::size_t>(mesh.face_count()), 0);
  for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
    const Vector3 from = (box.rotation.transpose() * (mesh.centroids().col(f) - box.centre)).cwiseAbs();
    near[static_cast<std::size_t>(f)] = (from - 0.5 * box.size).cwiseMax(0.0).norm() < kTargetReach ? 1 : 0;
  }
  return near;
}

/// Too few edges per wavelength near the target make noise of the pressure there, by the solver's mesh or the
/// evaluation's.
void require_fine_mesh(const Model& model, const Target& target) {
  const Scene& scene = model.fixed->scene;
  if (scene.solve.allow_coarse_mesh) {
    return;
  }
  const double wavelength = model.fixed->wave.wavelength();
  const TriangleMesh& mesh = model.body.mesh;
  double own = std::numeric_limits<double>::infinity();
  for (const TargetBox& box : model.boxes) {
    if (const auto near = resolution_where(mesh, wavelength, faces_about(box, mesh))) {
      own = std::min(own, near->mean);
    }
  }
  const double evaluated = model.fixed->evaluation.resolution(model, target);
  if (std::min(own, evaluated) < kFewestSolved) {
    const BodySpec& pressed =
        scene.bodies[static_cast<std::size_t>(model.fixed->owner[static_cast<std::size_t>(target.faces[0])])];
    const auto* shape = std::get_if<MeshShape>(&pressed.shape);
    const std::string own_key = called(pressed) + (shape != nullptr && shape->series ? ".meshes" : ".edge_mm");
    throw InputError(fmt::format(
        "{}: {:.2f} edges per wavelength within {:.0f} mm of the target are too few: below {} pressures are "
        "meaningless. Use edges of {:.2g} mm or less there. solve.allow_coarse_mesh: true computes them anyway",
        own < kFewestSolved ? own_key : "evaluation.edge_mm", own < kFewestSolved ? own : evaluated,
        kTargetReach / kMillimetre, kFewestSolved, wavelength / kGoodResolution / kMillimetre));
  }
}

constexpr double kPiece = 0.25;    // longest edge of what patches are chosen from [wavelengths]
constexpr double kApart = 0.9;     // of patches [wavelengths]
constexpr double kPerDrive = 2.0;  // patches; 1.2 cost 1.4 points of error on a hand with its arm

/// The faces of a body that are solved as its skin; none if it lies beyond as a whole.
Triangles solved_skin(const PlacedBodies& bodies, int body) {
  return faces_where(bodies.body.mesh.triangles(), [&](Eigen::Index f) {
    const auto face = static_cast<std::size_t>(f);
    return bodies.skin[face] != 0 && bodies.owner[face] == body;
  });
}

/// The pieces that no skin of the solving mesh covers.
SkinPatches uncovered(const SkinPatches& pieces, const PlacedBodies& bodies, int body) {
  constexpr double kOnSkin = 0.1 * kMillimetre;
  const Triangles skin = solved_skin(bodies, body);
  if (skin.cols() == 0) {
    return pieces;
  }
  const FaceTree tree(TriangleMesh(bodies.body.mesh.vertices(), skin));
  const Points centres = pieces.centres();
  std::vector<unsigned char> covered(static_cast<std::size_t>(pieces.size()));
#pragma omp parallel for schedule(dynamic, 256)
  for (Eigen::Index j = 0; j < pieces.size(); ++j) {
    covered[static_cast<std::size_t>(j)] = tree.nearest(centres.col(j), kOnSkin).face >= 0 ? 1 : 0;
  }
  return picked(pieces, [&](Eigen::Index j) { return covered[static_cast<std::size_t>(j)] == 0; });
}

/// A body that may stand in the way of sound.
class Obstacle {
 public:
  explicit Obstacle(const TriangleMesh& mesh)
      : tree_(mesh), low_(mesh.vertices().rowwise().minCoeff()), high_(mesh.vertices().rowwise().maxCoeff()) {}

  /// Whether the way between two points goes through it, where that takes more than 3 mm.
  bool hides(const Vector3& from, const Vector3& to) const {
    constexpr double kStep = 3.0 * kMillimetre;
    const auto steps = static_cast<int>(std::ceil((to - from).norm() / kStep));
    for (int i = 1; i < steps; ++i) {
      const Vector3 x = from + static_cast<double>(i) / steps * (to - from);
      if ((x.array() > low_.array()).all() && (x.array() < high_.array()).all() && tree_.winding_number(x) > 0.5) {
        return true;
      }
    }
    return false;
  }

 private:
  FaceTree tree_;
  Vector3 low_;
  Vector3 high_;
};

/// Share by area of the patches that bodies other than their own hide from more than half of the array.
double shadowed_share(const Scene& scene, const PlacedBodies& bodies, const TransducerArray& array,
                      const SkinPatches& patches) {
  constexpr Eigen::Index kWays = 15;  // of channels, from one patch
  if (scene.bodies.size() == 1 || array.kind != TransducerArray::Kind::kTransducers) {
    return 0.0;
  }
  std::map<int, Obstacle> obstacles;
  for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
    const auto body = static_cast<int>(i);
    const auto whole = std::ranges::find(bodies.whole, body, &PlacedBodies::Whole::owner);
    obstacles.emplace(body, whole != bodies.whole.end()
                                ? Obstacle(whole->mesh)
                                : Obstacle({bodies.body.mesh.vertices(), solved_skin(bodies, body)}));
  }
  const Points centres = patches.centres();
  double hidden_area = 0.0;
  for (Eigen::Index j = 0; j < patches.size(); ++j) {
    Eigen::Index hidden = 0;
    for (Eigen::Index way = 0; way < kWays; ++way) {
      const Vector3 from = array.positions.col((2 * way + 1) * array.size() / (2 * kWays));
      hidden += std::ranges::any_of(obstacles, [&](const auto& obstacle) {
        return obstacle.first != patches.owner[static_cast<std::size_t>(j)] &&
               obstacle.second.hides(from, centres.col(j));
      });
    }
    hidden_area += 2 * hidden > kWays ? patches.areas(j) : 0.0;
  }
  return hidden_area / patches.areas.sum();
}

}  // namespace

BeyondSkin beyond_skin(const Scene& scene, const PlacedBodies& bodies, const TransducerArray& array, double wavelength,
                       std::optional<Eigen::Index> count) {
  SkinPatches pieces;
  for (const auto& [body, mesh] : bodies.whole) {
    append(uncovered(pieces_of(mesh, kPiece * wavelength, body), bodies, body), pieces);
  }
  if (pieces.empty()) {
    return {};
  }
  const double drives = expected_drives(pieces.centres(), pieces.normals(), pieces.areas, array, wavelength);
  BeyondSkin beyond{
      count ? spread(pieces, std::numeric_limits<double>::infinity(), *count)
            : spread(pieces, kApart * wavelength, static_cast<Eigen::Index>(std::ceil(kPerDrive * drives)))};
  beyond.shadowed = shadowed_share(scene, bodies, array, beyond.patches);
  return beyond;
}

bool presses(const Model& model, const TriangleMesh& mesh) {
  return model.posture.target && model.posture.target->pressure != 0.0 && hold_faces(mesh, model.boxes);
}
bool presses(const Model& model) { return presses(model, model.body.mesh); }

void require_clear(const Model& model) {
  require_clear_array(model.fixed->scene.array, model.fixed->array, model.posture, model.body.mesh, model.fixed->owner);
  if (model.posture.bodies.size() > 1) {
    require_apart(model.posture, model.body.mesh, model.fixed->owner);
  }
  if (presses(model)) {
    require_skin(build_target(model), model);
  }
}

std::vector<TargetBox> build_boxes(const TargetSpec& spec, const Model& model, double reach) {
  const Body& body = model.body;
  const auto place = [&](const TargetPlace& given) -> Vector3 {
    return given.at.empty() ? given.centre : position(body.mesh, find_landmark(body, given.at)) + given.offset;
  };
  std::vector<TargetBox> boxes;
  for (std::size_t i = 0; i < spec.boxes.size(); ++i) {
    const TargetBoxSpec& box = spec.boxes[i];
    boxes.push_back({place(box), box.size, extrinsic_rotation(box.angles), TargetShape::kBox, box.level,
                     spec.boxes.size() == 1 ? "target.box" : fmt::format("target.boxes[{}]", i)});
  }
  std::optional<SkinStrokes> skin;
  if (!spec.points.empty() || !spec.lines.empty()) {
    skin.emplace(body.mesh, reach);
  }
  for (std::size_t i = 0; i < spec.points.size(); ++i) {
    const TargetPointSpec& point = spec.points[i];
    boxes.push_back(skin->disc(place(point), point.diameter, point.level, fmt::format("target.points[{}]", i)));
  }
  for (std::size_t i = 0; i < spec.lines.size(); ++i) {
    const TargetLineSpec& line = spec.lines[i];
    std::vector<Vector3> points;
    std::ranges::transform(line.points, std::back_inserter(points), place);
    std::ranges::move(skin->strip(points, line.width, line.level, fmt::format("target.lines[{}]", i)),
                      std::back_inserter(boxes));
  }
  if (model.plan.mask) {
    const Eigen::Matrix3d to_world = model.own_frame.rotation.transpose();
    boxes.push_back(*model.plan.mask);
    boxes.back().centre = to_world * (boxes.back().centre - model.own_frame.shift);
    boxes.back().rotation = to_world * boxes.back().rotation;
  }
  return boxes;
}

TransducerArray build_array(const ArraySpec& spec, const Wave& wave) {
  if (const auto* plane = std::get_if<PlaneWaveArray>(&spec.layout)) {
    return plane_wave(extrinsic_rotation(spec.angles) * plane->direction, spec.level * plane->amplitude);
  }
  const ArrayLayout layout = placed_layout(std::visit(LayoutBuilder{}, spec.layout), spec.at, spec.angles);
  TransducerArray array = make_array(layout, build_directivity(spec, wave), spec.level, spec.source_strength);
  const auto [field, advice] = std::visit(LayoutAdvice{}, spec.layout);
  require_real_array(array, wave.wavelength(), field, advice);
  return array;
}

Medium build_medium(const MediumSpec& spec, double frequency) {
  Medium medium = air(spec.temperature);
  medium.sound_speed = spec.sound_speed.value_or(medium.sound_speed);
  medium.density = spec.density.value_or(medium.density);
  medium.absorption = spec.absorption ? air_absorption(spec.temperature, spec.humidity, frequency) : 0.0;
  return medium;
}

Target build_target(const Model& model) {
  if (!model.posture.target) {
    throw std::logic_error("the scene has no target");
  }
  return build_target(model, model.body.mesh);
}

Target build_target(const Model& model, const TriangleMesh& mesh) {
  const TargetSpec& target = *model.posture.target;
  return make_target(mesh, model.boxes, target.profile, wanted_pressure(model), target.quantity);
}

double wanted_pressure(const Model& model) {
  const TargetSpec& target = *model.posture.target;
  const double pressure = target.pressure.value_or(1.0);
  return target.quantity == TargetQuantity::kRadiation
             ? std::sqrt(pressure / radiation_per_square(model.fixed->wave.medium()))
             : pressure;
}

OutsideSkin outside_skin(const Model& model) {
  OutsideSkin outside;
  if (model.beyond.empty()) {
    return outside;
  }
  outside.faces.setOnes(model.body.mesh.face_count());
  for (Eigen::Index f = 0; f < outside.faces.size(); ++f) {
    outside.faces(f) = model.fixed->skin[static_cast<std::size_t>(f)];
  }
  outside.beyond = model.beyond;
  outside.array = model.fixed->array;
  return outside;
}

Model build_model(const Scene& scene, KeptBodies* kept) {
  if (kept == nullptr) {
    KeptBodies own;  // a file that is resurfaced is needed several times
    return build_model(scene, &own);
  }
  if (scene.solve.solver.device.kind == ComputeDevice::Kind::kCuda) {
    require_card(scene.solve.solver.device);
  }
  const Wave wave(build_medium(scene.medium, scene.frequency), scene.frequency);
  TransducerArray array = build_array(scene.array, wave);
  array.response = channel_responses(scene.array).solver;
  const auto near_array = [&](const TriangleMesh& mesh) { return nearest_to_array(array, mesh); };
  BodyPlan plan = plan_bodies(scene, near_array, kept);
  require_clear_places(scene, plan, array, kept);
  PlacedBodies bodies = build_bodies(scene, plan, {}, Extent::kSolved, kept);
  BeyondSkin beyond = beyond_skin(scene, bodies, array, wave.wavelength());
  require_closed_surface(bodies.body.mesh, "body");
  require_clear_array(scene.array, array, scene, bodies.body.mesh, bodies.owner);
  bodies.body.landmarks.push_back(nearest_landmark(bodies.body.mesh, kNearestToArray, near_array(bodies.body.mesh)));
  const RigidMotion own_frame = plan.own_frame(scene, 0);
  const auto fixed = std::make_shared<FixedModel>(FixedModel{.scene = scene,
                                                             .wave = wave,
                                                             .array = std::move(array),
                                                             .owner = std::move(bodies.owner),
                                                             .skin = std::move(bodies.skin),
                                                             .shadowed = beyond.shadowed});
  Model model{fixed, scene, std::move(plan), own_frame, std::move(bodies.body), std::move(beyond.patches), {}};
  for (const PlacedBodies::Whole& whole : bodies.whole) {
    fixed->cut.push_back(whole.owner);
  }
  fixed->evaluation = build_evaluation(fixed->scene, model, bodies.whole);
  if (scene.target) {
    model.boxes = build_boxes(*scene.target, model);  // where the skin is, not where it is seen
  }
  if (scene.sensing) {
    model.truth = model.body.mesh;
    model.body.mesh = perturbed(*model.truth, *scene.sensing).mesh;
    if (!model.beyond.empty()) {
      model.beyond = perturbed(std::move(model.beyond), *scene.sensing);
    }
    require_clear_array(scene.array, fixed->array, scene, model.body.mesh, fixed->owner);
  }
  fixed->report = inspect(model.body.mesh);
  if (scene.target) {
    const Target target = build_target(model);
    require_skin(target, model);
    require_fine_mesh(model, target);
  }
  for (const FieldSpec& field : scene.fields) {
    fixed->fields.push_back(centred_grid(field.name, field.centre, field.size, field.spacing));
  }
  require_clear_points(fixed->fields, fixed->array, model.body.mesh);
  for (const PlacedBodies::Whole& whole : bodies.whole) {
    require_clear_points(fixed->fields, fixed->array, whole.mesh);
  }
  return model;
}

}  // namespace touchfield
