#include <algorithm>

#include <fmt/format.h>

#include "sim/scene/scene_table.h"

namespace touchfield::schema {

namespace {

/// A model of the judge's own as the file has it.
struct JudgeForm {
  Scheme scheme = JudgeSpec{}.scheme;
  std::optional<EdgeSpec> edge;
  bool whole = JudgeSpec{}.whole;
  std::optional<int> splits;
};

std::optional<JudgeSpec> to_judge(const Input& /*in*/, const JudgeForm& form) {
  JudgeSpec judge;
  judge.scheme = form.scheme;
  judge.kind = form.edge ? JudgeSpec::Kind::kEdge : JudgeSpec::Kind::kSplit;
  judge.edge = form.edge.value_or(judge.edge);
  judge.whole = form.whole;
  judge.splits = form.splits.value_or(judge.splits);
  return judge;
}

JudgeForm to_form(const JudgeSpec& judge) {
  JudgeForm form{.scheme = judge.scheme, .edge = {}, .whole = judge.whole, .splits = {}};
  if (judge.kind == JudgeSpec::Kind::kEdge) {
    form.edge = judge.edge;
  } else {
    form.splits = judge.splits;
  }
  return form;
}

Codec<JudgeSpec> own_model_codec() {
  return kept_as<JudgeSpec, JudgeForm>(
      Map<JudgeForm>()
          .key("scheme", &JudgeForm::scheme, scheme_codec(), "How its boundary elements model the scattering.")
          .maybe("edge_mm", &JudgeForm::edge, edge_codec(), "1.4",
                 fmt::format("Edge length of a mesh of its own [mm], as a body's edge_mm; of a hand {}.",
                             kHandEdge.text()))
          .key("whole", &JudgeForm::whole, flag(),
               "Whether the judge has the whole bodies where keep_within_mm leaves out parts of them. Only with "
               "edge_mm.")
          .maybe("split", &JudgeForm::splits, integer(between(1, 2)), "1",
                 "Or the solving mesh with every face in four, as often as this says.")
          .exactly_one({"edge_mm", "split"})
          .codec(),
      to_judge, [](const JudgeSpec& judge) { return to_form(judge); });
}

}  // namespace

Codec<JudgeSpec> judge_codec() {
  const auto bare = kept_as<JudgeSpec, JudgeSpec::Kind>(
      choice<JudgeSpec::Kind>({{"same", JudgeSpec::Kind::kSame}, {"none", JudgeSpec::Kind::kNone}}),
      [](const Input&, JudgeSpec::Kind kind) {
        JudgeSpec judge;
        judge.kind = kind;
        return std::optional(judge);
      },
      [](const JudgeSpec& judge) { return judge.kind; });
  return plain_or_map<JudgeSpec>(bare, own_model_codec(), [](const JudgeSpec& judge) {
    return judge.kind == JudgeSpec::Kind::kSame || judge.kind == JudgeSpec::Kind::kNone;
  });
}

bool check_judge(const Input& in, const Scene& scene) {
  const Entry* entry = in.node().find("judge");
  if (!entry || entry->value.kind != Node::Kind::kMap) {
    return true;
  }
  const Input judge = in.at(*entry);
  bool good = true;
  if (scene.judge.kind == JudgeSpec::Kind::kSplit && scene.judge.whole) {
    judge.at(*judge.node().find("whole")).problem("cannot be true with split, whose mesh is the solving one");
    good = false;
  }
  if (scene.judge.kind == JudgeSpec::Kind::kEdge && !scene.bodies.empty()) {
    good = check_near(judge.at(*judge.node().find("edge_mm")), landmark_names(scene.bodies)) && good;
  }
  const bool any_hand = std::any_of(scene.bodies.begin(), scene.bodies.end(),
                                    [](const BodySpec& body) { return std::holds_alternative<HandShape>(body.shape); });
  if (scene.judge.kind == JudgeSpec::Kind::kEdge && any_hand) {
    good = check_hand_edges(judge.at(*judge.node().find("edge_mm"))) && good;
  }
  return good;
}

}  // namespace touchfield::schema
