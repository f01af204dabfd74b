#include <algorithm>

#include <fmt/format.h>

#include "sim/scene/scene_table.h"

namespace touchfield::schema {
namespace {

/// A model of the judge's own as the file has it.
struct JudgeForm {
  Scheme scheme = JudgeSpec{}.scheme;
  std::optional<double> edge;
  std::optional<int> splits;
};

std::optional<JudgeSpec> to_judge(const Input& /*in*/, const JudgeForm& form) {
  JudgeSpec judge{.scheme = form.scheme};
  judge.kind = form.edge ? JudgeSpec::Kind::kEdge : JudgeSpec::Kind::kSplit;
  judge.edge = form.edge.value_or(judge.edge);
  judge.splits = form.splits.value_or(judge.splits);
  return judge;
}

JudgeForm to_form(const JudgeSpec& judge) {
  JudgeForm form{.scheme = judge.scheme, .edge = {}, .splits = {}};
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
          .maybe("edge_mm", &JudgeForm::edge, number(kMillimetres, above(0)), "1.4",
                 fmt::format("Edge length of a mesh of its own [mm], of a hand {}; not of a body from a file.",
                             kHandEdge.text()))
          .maybe("split", &JudgeForm::splits, integer(between(1, 2)), "1",
                 "Or the solving mesh with every face in four, as often as this says.")
          .exactly_one({"edge_mm", "split"})
          .codec(),
      to_judge, [](const JudgeSpec& judge) { return to_form(judge); });
}

}  // namespace

Codec<JudgeSpec> judge_codec() {
  const auto bare = choice<JudgeSpec::Kind>({{"same", JudgeSpec::Kind::kSame}, {"none", JudgeSpec::Kind::kNone}});
  const auto own_model = own_model_codec();
  const TypeInfo type{.kind = TypeInfo::Kind::kAny, .of = {bare.type, own_model.type}};
  return {type,
          [=](const Input& in, JudgeSpec& judge) {
            if (in.node().kind == Node::Kind::kMap) return own_model.read(in, judge);
            const auto& words = bare.type.words;
            const bool known = in.node().kind == Node::Kind::kScalar &&
                               std::find(words.begin(), words.end(), in.node().text) != words.end();
            if (known) return bare.read(in, judge.kind);
            in.must_be(phrase(type));
            return false;
          },
          [=](const JudgeSpec& judge) {
            const bool own = judge.kind == JudgeSpec::Kind::kEdge || judge.kind == JudgeSpec::Kind::kSplit;
            return own ? own_model.write(judge) : bare.write(judge.kind);
          }};
}

bool check_judge(const Input& in, const Scene& scene) {
  if (scene.judge.kind != JudgeSpec::Kind::kEdge) return true;
  const Input judge = in.at(*in.node().find("judge"));
  const Entry& edge = *judge.node().find("edge_mm");
  if (std::holds_alternative<MeshShape>(scene.body.shape)) {
    in.reading().add(edge.place,
                     "judge.edge_mm: cannot be given with body.mesh, whose faces are those of its file; "
                     "use split");
    return false;
  }
  const bool is_hand = in.node().find("body") && std::holds_alternative<HandShape>(scene.body.shape);
  return !is_hand || check_hand_edge(judge.at(edge));
}

}  // namespace touchfield::schema
