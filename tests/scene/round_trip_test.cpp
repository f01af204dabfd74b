// A resolved scene reads back the same, with all digits of its numbers; schema_test.cpp reads every example back.

#include <random>
#include <regex>

#include "tests/support/scene_support.h"
#include "tests/support/testing.h"

namespace touchfield {
namespace {

void expect_round_trip(const Scene& scene) {
  const std::string resolved = resolved_yaml(scene);
  SCOPED_TRACE(resolved);
  EXPECT_EQ(resolved_yaml(scene_from(resolved)), resolved);
}

struct Variant {
  std::string name;
  std::vector<std::string> overrides;  // of the small scene
};

// Keys together, at values that are not their defaults and have no short decimal form.
const std::vector<Variant> kVariants = {
    {"defaults", {}},
    {"medium",
     {"medium={temperature_c: 21.7, humidity_percent: 33.3, absorption: true, sound_speed_m_s: 344.4, density_kg_m3: "
      "1.19}"}},
    {"array",
     {"array={grid: {count: [3, 5], pitch_mm: 10.18}, at_mm: [0.1, 0.2, 0.3], rotate_deg: [12.3, 45.6, -78.9],"
      " directivity: piston, piston_radius_mm: 4.7, level: 0.3, source_pa_m: 3.3}"}},
    {"autd3_units", {"array={autd3: {units: [{at_mm: [0, 0, 0.1]}, {at_mm: [1, 2, 3], rotate_deg: [1, 2, 3]}]}}"}},
    {"axes", {"array={positions: {points_mm: [[0, 0, 0], [1, 2, 3]], axes: [[1, 2, 3], [-1e-5, 7, 3]]}}"}},
    {"joints",
     {"body={hand: {pose: fist, joints: {thumb: {cmc_flexion_deg: -3.3, ip_deg: 7.7}, little: {abduction_deg: 11.1, "
      "mcp_deg: 22.2, pip_deg: 33.3, dip_deg: -4.4}}}, edge_mm: 3.3}"}},
    {"skin_methods",
     {"solve.methods=[{surface: {free_amplitudes: true, start: {random: 3, restarts: 4}}}, gs, wgs, gs_pat, eigen, "
      "{lbfgs: {iterations: 17, start: spectral}}, {surface: {as: third, start: adjoint}}]",
      "target={box: {at: top, size_mm: [4, 4, 4]}}", "solve.outside_weight=0.35", "solve.optimality_bound=true"}},
    {"responses",
     {"array={grid: {count: [2, 1]}, directivity: omni, calibration: {gain: [1.1, 0], phase_rad: [0.1, -3], in: "
      "truth}, "
      "tolerances: {gain_percent: 5, phase_deg: 10, dead_percent: 1, seed: 7, in: both}, phase_levels: 16}"}},
    {"mesh", {"body={mesh: {file: 'a folder/it''s: #1 hand.stl', unit: cm, landmarks: {tip: [0.1, 0.7, -3.3]}}}"}},
    {"place", {"body.place={landmark: top, at_mm: [0.1, 0.7, 200.3], rotate_deg: [0.1, 33.3, 359.9]}"}},
    {"target",
     {"target={box: {at: top, offset_mm: [0.1, 0, 0], size_mm: [8, 40, 6], rotate_deg: [0, 0, 45]}, "
      "profile: penetration, pressure_pa: 3000.7}"}},
    {"target_drawn",
     {"target={points: [{at: top, offset_mm: [1.1, 0, 0], diameter_mm: 7.7, level: 0.1}], lines: [{points: [{at: top}, "
      "{centre_mm: [0, 0.1, 7]}, {at: bottom}], width_mm: 2.3, level: 0.7}, {points: [{at: bottom}, {at: top}], "
      "width_mm: 3}]}"}},
    {"methods",
     {"target={box: {at: top, size_mm: [8, 40, 6]}}",
      "solve={methods: [paper, unscattered, focus, {paper: {as: p-2, scheme: paper, iterations: 10, start: "
      "{random: 4294967295}}}, {focus: {as: f_2}}, {fixed: {phases_rad: [0.1, -7, 3]}}, {fixed: {as: one, "
      "phases_rad: 0.1, amplitudes: 0.7}}, {fixed: {as: each, phases_rad: 0, amplitudes: [0, 0.3, 1]}}], iterations: "
      "12, start: {random: 0}}"}},
    {"fields",
     {"field=[{name: a, plane: xy, through_mm: [0.1, 0, 0], size_mm: [0.3, 0.7], spacing_mm: 0.1}, {name: b, "
      "plane: yz, through_mm: [1, 2, 3], size_mm: [3, 7]}, {name: c, centre_mm: [1, 2, 3], size_mm: [3, 7, "
      "0.9]}, {name: d, at_mm: [0.1, -0.7, 3]}, {name: e, at_mm: [0, 0, 0]}]"}},
    {"solver",
     {"solve={methods: [{fixed: {phases_rad: 0}}], solver: lu, precision: double, tolerance: 1e-13, refine: false, "
      "max_steps: 7, resonance_check: always, coupling: 0.3, split_ratio: 1.1}"}},
    {"graded", {"body.edge_mm={far: 3.3, near_target: 1.1, near: {top: 1.3, y_plus: 0.9}, growth: 0.31}"}},
    {"pattern_line",
     {"target={box: {at: bottom, size_mm: [8, 8, 4]}, pressure_pa: 500}",
      "pattern={line: {from: [-3.3, 0, 50.1], to: bottom, hz: 33.3}, amplitude: {hz: 71, depth: 0.3}, diameter_mm: "
      "3.7, frames_per_second: 777, seconds: 0.7, most_turn_deg: 33.3, iterations: 7, pressure_pa: 333.3, watch: "
      "[bottom, top], ring_up_ms: 0.7}"}},
    {"motion_of_all",
     {"motion={seconds: 2.1, change: [{path: body.place.at_mm.2, sine: {amplitude: 10.1, hz: 1.3, phase_deg: 33.3, "
      "about: 200.7}}, {path: body.place.rotate_deg.0, keys: [[0, 0.1], [0.5, -7.3], [2.1, 3]]}, {path: "
      "body.place.at_mm.0, rate: -50.3}], target: in_world, frames_hz: 29.97, iterations: 7, start: zero, steer: "
      "false, sensor: {hz: 59.94, latency_ms: 12.3}, solve_ms: 20.7, array_ms: 0.3, predict: linear, score_hz: "
      "60.1, stale_ms: 99.9}"}},
    {"large_and_small", {"array.at_mm=[1e9, -1e-30, 123456789.01234567]", "array.source_pa_m=1e-9"}},
};

class RoundTrip : public ::testing::TestWithParam<Variant> {};

TEST_P(RoundTrip, HoldsEveryNumberAndReadsBackTheSame) {
  const Scene scene = scene_from(kSmallScene, GetParam().overrides);
  expect_round_trip(scene);
  const std::regex number("\\d+\\.\\d+");
  for (const std::string& change : GetParam().overrides) {
    for (std::sregex_iterator found(change.begin(), change.end(), number), end; found != end; ++found) {
      EXPECT_THAT(resolved_yaml(scene), HasSubstr(found->str()));
    }
  }
}

INSTANTIATE_TEST_SUITE_P(ResolvedScene, RoundTrip, ::testing::ValuesIn(kVariants),
                         [](const auto& info) { return info.param.name; });

TEST(ResolvedScene, WritesNumbersAsAUserWould) {
  const std::string text = resolved_yaml(scene_from(
      kSmallScene, {"array.at_mm=[0.1, 200, -7.25]", "array.rotate_deg=[90, 33.3, 0.1]", "medium.temperature_c=21.7"}));
  EXPECT_THAT(text, HasSubstr("  at_mm: [0.1, 200, -7.25]\n  rotate_deg: [90, 33.3, 0.1]\n"));
  EXPECT_THAT(text, HasSubstr("temperature_c: 21.7\n"));
  EXPECT_THAT(text, HasSubstr("pitch_mm: 10.16\n"));
  EXPECT_THAT(text, HasSubstr("radius_mm: 8\n"));
}

TEST(ResolvedScene, NamesTheMaskOfATarget) {
  const TempFolder folder;
  folder.write("mask.txt", "0 0.25, 1 # three faces\n0\n");
  const Scene scene = read_scene(folder.write("scene.yaml", kSmallScene),
                                 {"target={mask_file: " + folder.path().string() + "/mask.txt}"});
  EXPECT_EQ(scene.target->mask->levels, (std::vector<double>{0, 0.25, 1, 0}));
  expect_round_trip(scene);
}

TEST(ResolvedScene, HoldsTheNumbersOfFiles) {
  const TempFolder folder;
  folder.write("array.csv", "x_mm,y_mm,z_mm,nx,ny,nz\n1,2,3,1,1,1\n4,5,6,0,1,1\n");
  folder.write("phases.txt", "0.1 0.2\n");
  const auto file = folder.write("scene.yaml", kSmallScene);
  const Scene scene =
      read_scene(file, {"array={positions: {file: " + folder.path().string() + "/array.csv}}",
                        "solve.methods.0.fixed={phases_file: " + folder.path().string() + "/phases.txt}"});
  expect_round_trip(scene);  // in another folder, without the files
  EXPECT_EQ(resolved_yaml(scene).find(".csv"), std::string::npos);
}

// Scenes that a program makes hold any doubles. Some lengths in metres have no double in millimetres; their neighbour
// is written then, once: 1 ulp, 2^-52 of the length at most.
TEST(ResolvedScene, HoldsAnyLengthsToRounding) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> coordinate(-1, 1);
  PositionsArray array{Points(3, 500), Points(3, 500)};
  for (Eigen::Index i = 0; i < 500; ++i) {
    array.points.col(i) = Vector3(coordinate(random), coordinate(random), coordinate(random) * 1e-6);
    array.axes.col(i) = Vector3(coordinate(random), coordinate(random), coordinate(random)).normalized();
  }
  Scene scene = scene_from(kSmallScene);
  scene.array.layout = array;
  const Scene back = scene_from(resolved_yaml(scene));
  const auto& read = std::get<PositionsArray>(back.array.layout);
  EXPECT_EQ(read.axes, array.axes);
  EXPECT_LE(((read.points - array.points).array() / array.points.array()).abs().maxCoeff(), 0x1p-52);
  EXPECT_EQ(resolved_yaml(back), resolved_yaml(scene));
  expect_round_trip(back);
}

// The template is one of them.
TEST(ResolvedScene, HoldsTheShippedScenes) {
  int count = 0;
  for (const auto& file : std::filesystem::directory_iterator(source_folder() / "scenes")) {
    if (file.path().extension() != ".yaml") continue;
    SCOPED_TRACE(file.path());
    const Scene scene = read_scene(file.path().string(), {});
    EXPECT_EQ(scene.name, file.path().stem().string());
    expect_round_trip(scene);
    ++count;
  }
  EXPECT_GE(count, 3);
}

}  // namespace
}  // namespace touchfield
