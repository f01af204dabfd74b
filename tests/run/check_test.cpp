#include "sim/run/check.h"

#include <nlohmann/json.hpp>

#include "sim/field/evaluate.h"
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

TEST(Check, CountsFieldsAndTheirGrid) {
  const std::vector<std::string> fine = {
      "body.edge_mm=1", "field=[{name: about, centre_mm: [0, 0, 55], size_mm: [40, 40, 40], spacing_mm: 1}]"};
  const Model without = small_model({fine[0]});
  const Model model = small_model(fine);
  constexpr double kPoints = 41.0 * 41.0 * 41.0;
  const FieldSums sums =
      choose_field_sums(model.body.mesh, model.fixed->wave, field_points(model.fixed->fields.front().points(), 3));
  ASSERT_TRUE(sums.grid.has_value());
  EXPECT_LT(sums.pairs, 0.5 * kPoints * static_cast<double>(model.body.mesh.face_count()));
  const double fields = 16.0 * kPoints * 3.0;
  EXPECT_NEAR(check_model(model).memory_mib - check_model(without).memory_mib,
              (sums.grid->memory + fields) / std::pow(2.0, 20), 0.1);
}

}  // namespace touchfield::check_test
