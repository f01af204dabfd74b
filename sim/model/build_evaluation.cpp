#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

#include "sim/mesh/remesh/mesh_quality.h"
#include "sim/mesh/topology.h"
#include "sim/model/model.h"

namespace touchfield {

namespace {

/// The edges that bodies are meshed again by.
BodyEdges edges_of(const Evaluation& evaluation, const Wave& wave) {
  if (evaluation.edge) {
    return {&*evaluation.edge};
  }
  return {nullptr, std::ldexp(kCoarsestEvaluation * wave.wavelength(), evaluation.splits)};
}

/// What `auto` stands for.
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

/// About how many faces an evaluation has of the whole bodies.
double faces_of_whole(const Evaluation& evaluation, const Model& model, const std::vector<PlacedBodies::Whole>& whole) {
  constexpr double kMostForetold = 1e7;
  const Scene& scene = model.fixed->scene;
  const BodyEdges edges = edges_of(evaluation, model.fixed->wave);
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
  return faces * std::pow(4.0, evaluation.splits);
}

/// Faces of a mesh by the evaluation's edge lengths: the areas of the model's faces over those asked for in their
/// places.
double faces_by_edge(const Model& model, const EdgeSpec& edge_spec) {
  const Scene& scene = model.fixed->scene;
  double faces = 0.0;
  for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
    const EdgeSizing sizing = sizing_of(scene, model.plan, i, edge_spec);
    for (Eigen::Index f = 0; f < model.body.mesh.face_count(); ++f) {
      if (model.fixed->owner[static_cast<std::size_t>(f)] == static_cast<int>(i)) {
        const double edge = sizing.at(model.plan.to_own(scene, i, model.body.mesh.centroids().col(f)));
        faces += model.body.mesh.areas()(f) / (std::sqrt(3.0) / 4.0 * edge * edge);
      }
    }
  }
  return faces;
}

}  // namespace

std::string to_string(Evaluation::Kind kind) {
  constexpr std::array kNames = {"none", "same", "truth", "edge", "split"};
  return kNames[static_cast<std::size_t>(kind)];
}

Evaluation build_evaluation(Scene& scene, const Model& model, const std::vector<PlacedBodies::Whole>& whole) {
  using Asked = EvaluationSpec::Kind;
  EvaluationSpec& spec = scene.evaluation;
  if (spec.kind == Asked::kAuto) {
    spec = usual_evaluation(scene, model.fixed->wave);
  }
  Evaluation evaluation{.scheme = spec.kind == Asked::kSame ? scene.solve.scheme : spec.scheme,
                        .channels = {model.fixed->array.response, 0},
                        .other_channels = solver_mistakes_channels(scene.array)};
  if (evaluation.other_channels) {
    evaluation.channels = {channel_responses(scene.array).truth, scene.array.phase_levels.value_or(0)};
  }
  if (spec.kind == Asked::kNone) {
    return evaluation;
  }
  if (spec.kind == Asked::kEdge) {
    evaluation.edge = spec.edge;
  } else if (spec.kind == Asked::kSplit) {
    evaluation.splits = spec.splits;
  }
  const bool is_truth = scene.sensing || evaluation.other_channels;
  evaluation.kind = evaluation.edge || !model.beyond.empty() ? Evaluation::Kind::kEdge
                    : evaluation.splits > 0                  ? Evaluation::Kind::kSplit
                    : is_truth                               ? Evaluation::Kind::kTruth
                                                             : Evaluation::Kind::kSame;
  if (!whole.empty()) {
    evaluation.whole_faces = faces_of_whole(evaluation, model, whole);
  }
  return evaluation;
}

double Evaluation::faces(const Model& model) const {
  const auto own = static_cast<double>(model.body.mesh.face_count());
  if (whole_faces > 0) {
    return whole_faces;
  }
  if (edge) {
    return faces_by_edge(model, *edge);
  }
  return kind == Kind::kSplit || (kind == Kind::kTruth && model.truth) ? own * std::pow(4.0, splits) : 0.0;
}

double Evaluation::resolution(const Model& model, const Target& target) const {
  if (!edge) {
    return std::numeric_limits<double>::infinity();
  }
  std::vector<EdgeSizing> sizings;
  for (std::size_t i = 0; i < model.posture.bodies.size(); ++i) {
    sizings.push_back(sizing_of(model.fixed->scene, model.plan, i, *edge));
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

EvaluationMesh Evaluation::mesh(const Model& model, KeptBodies* kept) const {
  if (kind == Kind::kNone) {
    throw std::logic_error("there is no evaluation");
  }
  const auto whole_bodies = [&]() -> EvaluationMesh {
    PlacedBodies bodies =
        build_bodies(model.fixed->scene, model.plan, edges_of(*this, model.fixed->wave), Extent::kWhole, kept);
    require_closed_surface(bodies.body.mesh, "evaluation");
    return {std::move(bodies.body.mesh), std::nullopt, std::move(bodies.owner)};
  };
  EvaluationMesh made = kind == Kind::kEdge
                            ? whole_bodies()
                            : EvaluationMesh{model.truth ? *model.truth : model.body.mesh, splits, model.fixed->owner};
  for (int i = 0; i < splits; ++i) {
    made.mesh = split_faces(made.mesh);
    made.owner.clear();
  }
  return made;
}

}  // namespace touchfield
