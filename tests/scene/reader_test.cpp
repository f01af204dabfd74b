#include <algorithm>
#include <numbers>
#include <regex>

#include "sim/scene/scene_reader.h"
#include "sim/scene/shipped_scenes.h"
#include "tests/support/scene_support.h"
#include "tests/support/testing.h"

namespace touchfield {
namespace {

// ---- Scenes with faults: each file in tests/data/scenes_bad ends with the messages it must cause, as comments
// "# expect LINE:COLUMN: ...". DIR stands for the folder.

std::filesystem::path bad_folder() { return source_folder() / "tests/data/scenes_bad"; }

std::vector<std::string> bad_scenes() {
  std::vector<std::string> names;
  for (const auto& file : std::filesystem::directory_iterator(bad_folder())) {
    if (file.path().extension() == ".yaml") names.push_back(file.path().stem().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

std::vector<std::string> expected_problems(const std::filesystem::path& file) {
  const std::string folder = file.parent_path().string();
  std::vector<std::string> expected;
  for (const auto& line : lines_of(text_of(file))) {
    const std::string here = "# expect ";
    if (!line.starts_with(here)) continue;
    std::string text = file.string() + ":" + line.substr(here.size());
    if (const auto at = text.find("DIR"); at != std::string::npos) text.replace(at, 3, folder);
    expected.push_back(text);
  }
  return expected;
}

class BadScene : public ::testing::TestWithParam<std::string> {};

TEST_P(BadScene, IsRefusedWithTheMessagesItSays) {
  const auto file = bad_folder() / (GetParam() + ".yaml");
  const auto expected = expected_problems(file);
  ASSERT_FALSE(expected.empty());
  EXPECT_EQ(problems_of(file.string()), expected);
}

INSTANTIATE_TEST_SUITE_P(SceneReader, BadScene, ::testing::ValuesIn(bad_scenes()),
                         [](const auto& info) { return info.param; });

TEST(SceneReader, WhatIsNoSceneFileIsRefused) {
  const TempFolder folder;
  EXPECT_THAT(problems_of("no/such/scene.yaml"), ElementsAre("no/such/scene.yaml: no such file"));
  const std::string path = folder.path().string();
  EXPECT_THAT(problems_of(path), ElementsAre(path + ": a directory, must be a file"));
  std::string aliases = "a0: &a0 [1, 1, 1, 1, 1, 1, 1, 1, 1, 1]\n";
  for (int i = 1; i <= 9; ++i) {
    const std::string alias = "*a" + std::to_string(i - 1);
    aliases += "a" + std::to_string(i) + ": &a" + std::to_string(i) + " [" + alias;
    for (int k = 1; k < 10; ++k) aliases += ", " + alias;
    aliases += "]\n";
  }
  std::string long_aliases = "a: &a " + std::string(1'000'000, 'x') + "\nb: [*a";
  for (int i = 1; i < 20'000; ++i) long_aliases += ", *a";
  const std::pair<std::string, const char*> table[] = {
      {"", ":1:1: empty, a scene must be a map of keys"},
      {std::string("\x7f"
                   "ELF\x02\x01\0\0",
                   8),
       ":1:1: byte 0x7f is not UTF-8 text"},
      {aliases, "more than 200000 values up to here"},
      {long_aliases + "]\n", "more than 200000 values up to here"},
      {"name: " + std::string(60, '[') + std::string(60, ']'), "nested deeper than 50 levels"},
      {"name: " + std::string(20000, '['), "not YAML: "},
  };
  for (const auto& [text, phrase] : table) {
    EXPECT_THAT(problems_of(folder.write("scene.yaml", text)), ElementsAre(HasSubstr(phrase)));
  }
}

TEST(SceneReader, ASlipIsNamedWithItsRemedy) {
  const std::pair<const char*, const char*> table[] = {
      {"body={hand: {breadth_mm: 0.088}}", "breadth_mm = 0.088 must be 50 to 150; if 0.088 is in metres write 88"},
      {"body={hand: {breadth_mm: 8.8}}", "; if 8.8 is in centimetres write 88"},
      {"frequency_khz=40000", "; if 40000 is in Hz write 40"},
      {"medium.temperature_c=293.15", "; if 293.15 is in kelvin write 20"},
      {"array.level=80", "; if 80 is in percent write 0.8"},
      {"array.calibration={gain: [98], phase_rad: [0]}", "array.calibration.gain[0] = 98 must be 0 to 10; if 98 is in"},
      {"array.grid.count=[1000, 1000]", "array: 1000000 transducers, must be at most 100000"},
      {"target={box: {at_mm: [0, 0, 1], size_mm: [1, 1, 1]}}",
       "target.box.at_mm: unknown key, did you mean centre_mm?"},
      {"target={pressure_pa:1000}", "unknown key; a blank must follow the colon of pressure_pa"},
      {"solve=methods:[surface]", "must be a map; a blank must follow the colon of methods"}};
  for (const auto& [change, says] : table) {
    EXPECT_THAT(message_of<InputError>([&] { scene_from(kSmallScene, {change}); }), HasSubstr(says)) << change;
  }
  // A scene that a program wrote has no lines.
  EXPECT_THAT(message_of<InputError>([&] { read_scene_text("{name: a b}", "", ""); }),
              AllOf(HasSubstr("\nname = a b must be"), Not(HasSubstr(":1:"))));
}

TEST(SceneReader, ReadsLinesOfWindows) {
  const TempFolder folder;
  const std::string text = kSmallScene;
  const auto file = folder.write("scene.yaml", "\xEF\xBB\xBF" + std::regex_replace(text, std::regex("\n"), "\r\n"));
  EXPECT_EQ(resolved_yaml(read_scene(file)), resolved_yaml(scene_from(text)));
}

TEST(SceneReader, TakesAnchorsAndTheKeysOfMergedMaps) {
  const std::string shared = "bodies:\n  - &finger {name: one, sphere: {radius_mm: 8}, edge_mm: 3}\n  - ";
  const std::string others =
      "\nname: merge\narray: {grid: {count: [4, 4]}}\nsolve: {methods: [{fixed: {phases_rad: 0}}]}\n";
  const auto second = [&](const std::string& body) { return scene_from(shared + body + others).bodies[1]; };
  const BodySpec merged = second("{<<: *finger, name: two, place: {at_mm: [30, 0, 0]}}");
  EXPECT_EQ(merged.name, "two");
  EXPECT_DOUBLE_EQ(std::get<SphereShape>(merged.shape).radius, 8e-3);
  EXPECT_DOUBLE_EQ(merged.place.at.x(), 30e-3);
  const Placement twice = second("{<<: *finger, name: two, place: {at_mm: &a [30, 0, 0], rotate_deg: *a}}").place;
  EXPECT_DOUBLE_EQ(twice.angles.x(), std::numbers::pi / 6);
  // The map's own keys come first, then those of the first map in a list.
  EXPECT_DOUBLE_EQ(second("{name: two, edge_mm: 2, <<: *finger}").edge->far, 2e-3);
  EXPECT_DOUBLE_EQ(second("{name: two, <<: [{edge_mm: 4}, *finger]}").edge->far, 4e-3);
}

// A list of a thousand faults would hide the first.
TEST(SceneReader, ReportsTheFirstHundredProblemsAndCountsTheRest) {
  const TempFolder folder;
  std::string text = "name: many\n";
  for (int i = 0; i < 130; ++i) text += "unknown_key_" + std::to_string(i) + ": 1\n";
  const auto file = folder.write("many.yaml", text);
  const auto problems = problems_of(file);
  ASSERT_EQ(problems.size(), 101U);
  // 130 unknown keys and the missing array, body and solve.
  EXPECT_EQ(problems.back(), file + ": and 33 problems more");
}

TEST(SceneReader, FillsInTheDefaults) {
  const Scene scene = scene_from(kSmallScene);
  EXPECT_EQ(scene.frequency, 40e3);
  EXPECT_EQ(scene.medium.temperature, 293.15);
  const auto& grid = std::get<GridArray>(scene.array.layout);
  EXPECT_THAT(grid.count, ElementsAre(44, 34));
  EXPECT_EQ(grid.pitch, 10.16e-3);
  EXPECT_EQ(scene.array.source_strength, 4.386);
  EXPECT_EQ(scene.solve.solver.tolerance, 1e-4);
  EXPECT_EQ(scene.evaluation.kind, EvaluationSpec::Kind::kAuto);
  EXPECT_TRUE(scene.write.h5 && scene.write.vtp && scene.write.vti && scene.write.png);
  const ArraySpec units = scene_from(kSmallScene, {"array={autd3: {}}"}).array;
  EXPECT_THAT(*std::get<Autd3Array>(units.layout).layout, ElementsAre(3, 2));
}

TEST(SceneReader, GivesAHandItsUsualEdges) {
  const Scene pressed =
      scene_from(kSmallScene, {"body={hand: {}}", "target={box: {at: index_pad, size_mm: [8, 8, 6]}}"});
  const EdgeSpec& graded = *pressed.bodies.at(0).edge;
  EXPECT_EQ(graded.far, UsualHandEdges::kFar);
  EXPECT_EQ(graded.near_target, UsualHandEdges::kNearTarget);
  EXPECT_EQ(graded.within, UsualHandEdges::kWithin);
  EXPECT_THAT(resolved_yaml(pressed), AllOf(HasSubstr("near_target: 1.2"), HasSubstr("forearm_mm: 250")));
  const Scene bare = scene_from(kSmallScene, {"body={hand: {}}"});
  EXPECT_FALSE(bare.bodies.at(0).edge->graded());
  EXPECT_EQ(bare.bodies.at(0).edge->far, UsualHandEdges::kWithoutTarget);
}

// The SI value is the double nearest to the written decimal, not a product with a rounded 0.001.
TEST(SceneReader, ConvertsUnits) {
  const Scene scene = scene_from(
      "name: units\n"
      "medium: {temperature_c: 25, humidity_percent: 35, absorption: true, sound_speed_m_s: 346.1, density_kg_m3: "
      "1.18}\n"
      "frequency_khz: 25.3\n"
      "array: {plane_wave: {direction: [0, 3, -4], amplitude_pa: 2.5}, at_mm: [1, -2.3, 1e2], rotate_deg: [90, 0, "
      "-180]}\n"
      "body: {capsule: {radius_mm: 8.1, length_mm: 0}, edge_mm: 1.9}\n"
      "solve: {methods: [{fixed: {phases_rad: [0.5, 1]}}]}\n");
  EXPECT_EQ(scene.medium.temperature, 298.15);
  EXPECT_EQ(scene.medium.humidity, 0.35);
  EXPECT_TRUE(scene.medium.absorption);
  EXPECT_EQ(scene.medium.sound_speed, 346.1);
  EXPECT_EQ(scene.medium.density, 1.18);
  EXPECT_EQ(scene.frequency, 25.3e3);
  const auto& wave = std::get<PlaneWaveArray>(scene.array.layout);
  EXPECT_EQ(wave.direction, Vector3(0, 0.6, -0.8));
  EXPECT_EQ(wave.amplitude, 2.5);
  EXPECT_EQ(scene.array.at, Vector3(1e-3, -2.3e-3, 0.1));
  EXPECT_EQ(scene.array.angles, Vector3(std::numbers::pi / 2, 0, -std::numbers::pi));
  EXPECT_EQ(std::get<CapsuleShape>(scene.bodies.at(0).shape).radius, 8.1e-3);
  EXPECT_EQ(scene.bodies.at(0).edge->far, 1.9e-3);
}

TEST(SceneReader, MethodsTakeTheDefaultsOfSolveWhereverTheyStand) {
  const Scene scene = scene_from(
      "name: methods\n"
      "array: {grid: {}}\n"
      "body: {sphere: {radius_mm: 8}, edge_mm: 2}\n"
      "target: {box: {at: bottom, size_mm: [8, 8, 8]}, pressure_pa: 3e3}\n"
      "solve:\n"
      "  methods:\n"
      "    - paper\n"
      "    - paper: {as: longer, iterations: 50, start: zero}\n"
      "    - unscattered: {}\n"
      "  iterations: 7\n"
      "  start: {random: 11}\n");
  ASSERT_EQ(scene.solve.methods.size(), 3U);
  EXPECT_EQ(scene.solve.methods[0].iterations, 7);
  EXPECT_EQ(scene.solve.methods[0].start.kind, StartSpec::Kind::kRandom);
  EXPECT_EQ(scene.solve.methods[0].start.seed, 11U);
  EXPECT_EQ(scene.solve.methods[1].name, "longer");
  EXPECT_EQ(scene.solve.methods[1].iterations, 50);
  EXPECT_EQ(scene.solve.methods[1].start.kind, StartSpec::Kind::kZero);
  EXPECT_EQ(scene.solve.methods[2].kind->name, "unscattered");
  EXPECT_EQ(scene.solve.methods[2].iterations, 7);
  EXPECT_EQ(scene.target->pressure, 3000.0);
}

TEST(SceneReader, PutsAPlanesSizeOnItsAxes) {
  const Scene scene = scene_from(kSmallScene +
                                 "field:\n"
                                 "  - {name: a, plane: xy, through_mm: [1, 2, 3], size_mm: [10, 20]}\n"
                                 "  - {name: b, plane: xz, through_mm: [1, 2, 3], size_mm: [10, 20]}\n"
                                 "  - {name: c, plane: yz, through_mm: [1, 2, 3], size_mm: [10, 20], spacing_mm: 0.5}\n"
                                 "  - {name: d, centre_mm: [1, 2, 3], size_mm: [10, 20, 30]}\n");
  ASSERT_EQ(scene.fields.size(), 4U);
  EXPECT_EQ(scene.fields[0].size, Vector3(10e-3, 20e-3, 0));
  EXPECT_EQ(scene.fields[1].size, Vector3(10e-3, 0, 20e-3));
  EXPECT_EQ(scene.fields[2].size, Vector3(0, 10e-3, 20e-3));
  EXPECT_EQ(scene.fields[3].size, Vector3(10e-3, 20e-3, 30e-3));
  EXPECT_EQ(scene.fields[3].plane, "");
  for (const auto& field : scene.fields) EXPECT_EQ(field.centre, Vector3(1e-3, 2e-3, 3e-3));
  EXPECT_EQ(scene.fields[2].spacing, 0.5e-3);
}

// 20 million points are allowed, one more is not: 4000 x 5000 points are 3999 x 4999 steps of 1 mm.
TEST(SceneReader, AllowsTwentyMillionFieldPoints) {
  const auto field = [](const std::string& size) {
    return kSmallScene + "field: [{name: a, plane: xy, through_mm: [0, 0, 0], size_mm: " + size + "}]\n";
  };
  EXPECT_NO_THROW(scene_from(field("[3999, 4999]")));
  EXPECT_THROW(scene_from(field("[3999, 5000]")), InputError);
}

TEST(SceneReader, ResolvesFilesAgainstTheScenesFolder) {
  const TempFolder folder;
  std::filesystem::create_directory(folder.path() / "data");
  folder.write("data/array.csv", "x_mm,y_mm,z_mm,nx,ny,nz\r\n1, 2,3 ,0,0,-2 # down\r\n\r\n-1,.5,3e0,3,4,0\r\n");
  folder.write("data/phases.txt", "# radians\n0.5, 1\n-1.5\n");
  const auto file = folder.write("scene.yaml",
                                 "name: files\n"
                                 "array: {positions: {file: data/array.csv}}\n"
                                 "body: {mesh: {file: data/../hand.stl, unit: cm, landmarks: {tip: [1, 2, 3.3]}}}\n"
                                 "solve: {methods: [{fixed: {phases_file: data/phases.txt}}]}\n");
  const Scene scene = read_scene(file, {});
  const auto& positions = std::get<PositionsArray>(scene.array.layout);
  Points points(3, 2);
  points << 1e-3, -1e-3, 2e-3, 0.5e-3, 3e-3, 3e-3;
  EXPECT_EQ(positions.points, points);
  Points axes(3, 2);
  axes << 0, 0.6, 0, 0.8, -1, 0;
  EXPECT_LT((positions.axes - axes).norm(), 1e-15);  // one division and one root of rounding
  const auto& mesh = std::get<MeshShape>(scene.bodies.at(0).shape);
  EXPECT_EQ(mesh.file, (folder.path() / "hand.stl").string());
  EXPECT_EQ(mesh.unit, 1e-2);
  EXPECT_EQ(mesh.landmarks.at("tip"), Vector3(1e-2, 2e-2, 3.3e-2));
  EXPECT_FALSE(scene.bodies.at(0).edge);
  EXPECT_THAT(scene.solve.methods[0].phases, ElementsAre(0.5, 1.0, -1.5));
}

TEST(SceneReader, ResolvesFilesOfOverridesAgainstTheWorkingDirectory) {
  const TempFolder folder;
  const auto file = folder.write("scene.yaml", kSmallScene);
  const Scene scene = read_scene(file, {"body={mesh: {file: some/hand.stl}}"});
  EXPECT_EQ(std::get<MeshShape>(scene.bodies.at(0).shape).file,
            (std::filesystem::current_path() / "some/hand.stl").string());
}

TEST(SceneReader, AGlbFileIsInMetresUnlessTold) {
  const auto tip = [](const std::string& mesh) {
    const Scene scene = scene_from(kSmallScene, {"body={mesh: {" + mesh + ", landmarks: {tip: [0.1, 0, 0]}}}"});
    const auto& shape = std::get<MeshShape>(scene.bodies.at(0).shape);
    EXPECT_EQ(shape.unit_given, mesh != "file: hand.stl");
    return shape.landmarks.at("tip").x();
  };
  EXPECT_EQ(tip("file: hand.GLB"), 0.1);
  EXPECT_EQ(tip("unit: mm, file: hand.glb"), 1e-4);
  EXPECT_EQ(tip("file: hand.stl"), 1e-4);
}

TEST(ShippedScenes, AreTheFilesOfTheFolder) {
  EXPECT_GE(shipped_scenes().size(), 12U);
  for (const ShippedScene& scene : shipped_scenes()) {
    const std::string name(scene.name);
    const std::string file = (source_folder() / "scenes" / (name + ".yaml")).string();
    EXPECT_EQ(scene.text, text_of(file)) << name;
    EXPECT_EQ(resolved_yaml(read_scene(name)), resolved_yaml(read_scene(file))) << name;
  }
  EXPECT_THAT(message_of<InputError>([] { read_scene("quik"); }),
              AllOf(HasSubstr("quik: no such file, and no scene that comes with the program"), HasSubstr("quick")));
}

}  // namespace
}  // namespace touchfield
