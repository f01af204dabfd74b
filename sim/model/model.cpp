#include "sim/model/model.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include "sim/acoustics/array_geometry.h"
#include "sim/core/errors.h"
#include "sim/core/require.h"
#include "sim/core/rigid_motion.h"
#include "sim/core/text.h"
#include "sim/core/units.h"
#include "sim/field/target.h"
#include "sim/gpu/gpu_library.h"
#include "sim/mesh/query/clearance.h"
#include "sim/mesh/query/face_tree.h"
#include "sim/mesh/remesh/mesh_quality.h"
#include "sim/mesh/topology.h"
#include "sim/model/beyond_skin.h"
#include "sim/model/clear_transducers.h"
#include "sim/model/evaluation_comparison.h"

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

/// Bodies cannot reach through the boards that carry transducers either. Listed positions have no board.
void require_clear_array(const ArraySpec& spec, const TransducerArray& array, const Posture& posture,
                         const TriangleMesh& mesh, const std::vector<int>& owner) {
  if (array.kind == TransducerArray::Kind::kPlaneWave || lies_apart(array, mesh, kLeastClearance)) {
    return;
  }
  require_clear_transducers(posture, array, mesh, owner);
  if (!std::holds_alternative<PositionsArray>(spec.layout)) {
    if (const auto hit = plate_collision(mesh, array.positions, array.device, 0.0)) {
      throw InputError(
          fmt::format("array: the body crosses the board of unit {} at {}; move body.place.at_mm or array.at_mm",
                      hit->plate, place_text(hit->at, 2)));
    }
  }
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

/// Edges per wavelength that an evaluation with edges of its own takes on the target, in the box where they are fewest.
double evaluation_resolution(const Model& model, const Target& target) {
  std::vector<EdgeSizing> sizings;
  for (std::size_t i = 0; i < model.posture.bodies.size(); ++i) {
    sizings.push_back(sizing_of(model.fixed->scene, model.plan, i, model.fixed->scene.evaluation.edge));
  }
  std::vector<double> edges(model.boxes.size(), 0.0);
  std::vector<double> counts(model.boxes.size(), 0.0);
  for (std::size_t k = 0; k < target.faces.size(); ++k) {
    const auto body = static_cast<std::size_t>(model.fixed->owner[static_cast<std::size_t>(target.faces[k])]);
    const auto box = static_cast<std::size_t>(target.box[k]);
    edges[box] +=
        sizings[body].at(model.plan.to_own(model.fixed->scene, body, model.body.mesh.centroids().col(target.faces[k])));
    counts[box] += 1;
  }
  double fewest = std::numeric_limits<double>::infinity();
  for (std::size_t b = 0; b < edges.size(); ++b) {
    fewest = counts[b] > 0 ? std::min(fewest, model.fixed->wave.wavelength() * counts[b] / edges[b]) : fewest;
  }
  return fewest;
}

/// The edges that an evaluation meshes bodies anew by. One without edge lengths of its own takes the bodies', none
/// longer than what counts once its faces are split.
BodyEdges evaluation_edges(const Scene& scene, const Wave& wave) {
  if (scene.evaluation.kind == EvaluationSpec::Kind::kEdge) {
    return {&scene.evaluation.edge};
  }
  const int splits = scene.evaluation.kind == EvaluationSpec::Kind::kSplit ? scene.evaluation.splits : 0;
  return {nullptr, std::ldexp(kCoarsestEvaluation * wave.wavelength(), splits)};
}

/// The evaluation of a scene that says nothing of one: the solving model where it has all that counts, finely enough;
/// else whole bodies, with edges that are a fifth shorter near the target.
EvaluationSpec usual_evaluation(const Scene& scene, const Wave& wave) {
  constexpr double kFinerNear = 0.8;
  const double coarsest = kCoarsestEvaluation * wave.wavelength();
  EvaluationSpec evaluation;
  evaluation.kind = EvaluationSpec::Kind::kSame;
  const auto is_coarse = [&](const BodySpec& body) { return body.edge && body.edge->far > coarsest; };
  const bool all_meshed = std::ranges::all_of(scene.bodies, [](const BodySpec& body) { return body.edge.has_value(); });
  if (!scene.target || !all_meshed ||
      std::ranges::none_of(scene.bodies, [&](const BodySpec& body) { return body.keep_within || is_coarse(body); })) {
    return evaluation;
  }
  evaluation.kind = EvaluationSpec::Kind::kEdge;
  evaluation.edge.far = coarsest;
  evaluation.edge.within = 0.0;
  double near = std::numeric_limits<double>::infinity();
  for (const BodySpec& body : scene.bodies) {
    near = std::min(near, body.edge->near_target.value_or(body.edge->near.empty() ? body.edge->far : near));
    for (const auto& [landmark, length] : body.edge->near) {
      evaluation.edge.near[landmark] = kFinerNear * length;
    }
    evaluation.edge.within = std::max(evaluation.edge.within, body.edge->within);
  }
  if (std::isfinite(near)) {
    evaluation.edge.near_target = std::min(kFinerNear * near, coarsest);
  }
  return evaluation;
}

/// About how many faces an evaluation has of the whole bodies; 0 if nothing is cut or it has no mesh.
double faces_of_whole(const Model& model, const std::vector<PlacedBodies::Whole>& whole) {
  constexpr double kMostForetold = 1e7;
  const Scene& scene = model.fixed->scene;
  if (whole.empty() || scene.evaluation.kind == EvaluationSpec::Kind::kNone) {
    return 0.0;
  }
  const BodyEdges edges = evaluation_edges(scene, model.fixed->wave);
  const auto faces_of = [&](const TriangleMesh& mesh, std::size_t body) {
    std::optional<EdgeSpec> edge = edges.edge != nullptr ? *edges.edge : scene.bodies[body].edge;
    if (!edge) {
      return static_cast<double>(mesh.face_count());
    }
    edge->far = std::min(edge->far, edges.coarsest);
    return wanted_faces({model.plan.own_frame(scene, body)(mesh.vertices()), mesh.triangles()},
                        sizing_of(scene, model.plan, body, *edge), kMostForetold);
  };
  double faces = 0.0;
  for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
    const auto body = static_cast<int>(i);
    const auto cut = std::ranges::find(whole, body, &PlacedBodies::Whole::owner);
    if (cut != whole.end()) {
      faces += faces_of(cut->mesh, i);
    } else {
      const Triangles own = faces_where(model.body.mesh.triangles(), [&](Eigen::Index f) {
        return model.fixed->owner[static_cast<std::size_t>(f)] == body;
      });
      faces += faces_of({model.body.mesh.vertices(), own}, i);
    }
  }
  return scene.evaluation.kind == EvaluationSpec::Kind::kSplit ? faces * std::pow(4.0, scene.evaluation.splits) : faces;
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
  const double evaluated = model.fixed->scene.evaluation.kind == EvaluationSpec::Kind::kEdge
                               ? evaluation_resolution(model, target)
                               : std::numeric_limits<double>::infinity();
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

}  // namespace

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

std::vector<TargetBox> build_boxes(const TargetSpec& spec, const Model& model) {
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
    skin.emplace(body.mesh);
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
  return make_target(mesh, model.boxes, target.profile, target.pressure.value_or(1.0));
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

bool evaluated_elsewhere(const Model& model) {
  const EvaluationSpec::Kind kind = model.fixed->scene.evaluation.kind;
  return kind == EvaluationSpec::Kind::kSplit || evaluates_own_bodies(model) ||
         (kind == EvaluationSpec::Kind::kSame &&
          (model.fixed->scene.sensing || solver_mistakes_channels(model.fixed->scene.array)));
}

bool evaluates_own_bodies(const Model& model) {
  const EvaluationSpec::Kind kind = model.fixed->scene.evaluation.kind;
  return kind == EvaluationSpec::Kind::kEdge || (kind != EvaluationSpec::Kind::kNone && !model.beyond.empty());
}

SkinExtent solved_extent(const Model& model) {
  return model.fixed->cut.empty() ? SkinExtent::kWhole : SkinExtent::kPart;
}

Scheme evaluation_scheme(const Scene& scene) {
  return scene.evaluation.kind == EvaluationSpec::Kind::kSame ? scene.solve.scheme : scene.evaluation.scheme;
}

EvaluationMesh build_evaluation_mesh(const Model& model, KeptBodies* kept) {
  const Scene& scene = model.fixed->scene;
  const int splits = scene.evaluation.kind == EvaluationSpec::Kind::kSplit ? scene.evaluation.splits : 0;
  const auto split = [splits](TriangleMesh mesh) {
    for (int i = 0; i < splits; ++i) {
      mesh = split_faces(mesh);
    }
    return mesh;
  };
  if (evaluates_own_bodies(model)) {
    PlacedBodies bodies =
        build_bodies(scene, model.plan, evaluation_edges(scene, model.fixed->wave), Extent::kWhole, kept);
    require_closed_surface(bodies.body.mesh, "evaluation");
    if (splits == 0) {
      return {std::move(bodies.body.mesh), std::nullopt, std::move(bodies.owner)};
    }
    return {split(std::move(bodies.body.mesh)), std::nullopt};
  }
  if (evaluated_elsewhere(model)) {
    return {split(model.truth ? *model.truth : model.body.mesh), splits};
  }
  throw std::logic_error("this evaluation has no mesh of its own");
}

Model build_model(const Scene& scene, KeptBodies* kept, double per_drive) {
  if (kept == nullptr) {
    KeptBodies own;  // a file that is resurfaced is needed several times
    return build_model(scene, &own, per_drive);
  }
  if (scene.solve.solver.device.kind == ComputeDevice::Kind::kCuda) {
    require_card(scene.solve.solver.device);
  }
  const Wave wave(build_medium(scene.medium, scene.frequency), scene.frequency);
  TransducerArray array = build_array(scene.array, wave);
  ChannelResponses responses = channel_responses(scene.array);
  array.response = std::move(responses.solver);
  const auto near_array = [&](const TriangleMesh& mesh) { return nearest_to_array(array, mesh); };
  BodyPlan plan = plan_bodies(scene, near_array, kept);
  require_clear_places(scene, plan, array, kept);
  PlacedBodies bodies = build_bodies(scene, plan, {}, Extent::kSolved, kept);
  BeyondSkin beyond = beyond_skin(scene, bodies, array, wave.wavelength(), per_drive);
  require_closed_surface(bodies.body.mesh, "body");
  require_clear_array(scene.array, array, scene, bodies.body.mesh, bodies.owner);
  bodies.body.landmarks.push_back(nearest_landmark(bodies.body.mesh, kNearestToArray, near_array(bodies.body.mesh)));
  const RigidMotion own_frame = plan.own_frame(scene, 0);
  const auto fixed = std::make_shared<FixedModel>(FixedModel{scene,
                                                             wave,
                                                             std::move(array),
                                                             std::nullopt,
                                                             std::move(bodies.owner),
                                                             std::move(bodies.skin),
                                                             {},
                                                             beyond.shadowed,
                                                             0.0,
                                                             {},
                                                             {}});
  Model model{fixed, scene, std::move(plan), own_frame, std::move(bodies.body), std::move(beyond.patches), {}};
  if (scene.evaluation.kind == EvaluationSpec::Kind::kAuto) {
    fixed->scene.evaluation = usual_evaluation(scene, wave);
  }
  for (const PlacedBodies::Whole& whole : bodies.whole) {
    fixed->cut.push_back(whole.owner);
  }
  fixed->whole_faces = faces_of_whole(model, bodies.whole);
  if (solver_mistakes_channels(scene.array)) {
    fixed->array_truth = {std::move(responses.truth), scene.array.phase_levels.value_or(0)};
  }
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
