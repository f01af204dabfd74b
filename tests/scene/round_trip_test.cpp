// A resolved scene is a scene that reads back the same, to the bit.

#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sim/core/units.h"
#include "tests/support/scene_support.h"

namespace touchfield {

// Equality member by member; here, because only these tests need it.
bool operator==(const Placement& a, const Placement& b) {
  return a.landmark == b.landmark && a.at == b.at && a.angles == b.angles;
}
bool operator==(const GridArray& a, const GridArray& b) { return a.count == b.count && a.pitch == b.pitch; }
bool operator==(const Autd3Array& a, const Autd3Array& b) {
  return a.layout == b.layout && a.units == b.units && a.pitch == b.pitch;
}
bool operator==(const SonicsurfaceArray&, const SonicsurfaceArray&) { return true; }
bool operator==(const PositionsArray& a, const PositionsArray& b) {
  return a.points.cols() == b.points.cols() && a.axes.cols() == b.axes.cols() && a.points == b.points &&
         a.axes == b.axes;
}
bool operator==(const PlaneWaveArray& a, const PlaneWaveArray& b) {
  return a.direction == b.direction && a.amplitude == b.amplitude;
}
bool operator==(const FingerJoints& a, const FingerJoints& b) {
  return a.abduction == b.abduction && a.mcp == b.mcp && a.pip == b.pip && a.dip == b.dip;
}
bool operator==(const ThumbJoints& a, const ThumbJoints& b) {
  return a.cmc_flexion == b.cmc_flexion && a.cmc_abduction == b.cmc_abduction && a.cmc_rotation == b.cmc_rotation &&
         a.mcp == b.mcp && a.ip == b.ip;
}
bool operator==(const HandShape& a, const HandShape& b) {
  return a.pose == b.pose && a.breadth == b.breadth && a.length == b.length && a.side == b.side &&
         a.joints.thumb == b.joints.thumb && a.joints.index == b.joints.index && a.joints.middle == b.joints.middle &&
         a.joints.ring == b.joints.ring && a.joints.little == b.joints.little && a.forearm == b.forearm;
}
bool operator==(const SphereShape& a, const SphereShape& b) { return a.radius == b.radius; }
bool operator==(const CapsuleShape& a, const CapsuleShape& b) { return a.radius == b.radius && a.length == b.length; }
bool operator==(const BoxShape& a, const BoxShape& b) { return a.size == b.size; }
bool operator==(const MeshSeries::Mesh& a, const MeshSeries::Mesh& b) {
  return a.file == b.file && a.seconds == b.seconds;
}
bool operator==(const MeshSeries& a, const MeshSeries& b) {
  return a.folder == b.folder && a.times == b.times && a.meshes == b.meshes;
}
bool operator==(const MeshShape& a, const MeshShape& b) {
  return a.series == b.series && a.file == b.file && a.unit == b.unit && a.unit_name == b.unit_name &&
         a.resurface == b.resurface && a.landmarks == b.landmarks;  // a unit that was left out is written
}
bool operator==(const TargetPlace& a, const TargetPlace& b) {
  return a.at == b.at && a.offset == b.offset && a.centre == b.centre;
}
bool operator==(const TargetBoxSpec& a, const TargetBoxSpec& b) {
  const TargetPlace& place = a;
  return place == b && a.size == b.size && a.angles == b.angles && a.level == b.level;
}
bool operator==(const TargetPointSpec& a, const TargetPointSpec& b) {
  const TargetPlace& place = a;
  return place == b && a.diameter == b.diameter && a.level == b.level;
}
bool operator==(const TargetMaskSpec& a, const TargetMaskSpec& b) { return a.file == b.file && a.levels == b.levels; }
bool operator==(const TargetLineSpec& a, const TargetLineSpec& b) {
  return a.points == b.points && a.width == b.width && a.level == b.level;
}
bool operator==(const StartSpec& a, const StartSpec& b) {
  return a.kind == b.kind && a.seed == b.seed && a.restarts == b.restarts && a.file == b.file && a.method == b.method;
}
bool operator==(const MethodSpec& a, const MethodSpec& b) {
  const bool same_options = (!a.kind->iterates || (a.iterations == b.iterations && a.start == b.start)) &&
                            a.free_amplitudes == b.free_amplitudes;
  return a.kind == b.kind && a.name == b.name && a.scheme == b.scheme && same_options && a.phases == b.phases &&
         a.amplitudes == b.amplitudes;
}
bool operator==(const EdgeSpec& a, const EdgeSpec& b) {
  return a.far == b.far && a.near_target == b.near_target && a.near == b.near && a.within == b.within &&
         a.growth == b.growth;
}
bool operator==(const BodySpec& a, const BodySpec& b) {
  return a.name == b.name && a.shape == b.shape && a.place == b.place && a.edge == b.edge &&
         a.keep_within == b.keep_within;
}
bool operator==(const SensingNoise& a, const SensingNoise& b) {
  return a.rms == b.rms && a.correlation == b.correlation && a.offset == b.offset && a.seed == b.seed;
}
bool operator==(const EvaluationSpec& a, const EvaluationSpec& b) {
  return a.kind == b.kind && a.scheme == b.scheme && a.edge == b.edge && a.splits == b.splits;
}
bool operator==(const FieldSpec& a, const FieldSpec& b) {
  return a.name == b.name && a.plane == b.plane && a.centre == b.centre && a.size == b.size && a.spacing == b.spacing;
}
bool operator==(const SineLaw& a, const SineLaw& b) {
  return a.amplitude == b.amplitude && a.hz == b.hz && a.phase == b.phase && a.about == b.about;
}
bool operator==(const KeysLaw& a, const KeysLaw& b) { return a.keys == b.keys; }
bool operator==(const RateLaw& a, const RateLaw& b) { return a.rate == b.rate; }
bool operator==(const MotionChange& a, const MotionChange& b) { return a.path == b.path && a.law == b.law; }
bool operator==(const CirclePath& a, const CirclePath& b) {
  return a.at == b.at && a.radius == b.radius && a.hz == b.hz;
}
bool operator==(const LinePath& a, const LinePath& b) { return a.from == b.from && a.to == b.to && a.hz == b.hz; }
bool operator==(const PointsPath& a, const PointsPath& b) { return a.at == b.at && a.hz == b.hz; }
bool operator==(const PatternSpec::Amplitude& a, const PatternSpec::Amplitude& b) {
  return a.hz == b.hz && a.depth == b.depth;
}
bool operator==(const PatternSpec& a, const PatternSpec& b) {
  return a.path == b.path && a.amplitude == b.amplitude && a.diameter == b.diameter && a.frames_hz == b.frames_hz &&
         a.seconds == b.seconds && a.most_turn == b.most_turn && a.iterations == b.iterations &&
         a.pressure == b.pressure && a.watch == b.watch && a.ring_up == b.ring_up;
}
bool operator==(const MotionSpec& a, const MotionSpec& b) {
  return a.seconds == b.seconds && a.changes == b.changes && a.target == b.target && a.frames_hz == b.frames_hz &&
         a.iterations == b.iterations && a.start == b.start && a.steer == b.steer && a.sensor.hz == b.sensor.hz &&
         a.sensor.latency == b.sensor.latency && a.solve == b.solve && a.array_delay == b.array_delay &&
         a.predict == b.predict && a.score_hz == b.score_hz && a.stale == b.stale;
}

namespace {

using testing::kSmallScene;
using testing::scene_from;
using testing::source_folder;
using testing::TempFolder;

void expect_same(const Scene& a, const Scene& b) {
  EXPECT_EQ(a.name, b.name);
  EXPECT_EQ(a.medium.temperature, b.medium.temperature);
  EXPECT_EQ(a.medium.humidity, b.medium.humidity);
  EXPECT_EQ(a.medium.absorption, b.medium.absorption);
  EXPECT_EQ(a.medium.sound_speed, b.medium.sound_speed);
  EXPECT_EQ(a.medium.density, b.medium.density);
  EXPECT_EQ(a.frequency, b.frequency);
  EXPECT_TRUE(a.array.layout == b.array.layout);
  EXPECT_EQ(a.array.at, b.array.at);
  EXPECT_EQ(a.array.angles, b.array.angles);
  EXPECT_EQ(a.array.directivity, b.array.directivity);
  EXPECT_EQ(a.array.piston_radius, b.array.piston_radius);
  EXPECT_EQ(a.array.level, b.array.level);
  EXPECT_EQ(a.array.source_strength, b.array.source_strength);
  EXPECT_TRUE(a.bodies == b.bodies);
  EXPECT_TRUE(a.sensing == b.sensing);
  ASSERT_EQ(a.target.has_value(), b.target.has_value());
  if (a.target) {
    EXPECT_TRUE(a.target->boxes == b.target->boxes);
    EXPECT_TRUE(a.target->points == b.target->points);
    EXPECT_TRUE(a.target->lines == b.target->lines);
    EXPECT_TRUE(a.target->mask == b.target->mask);
    EXPECT_EQ(a.target->profile, b.target->profile);
    EXPECT_EQ(a.target->pressure, b.target->pressure);
    EXPECT_EQ(a.target->quantity, b.target->quantity);
  }
  EXPECT_TRUE(a.solve.methods == b.solve.methods);
  EXPECT_EQ(a.solve.scheme, b.solve.scheme);
  EXPECT_EQ(a.solve.iterations, b.solve.iterations);
  EXPECT_TRUE(a.solve.start == b.solve.start);
  EXPECT_EQ(a.solve.outside_weight, b.solve.outside_weight);
  EXPECT_EQ(a.solve.optimality_bound, b.solve.optimality_bound);
  EXPECT_TRUE(a.solve.solver == b.solve.solver);
  EXPECT_TRUE(a.evaluation == b.evaluation);
  EXPECT_TRUE(a.fields == b.fields);
  EXPECT_EQ(a.write.h5, b.write.h5);
  EXPECT_EQ(a.write.vtp, b.write.vtp);
  EXPECT_EQ(a.write.vti, b.write.vti);
  EXPECT_EQ(a.write.png, b.write.png);
  EXPECT_EQ(a.write.transfer, b.write.transfer);
  EXPECT_TRUE(a.motion == b.motion);
  EXPECT_TRUE(a.pattern == b.pattern);
}

void expect_round_trip(const Scene& scene) {
  const std::string resolved = resolved_yaml(scene);
  SCOPED_TRACE(resolved);
  const Scene again = scene_from(resolved);
  expect_same(again, scene);
  EXPECT_EQ(resolved_yaml(again), resolved);
}

struct Variant {
  std::string name;
  std::vector<std::string> overrides;  // of the small scene
};

// Every key at a value that is not its default, and every alternative.
const std::vector<Variant> kVariants = {
    {"defaults", {}},
    {"medium",
     {"medium={temperature_c: 21.7, humidity_percent: 33.3, absorption: true, sound_speed_m_s: 344.4, density_kg_m3: "
      "1.19}"}},
    {"temperature_that_rounds", {"medium.temperature_c=-0.1", "medium.humidity_percent=0.1"}},
    {"frequency", {"frequency_khz=40.123456789012345"}},
    {"array",
     {"array={grid: {count: [3, 5], pitch_mm: 10.18}, at_mm: [0.1, 0.2, 0.3], rotate_deg: [12.3, 45.6, -78.9],"
      " directivity: piston, piston_radius_mm: 4.7, level: 0.3, source_pa_m: 3.3}"}},
    {"omni", {"array.directivity=omni"}},
    {"autd3", {"array={autd3: {}}"}},
    {"autd3_layout", {"array={autd3: {layout: [1, 4], pitch_mm: 10.18}}"}},
    {"autd3_units", {"array={autd3: {units: [{at_mm: [0, 0, 0.1]}, {at_mm: [1, 2, 3], rotate_deg: [1, 2, 3]}]}}"}},
    {"sonicsurface", {"array={sonicsurface: {}}"}},
    {"positions", {"array={positions: {points_mm: [[0.1, 0.2, 0.3], [1, 2, 3]]}}"}},
    {"axes", {"array={positions: {points_mm: [[0, 0, 0], [1, 2, 3]], axes: [[1, 2, 3], [-1e-5, 7, 0.3]]}}"}},
    {"plane_wave", {"array={plane_wave: {direction: [1, 1, 1], amplitude_pa: 0.7}}"}},
    {"hand", {"body={hand: {pose: flat, breadth_mm: 78.2, length_mm: 181.1, side: left}, edge_mm: 3.3}"}},
    {"forearm", {"body={hand: {forearm_mm: 123.4}}"}},
    {"joints",
     {"body={hand: {pose: fist, joints: {thumb: {cmc_flexion_deg: -3.3, ip_deg: 7.7}, little: {abduction_deg: 11.1, "
      "mcp_deg: 22.2, pip_deg: 33.3, dip_deg: -4.4}}}, edge_mm: 3.3}"}},
    {"skin_methods",
     {"solve.methods=[{surface: {free_amplitudes: true, start: {random: 3, restarts: 4}}}, gs, wgs, gs_pat, eigen, "
      "{lbfgs: {iterations: 17, start: spectral}}, {surface: {as: third, start: adjoint}}]",
      "target={box: {at: top, size_mm: [4, 4, 4]}}", "solve.outside_weight=0.35", "solve.optimality_bound=true"}},
    {"capsule", {"body={capsule: {radius_mm: 8.3, length_mm: 60.1}, edge_mm: 1.1}"}},
    {"box", {"body={box: {size_mm: [10.1, 20.2, 30.3]}, edge_mm: 1.1}"}},
    {"mesh", {"body={mesh: {file: 'a folder/it''s: #1 hand.stl', unit: cm, landmarks: {tip: [0.1, 0.7, -3.3]}}}"}},
    {"mesh_in_metres", {"body={mesh: {file: hand.obj, unit: m, landmarks: {b: [0, 0, 0], a: [1, 1, 1]}}}"}},
    {"place", {"body.place={landmark: top, at_mm: [0.1, 0.7, 200.3], rotate_deg: [0.1, 33.3, 359.9]}"}},
    {"target",
     {"target={box: {at: top, offset_mm: [0.1, 0, 0], size_mm: [8, 40, 6], rotate_deg: [0, 0, 45]}, "
      "profile: penetration, pressure_pa: 3000.7}"}},
    {"target_centre", {"target={box: {centre_mm: [0, 0.1, 200], size_mm: [8, 40, 6]}, pressure_pa: best}"}},
    {"target_radiation", {"target={box: {at: top, size_mm: [8, 40, 6]}, radiation_pa: 27.7}"}},
    {"target_boxes", {"target={boxes: [{at: top, size_mm: [8, 40, 6]}, {centre_mm: [0, 0, 7], size_mm: [1, 2, 3]}]}"}},
    {"target_levels", {"target={boxes: [{at: top, size_mm: [8, 40, 6], level: 0.3}]}"}},
    {"target_drawn",
     {"target={points: [{at: top, offset_mm: [1.1, 0, 0], diameter_mm: 7.7, level: 0.1}], lines: [{points: [{at: top}, "
      "{centre_mm: [0, 0.1, 7]}, {at: bottom}], width_mm: 2.3, level: 0.7}, {points: [{at: bottom}, {at: top}], "
      "width_mm: 3}]}"}},
    {"target_box_and_line",
     {"target={box: {at: top, size_mm: [8, 40, 6]}, lines: [{points: [{at: top}, {at: bottom}], width_mm: 2.3}]}"}},
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
    {"schemes", {"solve={methods: [{fixed: {phases_rad: 0, scheme: chief}}], scheme: burton_miller}"}},
    {"solver",
     {"solve={methods: [{fixed: {phases_rad: 0}}], solver: lu, precision: double, tolerance: 1e-13, refine: false, "
      "max_steps: 7, resonance_check: always, coupling: 0.3, split_ratio: 1.1}"}},
    {"gmres", {"solve.solver=gmres", "solve.precision=single", "solve.resonance_check=never"}},
    {"matrix_free", {"solve.solver=matrix_free"}},
    {"fft", {"solve.solver=fft"}},
    {"no_evaluation", {"evaluation=none"}},
    {"evaluation_with_its_own_edge", {"evaluation={scheme: paper_corrected, edge_mm: 0.7}"}},
    {"evaluation_of_one_edge", {"evaluation={scheme: chief, edge_mm: 0.7}"}},
    {"evaluation_graded", {"evaluation={scheme: chief, edge_mm: {far: 2.1, near_target: 0.7, within_mm: 11.3}}"}},
    {"graded", {"body.edge_mm={far: 3.3, near_target: 1.1, near: {top: 1.3, y_plus: 0.9}, growth: 0.31}"}},
    {"kept", {"body.keep_within_mm=33.3"}},
    {"evaluation_of_the_scene", {"evaluation=same"}},
    {"sensing", {"sensing={noise_mm_rms: 0.55, correlation_mm: 7.7, offset_mm: [0.1, -0.2, 0.3], seed: 77}"}},
    {"evaluation_with_split_faces", {"evaluation={split: 2}"}},
    {"write", {"write=[png, h5]"}},
    {"write_transfer", {"write=[transfer]", "target={box: {at: top, size_mm: [4, 4, 4]}}"}},
    {"motion", {"motion={seconds: 0.7}"}},
    {"pattern_circle",
     {"target={box: {at: bottom, size_mm: [8, 8, 4]}, pressure_pa: 500}", "pattern={circle: {at: bottom}}"}},
    {"pattern_line",
     {"target={box: {at: bottom, size_mm: [8, 8, 4]}, pressure_pa: 500}",
      "pattern={line: {from: [-3.3, 0, 50.1], to: bottom, hz: 33.3}, amplitude: {hz: 71, depth: 0.3}, diameter_mm: "
      "3.7, frames_per_second: 777, seconds: 0.7, most_turn_deg: 33.3, iterations: 7, pressure_pa: 333.3, watch: "
      "[bottom, top], ring_up_ms: 0.7}"}},
    {"pattern_points",
     {"target={box: {at: bottom, size_mm: [8, 8, 4]}, pressure_pa: 500}",
      "pattern={points: {at: [bottom, [1.1, 2.2, 55.5]]}}"}},
    {"motion_of_all",
     {"motion={seconds: 2.1, change: [{path: body.place.at_mm.2, sine: {amplitude: 10.1, hz: 1.3, phase_deg: 33.3, "
      "about: 200.7}}, {path: body.place.rotate_deg.0, keys: [[0, 0.1], [0.5, -7.3], [2.1, 3]]}, {path: "
      "body.place.at_mm.0, rate: -50.3}], target: in_world, frames_hz: 29.97, iterations: 7, start: zero, steer: "
      "false, sensor: {hz: 59.94, latency_ms: 12.3}, solve_ms: 20.7, array_ms: 0.3, predict: linear, score_hz: "
      "60.1, stale_ms: 99.9}"}},
    {"large_and_small", {"array.at_mm=[1e9, -1e-30, 123456789.01234567]", "array.source_pa_m=1e-9"}},
};

class RoundTrip : public ::testing::TestWithParam<Variant> {};

TEST_P(RoundTrip, ReadsBackTheSame) { expect_round_trip(scene_from(kSmallScene, GetParam().overrides)); }

INSTANTIATE_TEST_SUITE_P(ResolvedScene, RoundTrip, ::testing::ValuesIn(kVariants),
                         [](const auto& info) { return info.param.name; });

TEST(ResolvedScene, WritesNumbersAsAUserWould) {
  const std::string text = resolved_yaml(scene_from(
      kSmallScene, {"array.at_mm=[0.1, 200, -7.25]", "array.rotate_deg=[90, 33.3, 0.1]", "medium.temperature_c=21.7"}));
  EXPECT_THAT(text, ::testing::HasSubstr("  at_mm: [0.1, 200, -7.25]\n  rotate_deg: [90, 33.3, 0.1]\n"));
  EXPECT_THAT(text, ::testing::HasSubstr("temperature_c: 21.7\n"));
  EXPECT_THAT(text, ::testing::HasSubstr("pitch_mm: 10.16\n"));
  EXPECT_THAT(text, ::testing::HasSubstr("radius_mm: 8\n"));
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

TEST(ResolvedScene, HoldsASeriesOfMeshes) {
  const TempFolder folder;
  folder.write("a.obj", "");
  folder.write("b.obj", "");
  const auto times = folder.write("times.csv", "time_s, file  # of a tracker\n\n-0.04, a.obj\n0.1,b.obj\n");
  const Scene scene = read_scene(folder.write("scene.yaml", kSmallScene),
                                 {"body={meshes: {folder: " + folder.path().string() + ", times: " + times +
                                  ", unit: cm, landmarks: {tip: [1, 2, 3]}}}"});
  const auto& mesh = std::get<MeshShape>(scene.bodies[0].shape);
  ASSERT_EQ(mesh.series->meshes.size(), 2U);
  EXPECT_EQ(mesh.series->meshes[1].file, (folder.path() / "b.obj").string());
  EXPECT_EQ(mesh.series->meshes[0].seconds, -0.04);
  EXPECT_EQ(mesh.file, mesh.series->meshes[0].file);
  EXPECT_EQ(mesh.landmarks.at("tip"), Vector3(1e-2, 2e-2, 3e-2));
  expect_round_trip(scene);
}

TEST(ResolvedScene, WritesEveryDefaultOfAMotion) {
  const std::string text = resolved_yaml(scene_from(kSmallScene, {"motion={seconds: 2}"}));
  EXPECT_THAT(text, ::testing::HasSubstr(
                        "motion:\n  seconds: 2\n  change: []\n  target: on_skin\n  frames_hz: 20\n  iterations: 5\n"
                        "  start: previous\n  steer: true\n  sensor:\n    hz: 30\n    latency_ms: 0\n"
                        "  solve_ms: measured\n  array_ms: 1\n  predict: kalman\n  score_hz: 61\n  stale_ms: 150\n"));
  EXPECT_EQ(resolved_yaml(scene_from(kSmallScene)).find("motion"), std::string::npos);
}

TEST(ResolvedScene, HoldsLongListsOfPhases) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> angle(-4, 4);
  Scene scene = scene_from(kSmallScene);
  for (int i = 0; i < 1500; ++i) scene.solve.methods[0].phases.push_back(angle(random));
  expect_round_trip(scene);
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

TEST(ResolvedScene, HoldsAnyAngleThatASceneCanGive) {
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> degrees(-360, 360);
  Scene scene = scene_from(kSmallScene);
  for (int i = 0; i < 200; ++i) {
    scene.array.angles = Vector3(degrees(random), degrees(random), degrees(random)) * kDegree;
    scene.medium.temperature = degrees(random) / 10 + kZeroCelsius;
    expect_round_trip(scene);
  }
}

// The template is one of them.
TEST(ResolvedScene, HoldsTheShippedScenes) {
  int count = 0;
  for (const auto& file : std::filesystem::directory_iterator(source_folder() / "scenes")) {
    if (file.path().extension() != ".yaml") continue;
    SCOPED_TRACE(file.path());
    const Scene scene = read_scene(file.path().string(), {});
    EXPECT_TRUE(testing::text_of(file.path()).starts_with("# ")) << "says what it is";
    EXPECT_EQ(scene.name, file.path().stem().string());
    expect_round_trip(scene);
    ++count;
  }
  EXPECT_GE(count, 3);
}

}  // namespace
}  // namespace touchfield
