#include <algorithm>

#include <fmt/format.h>

#include "sim/scene/scene_table.h"

namespace touchfield::schema {

namespace {

Codec<EvaluationSpec> own_model_codec() {
  return Map<EvaluationSpec>()
      .key("scheme", &EvaluationSpec::scheme, scheme_codec(), "Scheme of the evaluation mesh.")
      .maybe(
          "edge_mm", &EvaluationSpec::edge, edge_codec(), "1.4",
          fmt::format("Edge length of an evaluation mesh [mm], as edge_mm of a body; for a hand {}.", kHandEdge.text()))
      .written_if([](const EvaluationSpec& evaluation) { return evaluation.kind == EvaluationSpec::Kind::kEdge; })
      .maybe("split", &EvaluationSpec::splits, integer(between(1, 2)), "1",
             "The solving mesh, with every face split into four this many times; instead of edge_mm.")
      .exactly_one({"edge_mm", "split"})
      .check([](const Input& in, EvaluationSpec& evaluation, bool good) {
        if (good) {
          evaluation.kind = in.node().find("edge_mm") ? EvaluationSpec::Kind::kEdge : EvaluationSpec::Kind::kSplit;
        }
        return good;
      })
      .codec();
}

}  // namespace

Codec<EvaluationSpec> evaluation_codec() {
  const auto bare =
      kept_in(&EvaluationSpec::kind, choice<EvaluationSpec::Kind>({{"auto", EvaluationSpec::Kind::kAuto},
                                                                   {"same", EvaluationSpec::Kind::kSame},
                                                                   {"none", EvaluationSpec::Kind::kNone}}));
  return either<EvaluationSpec>(bare, own_model_codec(), [](const EvaluationSpec& evaluation) {
    return evaluation.kind != EvaluationSpec::Kind::kEdge && evaluation.kind != EvaluationSpec::Kind::kSplit;
  });
}

bool check_evaluation(const Input& in, const Scene& scene) {
  const Entry* entry = in.node().find("evaluation");
  if (entry && scene.evaluation.kind == EvaluationSpec::Kind::kNone && solver_mistakes_channels(scene.array)) {
    return in.at(*entry).problem(
        "none, but the solver does not know the true responses of the channels: the scene must have an evaluation");
  }
  if (!entry || entry->value.kind != Node::Kind::kMap) {
    return true;
  }
  const Input evaluation = in.at(*entry);
  bool good = true;
  if (scene.evaluation.kind == EvaluationSpec::Kind::kEdge && !scene.bodies.empty()) {
    good = check_near(evaluation.key("edge_mm"), landmark_names(scene.bodies)) && good;
  }
  const bool any_hand = std::any_of(scene.bodies.begin(), scene.bodies.end(),
                                    [](const BodySpec& body) { return std::holds_alternative<HandShape>(body.shape); });
  if (scene.evaluation.kind == EvaluationSpec::Kind::kEdge && any_hand) {
    good = check_hand_edges(evaluation.key("edge_mm")) && good;
  }
  return good;
}

}  // namespace touchfield::schema
