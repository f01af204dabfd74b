#include "sim/assess/check.h"

#include <string>

#include <gmock/gmock.h>

#include "tests/support/solve_support.h"

namespace touchfield {
namespace {

using support::small_model;
using testing::ContainsRegex;
using testing::HasSubstr;

TEST(Check, ForetellsTheFacesOfTheJudge) {
  for (const char* keys : {"whole: auto", "whole: false", "whole: true"}) {
    for (const char* kept : {"11", "null"}) {
      SCOPED_TRACE(std::string(keys) + ", " + kept);
      const Model model = small_model({std::string("body.keep_within_mm=") + kept,
                                       std::string("judge={scheme: burton_miller, edge_mm: 1.5, ") + keys + "}"});
      const auto faces = static_cast<double>(build_judge_mesh(model).mesh.face_count());
      EXPECT_NEAR(static_cast<double>(check_model(model).judge_faces) / faces, 1.0, 0.2);
    }
  }
}

TEST(Check, SaysWhatTheJudgeHas) {
  const auto said = [](const std::string& judge) {
    const Model model = small_model({"body.keep_within_mm=11", "judge={scheme: burton_miller, " + judge + "}"});
    return describe_check(model, check_model(model));
  };
  EXPECT_THAT(said("edge_mm: 2"), HasSubstr("faces, of the whole body (judge.whole: auto, up to 12000)\n"));
  EXPECT_THAT(said("edge_mm: 0.3"), HasSubstr("faces, of what keep_within_mm leaves, of some 2"));
  EXPECT_THAT(said("edge_mm: 2, whole: false"), HasSubstr("faces, of what keep_within_mm leaves, of some "));
  EXPECT_THAT(said("split: 1"), ContainsRegex("judge    burton_miller on about [0-9]+ faces\n"));
}

}  // namespace
}  // namespace touchfield
