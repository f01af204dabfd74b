#include <numbers>

#include <nlohmann/json.hpp>

#include "sim/bem/rigid_sphere.h"
#include "sim/core/json.h"
#include "sim/field/metrics.h"
#include "sim/mesh/query/face_tree.h"
#include "sim/run/run_text.h"
#include "sim/run/solve_model.h"
#include "tests/support/solve_support.h"
#include "tests/support/testing.h"

namespace touchfield::sound_level_test {

/// One transducer at the origin and a rigid sphere above it, at full level and phase 0.
Model one_transducer(const std::string& directivity, const std::string& sphere, const std::string& field,
                     const std::vector<std::string>& changes = {}) {
  return build_model(
      read_scene_text("name: one\n"
                      "array: {grid: {count: [1, 1]}, directivity: " +
                          directivity + "}\nbody: " + sphere +
                          "\nsolve: {methods: [{fixed: {phases_rad: 0}}]}\nevaluation: none\nfield: " + field,
                      "one.yaml", "", changes));
}

double level_of(const FieldResult& field) { return sound_level(std::abs(field.pressure.front().second(0))); }

// A body of a quarter of a wavelength far away adds less than 0.01 dB.
TEST(SoundLevels, OfAPistonAloneAreItsFormula) {
  const Model model = one_transducer("piston", "{sphere: {radius_mm: 1}, place: {at_mm: [0, 0, 900]}, edge_mm: 0.7}",
                                     "[{name: ahead, at_mm: [0, 0, 500]}, {name: aside, at_mm: [300, -100, 400]}]\n",
                                     {"medium.absorption=true"});
  const auto run = solve_model(model);
  const Wave& wave = model.fixed->wave;
  ASSERT_GT(wave.medium().absorption, 0.1);
  const auto formula = [&](const Vector3& at) {
    const double r = at.norm();
    const double x = wave.k() * 4.5e-3 * at.head<2>().norm() / r;
    const double directivity = x == 0 ? 1.0 : 2.0 * ::j1(x) / x;
    return sound_level(kAutd3SourceStrength * std::abs(directivity) * std::exp(-wave.medium().absorption * r) / r);
  };
  EXPECT_NEAR(level_of(run.fields[0]), formula({0, 0, 0.5}), 0.01);
  EXPECT_NEAR(level_of(run.fields[1]), formula({0.3, -0.1, 0.4}), 0.01);
  EXPECT_DOUBLE_EQ(run.frequency, 40e3);
}

// 0.1 mm off the skin the pressure is that of the skin, on the lit side up to twice the incident one.
TEST(SoundLevels, JustOffTheSkinAreThoseOfTheSkin) {
  const Model model = one_transducer(
      "omni", "{sphere: {radius_mm: 8}, place: {at_mm: [0, 0, 60]}, edge_mm: 1}",
      "[{name: lit, at_mm: [0, 0, 51.9]}, {name: side, at_mm: [8.1, 0, 60]}, {name: shadow, at_mm: [0, 0, 68.1]}]\n");
  const auto run = solve_model(model);
  const Eigen::VectorXcd exact = 4.0 * std::numbers::pi * kAutd3SourceStrength *
                                 rigid_sphere_point_source(model.fixed->wave, 8e-3, 60e-3, Vector3(1, 0, -1));
  for (const std::size_t i : {0U, 1U, 2U}) {
    EXPECT_NEAR(level_of(run.fields[i]), sound_level(std::abs(exact(static_cast<Eigen::Index>(i)))), 0.4)
        << run.fields[i].grid.name;
  }
  EXPECT_GT(level_of(run.fields[0]), sound_level(kAutd3SourceStrength / 51.9e-3) + 4.0);
}

// A mesh that is too coarse for them is no matter where another one evaluates it.
TEST(SoundLevels, AreThoseOfTheEvaluation) {
  const auto levels = [](const std::vector<std::string>& changes) {
    const auto run = solve_model(one_transducer(
        "omni", "{sphere: {radius_mm: 16}, place: {at_mm: [0, 0, 80]}, edge_mm: 1.5}",
        "[{name: lit, at_mm: [3, 0, 60]}, {name: side, at_mm: [18, 2, 82]}, {name: shadow, at_mm: [7, 0, 98]}]\n",
        changes));
    return Eigen::Vector3d(level_of(run.fields[0]), level_of(run.fields[1]), level_of(run.fields[2]));
  };
  const Eigen::Vector3d fine = levels({});
  EXPECT_GT((levels({"body.edge_mm=5"}) - fine).cwiseAbs().maxCoeff(), 0.5);
  EXPECT_LT((levels({"body.edge_mm=5", "evaluation={edge_mm: 1.5}"}) - fine).cwiseAbs().maxCoeff(), 0.05);
}

TEST(SoundLevels, OnTheSkinAreThoseOfTheSkin) {
  const Model model = one_transducer("omni", "{box: {size_mm: [16, 12, 10]}, place: {at_mm: [0, 0, 60]}, edge_mm: 1.5}",
                                     "[{name: flat, at_mm: [1, 2, 55]}, {name: corner, at_mm: [8, 6, 65]}]\n");
  const auto run = solve_model(model);
  const FaceTree tree(run.mesh);
  for (const FieldResult& field : run.fields) {
    EXPECT_EQ(field.inside.front(), 0);
    EXPECT_EQ(field.pressure.front().second(0), run.methods.front().pressure(tree.nearest(field.grid.origin).face));
  }
}

TEST(SoundLevels, PointsThatHearNothingAreRefused) {
  const auto refusal = [](const std::string& at, const std::vector<std::string>& more = {}) {
    std::vector<std::string> changes = {"field=[{name: ear, at_mm: " + at + "}]"};
    changes.insert(changes.end(), more.begin(), more.end());
    return message_of<InputError>([&] { small_model(changes); });
  };
  EXPECT_THAT(refusal("[0, 0, 51]"),
              AllOf(HasSubstr("field ear: at_mm (0.00, 0.00, 51.00) mm is"), HasSubstr("mm inside a body"),
                    HasSubstr(" the nearest place in the air is ")));
  EXPECT_THAT(refusal("[5.08, 5.08, 0.3]"), HasSubstr("must be >= 1 mm away from every transducer"));
  // The end of the capsule, which keep_within_mm leaves out.
  EXPECT_THAT(refusal("[0, 9, 56]", {"body.keep_within_mm=8"}), HasSubstr("inside a body"));
  EXPECT_NO_THROW(small_model({"field=[{name: ear, at_mm: [0, 0, 49.9]}]"}));
  EXPECT_NO_THROW(small_model({"field=[{name: box, centre_mm: [0, 0, 51], size_mm: [1, 1, 1]}]"}));
}

// Some faces lie below the round skin that they stand for: a finer mesh has a point there inside.
TEST(SoundLevels, APointInsideTheEvaluationMeshAloneHasNoneAndAWarning) {
  const std::vector<std::string> evaluated = {"evaluation={scheme: burton_miller, edge_mm: 1}", "array.phase_levels=16",
                                              "solve.methods=[focus]", "body.edge_mm=4"};
  const Model plain = small_model(evaluated);
  const TriangleMesh& mesh = plain.body.mesh;
  const FaceTree evaluation(plain.fixed->evaluation.mesh(plain).mesh);
  const auto depth = [&](Eigen::Index face) {
    const Vector3 x = mesh.centroids().col(face);
    return evaluation.winding_number(x) > 0.5 ? evaluation.nearest(x).distance : 0.0;
  };
  Eigen::Index deepest = 0;
  for (Eigen::Index face = 0; face < mesh.face_count(); ++face) {
    deepest = depth(face) > depth(deepest) ? face : deepest;
  }
  ASSERT_GT(depth(deepest), 0.02e-3);
  const Vector3 at = 1e3 * (mesh.centroids().col(deepest) + 0.3 * depth(deepest) * mesh.normals().col(deepest));
  std::vector<std::string> changes = evaluated;
  changes.push_back("field=[{name: ear, at_mm: [" + std::to_string(at.x()) + ", " + std::to_string(at.y()) + ", " +
                    std::to_string(at.z()) + "]}]");
  const auto run = solve_model(small_model(changes));
  EXPECT_THAT(run.warnings, Contains(StartsWith("point_inside: field ear: ")));
  EXPECT_EQ(json_text(levels_value(run)["sound_levels"], -1),
            R"([{"point":"ear","method":"focus","amplitude_pa":null,"level_db":null}])");
}

}  // namespace touchfield::sound_level_test
