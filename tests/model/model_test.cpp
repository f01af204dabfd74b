#include "sim/model/model.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "tests/support/scene_support.h"
#include "tests/support/solve_support.h"
#include "tests/support/testing.h"

namespace touchfield::model_test {

std::string refusal(const std::vector<std::string>& changes) {
  return message_of<InputError>([&] { small_model(changes); });
}

TEST(Model, BodiesStandWhereTheScenePutsThem) {
  const Model model = small_model({"body.place.at_mm=[3, -4, 70]"});
  EXPECT_NEAR(model.body.mesh.vertices().row(2).minCoeff(), 0.070, 1e-4);
  const Vector3 bottom = position(model.body.mesh, find_landmark(model.body, "bottom"));
  EXPECT_LT((bottom - Vector3(0.003, -0.004, 0.070)).norm(), 1e-9);
  const Vector3 own = model.own_frame(bottom);
  const Model other = small_model();
  const Vector3 other_own = other.own_frame(position(other.body.mesh, find_landmark(other.body, "bottom")));
  EXPECT_LT((own - other_own).norm(), 1e-9);  // a body keeps its own frame wherever it stands
}

TEST(Model, WhatDoesNotGoTogetherIsRefused) {
  EXPECT_THAT(refusal({"body.place.landmark=elbow"}), HasSubstr("elbow"));
  EXPECT_THAT(refusal({"body.place.at_mm=[0, 0, 0]"}), HasSubstr("cuts through the board"));
  EXPECT_THAT(refusal({"target.box.size_mm=[0.001, 0.001, 0.001]"}), HasSubstr("target"));
  EXPECT_THAT(refusal({"target.box.size_mm=[100, 100, 100]"}), HasSubstr("target"));
}

TEST(Model, AWantedRadiationPressureIsThatOfTheAmplitudeInItsAir) {
  for (const char* air : {"medium={temperature_c: 20}", "medium={sound_speed_m_s: 300, density_kg_m3: 1.5}"}) {
    const Model model = small_model({air, "target.pressure_pa=null", "target.radiation_pa=30"});
    const Medium& medium = model.fixed->wave.medium();
    const double c = medium.sound_speed;
    EXPECT_NEAR(std::pow(build_target(model).amplitudes.maxCoeff(), 2) / (4.0 * medium.density * c * c), 30.0, 1e-10);
  }
}

TEST(Model, PointsAndLinesAreDrawnOnTheSkin) {
  const Model model = small_model(
      {"target.box=null", "target.points=[{at: bottom, diameter_mm: 5}, {at: x_plus, diameter_mm: 4, level: 0.5}]",
       "target.lines=[{points: [{at: bottom, offset_mm: [0, -4, 0]}, {at: bottom, offset_mm: [0, 6, 0]}], width_mm: "
       "3}]"});
  EXPECT_EQ(model.boxes[0].key, "target.points[0]");
  EXPECT_EQ(model.boxes[1].key, "target.points[1]");
  EXPECT_EQ(model.boxes[2].key, "target.lines[0]");
  const Target target = build_target(model);
  const double pressure = target.amplitudes.maxCoeff();
  const double side = position(model.body.mesh, find_landmark(model.body, "x_plus")).x();
  for (std::size_t i = 0; i < target.faces.size(); ++i) {
    const bool at_side = model.body.mesh.centroids()(0, target.faces[i]) > 0.7 * side;
    EXPECT_DOUBLE_EQ(target.amplitudes(static_cast<Eigen::Index>(i)), at_side ? 0.5 * pressure : pressure);
  }
  EXPECT_EQ(model.plan.targets.size(), 5U);  // two points, and the line every 5 mm
}

TEST(Model, PointsAndLinesWithoutAFaceNameTheirKey) {
  const std::string points = "{at: bottom, offset_mm: [0.31, 0.2, 0]}, {at: bottom, offset_mm: [0.31, 0.5, 0]}";
  EXPECT_THAT(refusal({"target.lines=[{points: [" + points + "], width_mm: 0.03}]"}),
              HasSubstr("target.lines[0]: the box about"));
  EXPECT_THAT(refusal({"target.points=[{at: bottom, diameter_mm: 0.01}]"}),
              HasSubstr("target.points[0]: the box about"));
}

TEST(Model, TheEvaluationHasTheWholeBodyWhateverItIs) {
  const double skin = small_model({"body.capsule.length_mm=40"}).body.mesh.total_area();
  for (const char* evaluation : {"auto", "same", "{split: 1}", "{edge_mm: 2}"}) {
    SCOPED_TRACE(evaluation);
    const Model model =
        small_model({"body.capsule.length_mm=40", "body.keep_within_mm=11", std::string("evaluation=") + evaluation});
    EXPECT_TRUE(model.fixed->evaluation.elsewhere());
    const EvaluationMesh mesh = model.fixed->evaluation.mesh(model);
    EXPECT_NEAR(mesh.mesh.total_area() / skin, 1.0, 0.01);
    EXPECT_LE(mesh.mesh.mean_edge(), 1.05 * kCoarsestEvaluation * model.fixed->wave.wavelength());
  }
}

TEST(Model, AnEvaluationByItselfIsFineWhereTheSolverIsCoarse) {
  const auto evaluation_of = [](const std::vector<std::string>& changes) {
    return small_model(changes).fixed->scene.evaluation;
  };
  EXPECT_EQ(evaluation_of({}).kind, EvaluationSpec::Kind::kSame);
  EXPECT_EQ(evaluation_of({"body.edge_mm={near_target: 1.5, far: 3}"}).kind, EvaluationSpec::Kind::kSame);
  const EvaluationSpec coarse = evaluation_of({"body.edge_mm={near_target: 1.5, far: 5}"});
  ASSERT_EQ(coarse.kind, EvaluationSpec::Kind::kEdge);
  EXPECT_NEAR(coarse.edge.far, 0.35 * 343.21 / 40e3, 1e-6);
  EXPECT_NEAR(*coarse.edge.near_target, 1.2e-3, 1e-9);
  EXPECT_EQ(evaluation_of({"body.keep_within_mm=11"}).kind, EvaluationSpec::Kind::kEdge);
}

TEST(Model, TheEvaluationHasItsOwnMeshWhereTheSceneSaysSo) {
  EXPECT_FALSE(small_model().fixed->evaluation.elsewhere());
  const Model split = small_model({"evaluation={split: 1}"});
  EXPECT_TRUE(split.fixed->evaluation.elsewhere());
  EXPECT_EQ(split.fixed->evaluation.mesh(split).mesh.face_count(), 4 * split.body.mesh.face_count());
  const Model noisy = small_model({"sensing={noise_mm_rms: 0.3, correlation_mm: 5, seed: 1}"});
  ASSERT_TRUE(noisy.truth.has_value());
  EXPECT_EQ(noisy.fixed->evaluation.mesh(noisy).mesh.vertices(), noisy.truth->vertices());
  EXPECT_NE(noisy.body.mesh.vertices(), noisy.truth->vertices());
}

// In the hand's own frame, which the scene leaves in its place: the forearm is behind y = -20 mm.
TEST(Model, AForearmHasEdgesTwiceAsLongAsTheFarOnesOfItsHand) {
  const auto edges = [](const std::string& hand, const std::string& edge) {
    const Model model = build_model(
        scene_from(kSmallScene, {"body={hand: " + hand + ", edge_mm: " + edge + ", place: {at_mm: [0, 0, 300]}}"}));
    double most_of_hand = 0;
    double arm_area = 0;
    double arm_faces = 0;
    for (Eigen::Index f = 0; f < model.body.mesh.face_count(); ++f) {
      const double y = model.body.mesh.centroids()(1, f);
      const double edge_of_face = std::sqrt(4.0 / std::sqrt(3.0) * model.body.mesh.areas()(f));
      most_of_hand = y > -20e-3 ? std::max(most_of_hand, edge_of_face) : most_of_hand;
      arm_area += y < -60e-3 ? model.body.mesh.areas()(f) : 0.0;
      arm_faces += y < -60e-3 ? 1.0 : 0.0;
    }
    return std::pair(most_of_hand, std::sqrt(4.0 / std::sqrt(3.0) * arm_area / std::max(1.0, arm_faces)));
  };
  const auto [hand, arm] = edges("{pose: flat, forearm_mm: 200}", "{near: {index_pad: 3}, far: 5}");
  EXPECT_LT(hand, 1.5 * 5e-3);
  EXPECT_NEAR(arm, 10e-3, 1e-3);
  EXPECT_EQ(edges("{pose: flat, forearm_mm: 0}", "{near: {index_pad: 3}, far: 5}").second, 0);
}

}  // namespace touchfield::model_test
