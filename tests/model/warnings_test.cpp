#include "sim/model/warnings.h"

#include <cmath>

#include <fmt/format.h>

#include "sim/core/progress.h"
#include "sim/run/result_warnings.h"
#include "sim/run/solve_model.h"
#include "tests/support/mesh_support.h"
#include "tests/support/solve_support.h"
#include "tests/support/testing.h"

namespace touchfield::warnings_test {

touchfield::Run unsolved(const Model& model) {
  Progress progress;
  return solve_model(
      model, {}, [](const touchfield::Run&) {}, progress);
}

constexpr const char* kFinerEvaluation = "evaluation={scheme: burton_miller, edge_mm: 2}";

std::vector<std::string> warnings_of(const std::vector<std::string>& changes) {
  return model_remarks(small_model(changes)).warnings;
}
std::vector<std::string> notes_of(const std::vector<std::string>& changes) {
  return model_remarks(small_model(changes)).notes;
}

TEST(ModelRemarks, ASoundSceneHasNone) {
  const Remarks remarks = model_remarks(small_model({kFinerEvaluation}));
  EXPECT_THAT(remarks.warnings, IsEmpty());
  EXPECT_THAT(remarks.notes, IsEmpty());
}

TEST(ModelRemarks, EachWarningIsNamed) {
  EXPECT_THAT(warnings_of({"body.edge_mm=3.8"}), Contains(StartsWith("coarse_mesh: ")));
  EXPECT_THAT(warnings_of({"array.rotate_deg=[180, 0, 0]"}), Contains(StartsWith("behind_array: ")));
  EXPECT_THAT(warnings_of({"body.place.at_mm=[5.08, 5.08, 1.5]"}), Contains(StartsWith("near_source: ")));
  EXPECT_THAT(warnings_of({"body={box: {size_mm: [20, 20, 3]}, edge_mm: 2.5, "
                           "place: {landmark: bottom, at_mm: [0, 0, 50]}}"}),
              Contains(StartsWith("thin_body: ")));
}

TEST(ModelRemarks, NumbersThatFitAnotherUnitAreNamed) {
  const auto said = [](const std::string& change) {
    const std::vector<std::string> warnings = warnings_of({kFinerEvaluation, change});
    return warnings.size() == 1 ? warnings.front() : fmt::format("{} warnings", warnings.size());
  };
  const Eigen::Index channels = small_model().fixed->array.size();
  const auto each = [&](const auto& phase) {
    std::string list;
    for (Eigen::Index n = 0; n < channels; ++n) {
      list += fmt::format("{}{}", n > 0 ? ", " : "", phase(n));
    }
    return "[" + list + "]";
  };
  const auto degrees = [&](Eigen::Index n) { return 0.5 + std::fmod(137.0 * static_cast<double>(n), 360.0); };
  const auto levels = [&](Eigen::Index n) { return (37 * n) % 16; };
  const auto radians = [&](Eigen::Index n) { return std::fmod(2.4 * static_cast<double>(n), 20.0); };
  EXPECT_THAT(said("solve.methods=[{fixed: {phases_rad: " + each(degrees) + "}}]"),
              AllOf(StartsWith("unit_slip: method fixed: phases from "), HasSubstr("by pi / 180")));
  EXPECT_THAT(said("solve.methods=[{fixed: {phases_rad: " + each(levels) + "}}]"), HasSubstr("all are whole numbers"));
  EXPECT_EQ(said("solve.methods=[{fixed: {phases_rad: " + each(radians) + "}}]"), "0 warnings");
  EXPECT_EQ(said("solve.methods=[{fixed: {phases_rad: 90}}]"), "0 warnings");
  EXPECT_THAT(said("array.calibration={gain: " + each([](auto) { return 1; }) + ", phase_rad: " + each(degrees) + "}"),
              StartsWith("unit_slip: array.calibration: phases from "));
  EXPECT_THAT(said("array.source_pa_m=4386"), HasSubstr("array.source_pa_m: 4386 Pa m are 1e+03 times"));
  const auto piston = [&](const char* radius) {
    return warnings_of({kFinerEvaluation, "array.directivity=piston", std::string("array.piston_radius_mm=") + radius});
  };
  EXPECT_THAT(piston("45"), ElementsAre(HasSubstr("overlap at a pitch of 10")));
  EXPECT_THAT(piston("0.0045"), ElementsAre(HasSubstr("If 0.0045 is in metres write 4.5")));
  EXPECT_THAT(piston("4.5"), IsEmpty());
  EXPECT_THAT(said("medium={sound_speed_m_s: 343, density_kg_m3: 0.0012}"), HasSubstr("multiply g/cm3 by 1000"));
  EXPECT_THAT(warnings_of({"body={sphere: {radius_mm: 0.02}, place: {at_mm: [0, 0, 0.15]}, edge_mm: 0.008}",
                           "target={box: {at: bottom, size_mm: [0.02, 0.02, 0.02]}, pressure_pa: 100}"}),
              Contains(StartsWith("unit_slip: the bodies are 0.0")));
  EXPECT_THAT(said("frequency_khz=25"),
              StartsWith("directivity_frequency: array.directivity t4010a1 was measured at 40"));
  EXPECT_THAT(said("field=[{name: ear, at_mm: [0, -0.3, 0.4]}]"),
              HasSubstr("field ear is 0.5 mm from the origin. If [0, -0.3, 0.4] is in metres write [0, -300, 400]"));
  EXPECT_THAT(said("solve.methods=[{surface: {tolerances: {dead_percent: 80}}}]"),
              AllOf(StartsWith("expected_dead: method surface expects that 80 %"), HasSubstr("up to 5 times")));
  EXPECT_EQ(said("solve.methods=[{surface: {tolerances: {dead_percent: 20}}}]"), "0 warnings");
}

// Fine on the whole, so that the mean says nothing of it.
TEST(ModelRemarks, CoarseFacesInOnePlaceAreNamed) {
  const std::string ball = "body={sphere: {radius_mm: 20}, place: {at_mm: [0, 0, 60]}, edge_mm: ";
  const std::string box = "target.box={at: nearest_array, size_mm: [10, 10, 4]}";
  const auto warned = [&](const std::string& edges, const std::string& target,
                          const std::string& evaluation = "evaluation=same") {
    return warnings_of({ball + edges + "}", target, evaluation});
  };
  EXPECT_THAT(warned("1.5", box), IsEmpty());
  EXPECT_THAT(warned("{near: {top: 0.7}, far: 5, within_mm: 14}", box),
              ElementsAre(AllOf(StartsWith("coarse_mesh: "), HasSubstr(": 5 % of the skin has "))));
  EXPECT_THAT(
      warned("{near: {top: 0.7}, far: 3.3, within_mm: 14}", box),
      ElementsAre(AllOf(StartsWith("coarse_mesh: "), HasSubstr(": 5 % of the skin within 15 mm of the target has "))));
  EXPECT_THAT(warned("{near: {top: 0.7}, far: 3.3, within_mm: 14}", "target.box={at: top, size_mm: [10, 10, 4]}"),
              ElementsAre(StartsWith("facing_away: ")));
  // Where an evaluation has the body, it resolves the rest of the skin.
  EXPECT_THAT(warned("{near: {top: 0.7}, far: 5, within_mm: 14}", box, kFinerEvaluation),
              ElementsAre(MatchesRegex("coarse_mesh: the skin within 15 mm of the target has .* 3 are needed. .*")));
}

TEST(ModelRemarks, CrossingFacesAreNamedWhateverTheyComeFrom) {
  Model model = small_model();
  model.body.mesh = together(model.body.mesh, shifted(model.body.mesh, Vector3(8e-3, 0, 0)));
  FixedModel& fixed = own_part(model);
  fixed.skin.assign(static_cast<std::size_t>(model.body.mesh.face_count()), 1);
  fixed.owner.assign(fixed.skin.size(), 0);
  EXPECT_THAT(model_remarks(model).warnings,
              Contains(MatchesRegex("cutting_faces: [0-9]+ pairs of faces intersect, .*")));
}

TEST(ModelRemarks, ABoxOverBothSidesIsNamed) {
  const std::string plate =
      "body={box: {size_mm: [30, 30, 6]}, edge_mm: 2, place: {landmark: bottom, at_mm: [0, 0, 50]}}";
  EXPECT_THAT(
      warnings_of({plate, "target.box.size_mm=[12, 12, 20]"}),
      Contains(MatchesRegex("both_sides: 100 % of the target is on two opposite sides of 6.. mm of a body, .*")));
  EXPECT_THAT(warnings_of({plate, "target.box.size_mm=[12, 12, 5]"}), IsEmpty());
}

TEST(ModelRemarks, APatternEvaluatedWhereItWasFoundIsNoted) {
  EXPECT_THAT(notes_of({}), ElementsAre(StartsWith("evaluated_by_itself: ")));
  EXPECT_THAT(notes_of({"evaluation={split: 1}"}), IsEmpty());
  EXPECT_THAT(notes_of({"evaluation=none"}), IsEmpty());
  EXPECT_THAT(notes_of({"sensing={noise_mm_rms: 0.1, correlation_mm: 4}"}), IsEmpty());
  EXPECT_THAT(notes_of({"solve.methods=[{fixed: {phases_rad: 0}}]"}), IsEmpty());  // nothing was fitted
}

TEST(ModelRemarks, SkinBeyondIsNoted) {
  const std::string kept = "body.keep_within_mm=11";
  EXPECT_THAT(notes_of({kept, kFinerEvaluation}),
              ElementsAre(MatchesRegex("beyond: .* within 11 mm .* [0-9]+ points, .*")));
  EXPECT_THAT(notes_of({"body.keep_within_mm=60", kFinerEvaluation}), IsEmpty());  // nothing is left out
}

TEST(ModelRemarks, AHandAloneAndAScenesSilenceAboutTheForearmAreNoted) {
  const auto hand = [](const std::string& more) {
    return "body={hand: {pose: index_up" + more +
           "}, edge_mm: {near_target: 3, far: 8, within_mm: 10}, "
           "place: {landmark: index_pad, at_mm: [0, 0, 100]}}";
  };
  const std::string on_the_pad = "target.box.at=index_pad";
  EXPECT_THAT(notes_of({hand(", forearm_mm: 0"), on_the_pad, "evaluation=none"}),
              ElementsAre(StartsWith("hand_alone: ")));
  EXPECT_THAT(notes_of({hand(""), on_the_pad, "evaluation=none"}),
              ElementsAre(StartsWith("forearm: the hand has 250 mm of forearm")));
  EXPECT_THAT(notes_of({hand(", forearm_mm: 250"), on_the_pad, "evaluation=none"}), IsEmpty());
}

TEST(ModelRemarks, ABodyBetweenTheArrayAndTheSkinBeyondIsNamed) {
  const auto warned = [](double height) {
    return warnings_of(
        {fmt::format(
             "bodies=[{{name: pressed, capsule: {{radius_mm: 6, length_mm: 60}}, edge_mm: 2.5, keep_within_mm: 15, "
             "place: {{landmark: bottom, at_mm: [0, 0, 60]}}}}, "
             "{{name: other, box: {{size_mm: [40, 20, 8]}}, edge_mm: 2.5, place: {{at_mm: [0, 25, {}]}}}}]",
             height),
         "body=null", "target.box={at: pressed.bottom, size_mm: [6, 12, 5]}"});
  };
  EXPECT_THAT(warned(45), ElementsAre(StartsWith("shadowed_skin: ")));
  EXPECT_THAT(warned(90), IsEmpty());
}

TEST(ModelRemarks, AMotionThatIsLeftOutIsNoted) {
  EXPECT_THAT(notes_of({"evaluation=none", "motion={seconds: 1, change: [{path: body.place.at_mm.0, rate: 5}]}"}),
              ElementsAre(StartsWith("still: ")));
}

TEST(ResultRemarks, ASolveThatMissedItsToleranceIsNamed) {
  touchfield::Run run = unsolved(small_model());
  EXPECT_THAT(result_remarks(run).warnings, IsEmpty());
  run.solves.front().converged = false;
  EXPECT_THAT(result_remarks(run).warnings, Contains(StartsWith("not_converged: " + run.solves.front().stage + ": ")));
  run.solves.front().stage = "resonance_check";  // which has a warning of its own
  EXPECT_THAT(result_remarks(run).warnings, IsEmpty());
}

TEST(ResultRemarks, TheResonanceCheckIsOfSchemesWithoutACure) {
  touchfield::Run run = unsolved(small_model());
  run.resonance_check = 0.5;
  run.resonance_checks = {{"paper_corrected", 0.09}, {"paper", 0.11}};
  EXPECT_THAT(result_remarks(run).warnings, ElementsAre(StartsWith("fictitious_frequency: scheme paper ")));
  run.evaluation_model = EvaluationModel{"paper_corrected", run.mesh, std::nullopt};
  EXPECT_THAT(result_remarks(run).warnings, SizeIs(1));
  run.evaluation_model->scheme = "burton_miller";  // the figures are free of it
  EXPECT_THAT(result_remarks(run).warnings, IsEmpty());
  EXPECT_THAT(result_remarks(run).notes, Contains(StartsWith("fictitious_frequency: scheme paper ")));
}

TEST(ResultRemarks, EverySchemeWithoutACureIsCompared) {
  const touchfield::Run run = unsolved(
      small_model({"solve.methods=[paper, {paper: {as: original, scheme: paper}}, {focus: {scheme: paper_corrected}}, "
                   "{fixed: {phases_rad: 0, scheme: paper}}, {unscattered: {scheme: chief}}]",
                   "solve.resonance_check=always"}));
  EXPECT_FALSE(std::isnan(run.resonance_check));  // of the first method's, burton_miller_polished
  ASSERT_EQ(run.resonance_checks.size(), 3U);
  EXPECT_EQ(run.resonance_checks[0].first, "paper");
  EXPECT_EQ(run.resonance_checks[1].first, "paper_corrected");
  EXPECT_EQ(run.resonance_checks[2].first, "chief");
  // What they are compared with is the run's own burton_miller_polished.
  std::vector<std::string> references;
  for (const SolveRecord& solve : run.solves) {
    if (solve.stage == "resonance_check") {
      references.push_back(solve.scheme);
    }
  }
  EXPECT_THAT(references, ElementsAre("paper_corrected", "burton_miller_polished", "burton_miller_polished",
                                      "burton_miller_polished"));
  for (std::size_t i = 0; i < 2; ++i) {
    const MethodResult& method = run.methods[i + 1];
    EXPECT_GT(run.resonance_checks[i].second, 1e-4) << method.name;
    EXPECT_LT(run.resonance_checks[i].second, 0.3) << method.name;
  }
  EXPECT_TRUE(unsolved(small_model({"solve.methods=[{paper: {scheme: paper}}]", "solve.resonance_check=never"}))
                  .resonance_checks.empty());
}

TEST(ResultRemarks, SteepenedSoundIsNotedAndFromAShockOnWarnedOf) {
  touchfield::Run run = unsolved(small_model());
  const auto with = [&](const std::vector<double>& sigmas) {
    for (std::size_t m = 0; m < sigmas.size(); ++m) {
      run.methods[m].shock_distance_share = sigmas[m];
    }
    return result_remarks(run);
  };
  EXPECT_THAT(with({0.29, 0.1, kNotComputed}).notes, IsEmpty());
  const Remarks noted = with({0.3, 0.29, 0.1});
  EXPECT_THAT(noted.warnings, IsEmpty());
  EXPECT_THAT(noted.notes, ElementsAre(AllOf(StartsWith("nonlinear: "), HasSubstr("here it is paper 0.30."),
                                             HasSubstr("loses 1.1 % of its pressure"))));
  const Remarks both = with({1.0, 0.99, 2.7});
  EXPECT_THAT(both.warnings, ElementsAre(AllOf(StartsWith("nonlinear: "), HasSubstr("paper 1.00, focus 2.70."),
                                               HasSubstr("loses 12 % of its pressure"))));
  EXPECT_THAT(both.notes, ElementsAre(HasSubstr("unscattered 0.99.")));
}

TEST(ResultRemarks, AWeakTargetIsInTheShadow) {
  touchfield::Run run = unsolved(small_model());
  for (const Eigen::Index f : run.target->faces) {
    run.methods.front().pressure(f) *= 0.01;
  }
  EXPECT_THAT(result_remarks(run).warnings, Contains(StartsWith("deep_shadow: ")));
}

}  // namespace touchfield::warnings_test
