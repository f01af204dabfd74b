// A resolved scene is a scene that reads back the same, to the bit.

#include <random>
#include <tuple>

#include "sim/core/units.h"
#include "tests/support/scene_support.h"
#include "tests/support/testing.h"

namespace touchfield {

// The members that a resolved scene holds; here, because only these tests need them.
auto members(const Placement& a) { return std::tie(a.landmark, a.at, a.angles); }
auto members(const GridArray& a) { return std::tie(a.count, a.pitch); }
auto members(const Autd3Array& a) { return std::tie(a.layout, a.units, a.pitch); }
auto members(const SonicsurfaceArray&) { return std::tuple<>(); }
auto members(const PlaneWaveArray& a) { return std::tie(a.direction, a.amplitude); }
auto members(const CalibrationSpec& a) { return std::tie(a.gain, a.phase, a.in); }
auto members(const ToleranceSpec& a) { return std::tie(a.gain, a.phase, a.dead, a.seed, a.in); }
auto members(const FingerJoints& a) { return std::tie(a.abduction, a.mcp, a.pip, a.dip); }
auto members(const ThumbJoints& a) { return std::tie(a.cmc_flexion, a.cmc_abduction, a.cmc_rotation, a.mcp, a.ip); }
auto members(const HandJoints& a) { return std::tie(a.thumb, a.index, a.middle, a.ring, a.little); }
auto members(const HandShape& a) { return std::tie(a.pose, a.breadth, a.length, a.side, a.joints, a.forearm); }
auto members(const SphereShape& a) { return std::tie(a.radius); }
auto members(const CapsuleShape& a) { return std::tie(a.radius, a.length); }
auto members(const BoxShape& a) { return std::tie(a.size); }
auto members(const MeshSeries::Mesh& a) { return std::tie(a.file, a.seconds); }
auto members(const MeshSeries& a) { return std::tie(a.folder, a.times, a.meshes); }
auto members(const MeshShape& a) {  // a unit that was left out is written
  return std::tie(a.series, a.file, a.unit, a.unit_name, a.resurface, a.landmarks);
}
auto members(const TargetPlace& a) { return std::tie(a.at, a.offset, a.centre); }
auto members(const TargetBoxSpec& a) { return std::tie(a.at, a.offset, a.centre, a.size, a.angles, a.level); }
auto members(const TargetPointSpec& a) { return std::tie(a.at, a.offset, a.centre, a.diameter, a.level); }
auto members(const TargetMaskSpec& a) { return std::tie(a.file, a.levels); }
auto members(const TargetLineSpec& a) { return std::tie(a.points, a.width, a.level); }
auto members(const TargetSpec& a) {
  return std::tie(a.boxes, a.points, a.lines, a.mask, a.profile, a.pressure, a.quantity);
}
auto members(const StartSpec& a) { return std::tie(a.kind, a.seed, a.restarts, a.file, a.method, a.among); }
auto members(const ChannelTolerances& a) { return std::tie(a.gain, a.phase, a.dead); }
auto members(const MethodSpec& a) {
  static constexpr int kNone = 0;
  static const StartSpec none;
  return std::tie(a.kind, a.name, a.scheme, a.kind->iterates ? a.iterations : kNone, a.kind->iterates ? a.start : none,
                  a.free_amplitudes, a.free_level, a.tolerances, a.faces, a.phases, a.amplitudes);
}
auto members(const EdgeSpec& a) { return std::tie(a.far, a.near_target, a.near, a.within, a.growth); }
auto members(const BodySpec& a) { return std::tie(a.name, a.shape, a.place, a.edge, a.keep_within); }
auto members(const SensingNoise& a) { return std::tie(a.rms, a.correlation, a.offset, a.seed); }
auto members(const EvaluationSpec& a) { return std::tie(a.kind, a.scheme, a.edge, a.splits); }
auto members(const FieldSpec& a) { return std::tie(a.name, a.plane, a.centre, a.size, a.spacing); }
auto members(const SineLaw& a) { return std::tie(a.amplitude, a.hz, a.phase, a.about); }
auto members(const KeysLaw& a) { return std::tie(a.keys); }
auto members(const RateLaw& a) { return std::tie(a.rate); }
auto members(const MotionChange& a) { return std::tie(a.path, a.law); }
auto members(const CirclePath& a) { return std::tie(a.at, a.radius, a.hz); }
auto members(const LinePath& a) { return std::tie(a.from, a.to, a.hz); }
auto members(const PointsPath& a) { return std::tie(a.at, a.hz); }
auto members(const PatternSpec::Amplitude& a) { return std::tie(a.hz, a.depth); }
auto members(const PatternSpec& a) {
  return std::tie(a.path, a.amplitude, a.method, a.diameter, a.frames_hz, a.seconds, a.most_turn, a.iterations,
                  a.pressure, a.watch, a.ring_up);
}
auto members(const MotionSpec& a) {
  return std::tie(a.seconds, a.changes, a.target, a.frames_hz, a.iterations, a.start, a.steer, a.sensor.hz,
                  a.sensor.latency, a.solve, a.array_delay, a.predict, a.score_hz, a.stale);
}
auto members(const FeltSpec& a) {
  return std::tie(a.layers, a.bone, a.shear, a.tan_delta, a.modulation_hz, a.frames_hz, a.highest_hz, a.at, a.points,
                  a.reference);
}
auto members(const MediumSpec& a) {
  return std::tie(a.temperature, a.humidity, a.absorption, a.sound_speed, a.density);
}
auto members(const WriteSpec& a) { return std::tie(a.h5, a.vtp, a.vti, a.png, a.transfer); }

bool operator==(const PositionsArray& a, const PositionsArray& b) {
  return a.points.cols() == b.points.cols() && a.axes.cols() == b.axes.cols() && a.points == b.points &&
         a.axes == b.axes;
}
template <class T>
requires requires(const T& a) { members(a); }
bool operator==(const T& a, const T& b) { return members(a) == members(b); }

namespace {

void expect_same(const Scene& a, const Scene& b) {
  EXPECT_EQ(std::tie(a.name, a.frequency), std::tie(b.name, b.frequency));
  EXPECT_TRUE(a.medium == b.medium);
  const auto array = [](const ArraySpec& of) {
    return std::tie(of.layout, of.at, of.angles, of.directivity, of.piston_radius, of.level, of.source_strength,
                    of.calibration, of.tolerances, of.phase_levels);
  };
  EXPECT_TRUE(array(a.array) == array(b.array));
  EXPECT_TRUE(a.bodies == b.bodies);
  EXPECT_TRUE(a.sensing == b.sensing);
  EXPECT_TRUE(a.target == b.target);
  const auto solve = [](const SolveSpec& of) {
    return std::tie(of.methods, of.scheme, of.iterations, of.start, of.outside_weight, of.optimality_bound,
                    of.allow_coarse_mesh, of.solver);
  };
  EXPECT_TRUE(solve(a.solve) == solve(b.solve));
  EXPECT_TRUE(a.evaluation == b.evaluation);
  EXPECT_TRUE(a.fields == b.fields);
  EXPECT_TRUE(a.write == b.write);
  EXPECT_TRUE(a.motion == b.motion);
  EXPECT_TRUE(a.pattern == b.pattern);
  EXPECT_TRUE(a.felt == b.felt);
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
    {"frequency", {"frequency_khz=40.123456789012345", "medium.temperature_c=-0.1", "medium.humidity_percent=0.1"}},
    {"array",
     {"array={grid: {count: [3, 5], pitch_mm: 10.18}, at_mm: [0.1, 0.2, 0.3], rotate_deg: [12.3, 45.6, -78.9],"
      " directivity: piston, piston_radius_mm: 4.7, level: 0.3, source_pa_m: 3.3}"}},
    {"autd3_layout", {"array={autd3: {layout: [1, 4], pitch_mm: 10.18}}", "solve.scheme=chief"}},
    {"autd3_units", {"array={autd3: {units: [{at_mm: [0, 0, 0.1]}, {at_mm: [1, 2, 3], rotate_deg: [1, 2, 3]}]}}"}},
    {"sonicsurface", {"array={sonicsurface: {}}"}},
    {"axes", {"array={positions: {points_mm: [[0, 0, 0], [1, 2, 3]], axes: [[1, 2, 3], [-1e-5, 7, 0.3]]}}"}},
    {"plane_wave", {"array={plane_wave: {direction: [1, 1, 1], amplitude_pa: 0.7}}"}},
    {"hand", {"body={hand: {pose: flat, breadth_mm: 78.2, length_mm: 181.1, side: left}, edge_mm: 3.3}"}},
    {"joints",
     {"body={hand: {pose: fist, joints: {thumb: {cmc_flexion_deg: -3.3, ip_deg: 7.7}, little: {abduction_deg: 11.1, "
      "mcp_deg: 22.2, pip_deg: 33.3, dip_deg: -4.4}}}, edge_mm: 3.3}"}},
    {"skin_methods",
     {"solve.methods=[{surface: {free_amplitudes: true, start: {random: 3, restarts: 4}}}, gs, wgs, gs_pat, eigen, "
      "{lbfgs: {iterations: 17, start: spectral}}, {surface: {as: third, start: adjoint}}]",
      "target={box: {at: top, size_mm: [4, 4, 4]}}", "solve.outside_weight=0.35", "solve.optimality_bound=true"}},
    {"capsule", {"body={capsule: {radius_mm: 8.3, length_mm: 60.1}, edge_mm: 1.1, keep_within_mm: 33.3}"}},
    {"responses",
     {"array={grid: {count: [2, 1]}, directivity: omni, calibration: {gain: [1.1, 0], phase_rad: [0.1, -3], in: "
      "truth}, "
      "tolerances: {gain_percent: 5, phase_deg: 10, dead_percent: 1, seed: 7, in: both}, phase_levels: 16}"}},
    {"felt", {"felt={layers: half_space, shear_kpa: 31.3, tan_delta: 0.3, at_mm: [0, 0.1, -8]}"}},
    {"box", {"body={box: {size_mm: [10.1, 20.2, 30.3]}, edge_mm: 1.1}"}},
    {"mesh", {"body={mesh: {file: 'a folder/it''s: #1 hand.stl', unit: cm, landmarks: {tip: [0.1, 0.7, -3.3]}}}"}},
    {"place", {"body.place={landmark: top, at_mm: [0.1, 0.7, 200.3], rotate_deg: [0.1, 33.3, 359.9]}"}},
    {"target",
     {"target={box: {at: top, offset_mm: [0.1, 0, 0], size_mm: [8, 40, 6], rotate_deg: [0, 0, 45]}, "
      "profile: penetration, pressure_pa: 3000.7}"}},
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
    {"solver",
     {"solve={methods: [{fixed: {phases_rad: 0}}], solver: lu, precision: double, tolerance: 1e-13, refine: false, "
      "max_steps: 7, resonance_check: always, coupling: 0.3, split_ratio: 1.1}"}},
    {"gmres", {"solve.solver=gmres", "solve.precision=single", "solve.resonance_check=never", "evaluation=same"}},
    {"evaluation_with_its_own_edge", {"evaluation={scheme: paper_corrected, edge_mm: 0.7}"}},
    {"evaluation_graded", {"evaluation={scheme: chief, edge_mm: {far: 2.1, near_target: 0.7, within_mm: 11.3}}"}},
    {"graded", {"body.edge_mm={far: 3.3, near_target: 1.1, near: {top: 1.3, y_plus: 0.9}, growth: 0.31}"}},
    {"sensing", {"sensing={noise_mm_rms: 0.55, correlation_mm: 7.7, offset_mm: [0.1, -0.2, 0.3], seed: 77}"}},
    {"evaluation_with_split_faces", {"evaluation={split: 2}"}},
    {"write", {"write=[png, h5]", "evaluation=none"}},
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
  EXPECT_THAT(text,
              HasSubstr("motion:\n  seconds: 2\n  change: []\n  target: on_skin\n  frames_hz: 20\n  iterations: 5\n"
                        "  start: previous\n  steer: true\n  sensor:\n    hz: 30\n    latency_ms: 0\n"
                        "  solve_ms: measured\n  array_ms: 1\n  predict: kalman\n  score_hz: 61\n  stale_ms: 150\n"));
  EXPECT_EQ(resolved_yaml(scene_from(kSmallScene)).find("motion"), std::string::npos);
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
    EXPECT_EQ(scene.name, file.path().stem().string());
    expect_round_trip(scene);
    ++count;
  }
  EXPECT_GE(count, 3);
}

}  // namespace
}  // namespace touchfield
