#include "sim/assess/check.h"

#include <string>

#include <gmock/gmock.h>

#include "tests/support/solve_support.h"

namespace touchfield {
namespace {

using support::small_model;
using testing::HasSubstr;

TEST(Check, ForetellsTheFacesOfTheJudge) {
  for (const char* judge : {"same", "{split: 1}", "{edge_mm: 1.5}", "{edge_mm: 1.5, whole: auto}"}) {
    for (const char* beyond : {"incident", "nothing"}) {
      SCOPED_TRACE(std::string(judge) + ", " + beyond);
      const Model model =
          small_model({"body.keep_within_mm=11", std::string("body.beyond=") + beyond, std::string("judge=") + judge});
      if (!judged_elsewhere(model)) {
        EXPECT_EQ(check_model(model).judge_faces, 0);
        continue;
      }
      const auto faces = static_cast<double>(build_judge_mesh(model).mesh.face_count());
      EXPECT_NEAR(static_cast<double>(check_model(model).judge_faces) / faces, 1.0, 0.2);
    }
  }
}

TEST(Check, SaysWhatTheJudgeHas) {
  const auto said = [](const std::string& beyond) {
    const Model model = small_model({"body.keep_within_mm=11", "judge={edge_mm: 2}", "body.beyond=" + beyond});
    return describe_check(model, check_model(model));
  };
  EXPECT_THAT(said("incident"), HasSubstr("faces, of the whole body\n"));
  EXPECT_THAT(said("nothing"), HasSubstr("faces, of what keep_within_mm leaves\n"));
}

}  // namespace
}  // namespace touchfield
