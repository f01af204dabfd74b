#include <algorithm>

#include <fmt/format.h>

#include "sim/scene/scene_table.h"

namespace touchfield::schema {

namespace {

Codec<JudgeSpec> own_model_codec() {
  return Map<JudgeSpec>()
      .key("scheme", &JudgeSpec::scheme, scheme_codec(), "Scheme of the evaluation mesh.")
      .maybe(
          "edge_mm", &JudgeSpec::edge, edge_codec(), "1.4",
          fmt::format("Edge length of an evaluation mesh [mm], as edge_mm of a body; for a hand {}.", kHandEdge.text()))
      .written_if([](const JudgeSpec& judge) { return judge.kind == JudgeSpec::Kind::kEdge; })
      .maybe("split", &JudgeSpec::splits, integer(between(1, 2)), "1",
             "The solving mesh, with every face split into four this many times; instead of edge_mm.")
      .exactly_one({"edge_mm", "split"})
      .check([](const Input& in, JudgeSpec& judge, bool good) {
        if (good) {
          judge.kind = in.node().find("edge_mm") ? JudgeSpec::Kind::kEdge : JudgeSpec::Kind::kSplit;
        }
        return good;
      })
      .codec();
}

}  // namespace

Codec<JudgeSpec> judge_codec() {
  const auto bare = kept_in(&JudgeSpec::kind, choice<JudgeSpec::Kind>({{"auto", JudgeSpec::Kind::kAuto},
                                                                       {"same", JudgeSpec::Kind::kSame},
                                                                       {"none", JudgeSpec::Kind::kNone}}));
  return either<JudgeSpec>(bare, own_model_codec(), [](const JudgeSpec& judge) {
    return judge.kind != JudgeSpec::Kind::kEdge && judge.kind != JudgeSpec::Kind::kSplit;
  });
}

bool check_judge(const Input& in, const Scene& scene) {
  const Entry* entry = in.node().find("judge");
  if (entry && scene.judge.kind == JudgeSpec::Kind::kNone && solver_mistakes_channels(scene.array)) {
    return in.at(*entry).problem(
        "none, but the solver does not know the true responses of the channels: the scene must have a judge");
  }
  if (!entry || entry->value.kind != Node::Kind::kMap) {
    return true;
  }
  const Input judge = in.at(*entry);
  bool good = true;
  if (scene.judge.kind == JudgeSpec::Kind::kEdge && !scene.bodies.empty()) {
    good = check_near(judge.key("edge_mm"), landmark_names(scene.bodies)) && good;
  }
  const bool any_hand = std::any_of(scene.bodies.begin(), scene.bodies.end(),
                                    [](const BodySpec& body) { return std::holds_alternative<HandShape>(body.shape); });
  if (scene.judge.kind == JudgeSpec::Kind::kEdge && any_hand) {
    good = check_hand_edges(judge.key("edge_mm")) && good;
  }
  return good;
}

}  // namespace touchfield::schema
