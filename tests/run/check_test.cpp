#include "sim/run/check.h"

#include "tests/support/solve_support.h"
#include "tests/support/testing.h"

namespace touchfield::check_test {

// Of the whole body; the part has less than half of its skin.
TEST(Check, ForetellsTheFacesOfTheEvaluation) {
  for (const char* kept : {"null", "11"}) {
    for (const char* evaluation : {"same", "{split: 1}", "{edge_mm: 1.5}"}) {
      SCOPED_TRACE(std::string(evaluation) + ", " + kept);
      const Model model = small_model({"body.capsule.length_mm=40", std::string("body.keep_within_mm=") + kept,
                                       std::string("evaluation=") + evaluation});
      if (!model.fixed->evaluation.elsewhere()) {
        EXPECT_EQ(check_model(model).evaluation_faces, 0);
        continue;
      }
      const auto faces = static_cast<double>(model.fixed->evaluation.mesh(model).mesh.face_count());
      EXPECT_NEAR(static_cast<double>(check_model(model).evaluation_faces) / faces, 1.0, 0.2);
    }
  }
}

}  // namespace touchfield::check_test
