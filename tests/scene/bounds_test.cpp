// How much a scene may be: what is more is refused before time or memory is spent on it.

#include <random>

#include <fmt/format.h>

#include "sim/scene/yaml_tree.h"
#include "tests/support/scene_support.h"
#include "tests/support/testing.h"

namespace touchfield {
namespace {

std::string repeated(const std::string& text, int times) {
  std::string all;
  for (int i = 0; i < times; ++i) all += text;
  return all;
}

std::vector<std::string> problems_of_text(const std::string& text) {
  const TempFolder folder;
  return problems_of(folder.write("scene.yaml", text));
}

TEST(SceneBounds, AFileThatIsTooLongIsNotRead) {
  const TempFolder folder;
  const std::string file = folder.write("scene.yaml", kSmallScene);
  std::filesystem::resize_file(file, std::uintmax_t{1} << 40U);
  EXPECT_THAT(problems_of(file), ElementsAre(file + ": too long, must be at most 2097152 bytes"));
}

TEST(SceneBounds, AnEndlessFileIsLeft) {
  EXPECT_THAT(problems_of("/dev/zero"), ElementsAre(HasSubstr("/dev/zero: too long")));
}

TEST(SceneBounds, Values) {
  EXPECT_THAT(problems_of_text(kSmallScene + "field: [" + repeated("1,", 250'000) + "]\n"),
              ElementsAre(HasSubstr("scene.yaml:5:39")));
}

TEST(SceneBounds, Keys) {
  std::string text;
  for (int i = 0; i < 1001; ++i) text += fmt::format("key{}: 1\n", i);
  EXPECT_THAT(problems_of_text(text), ElementsAre(HasSubstr("scene.yaml:1001:1: more than 1000 keys in one map")));
}

TEST(SceneBounds, LinesOfFiles) {
  const TempFolder folder;
  folder.write("array.csv", "x_mm,y_mm\n" + repeated("1,2\n", 10'001));
  folder.write("phases.csv", repeated("0.5\n", 10'001));
  const std::string file = folder.write("scene.yaml", kSmallScene);
  EXPECT_THAT(problems_of(file, {"array={positions: {file: " + folder.path().string() + "/array.csv}}"}),
              ElementsAre(HasSubstr("array.csv:10002: too many positions, must be at most 10000")));
  EXPECT_THAT(problems_of(file, {"solve.methods=[{fixed: {phases_file: " + folder.path().string() + "/phases.csv}}]"}),
              ElementsAre(HasSubstr("phases.csv:10001: too many numbers, must be at most 10000")));
}

// The longest lists with all their digits: the scene as a run keeps it is one that can be read.
TEST(SceneBounds, TheLongestListsReadBack) {
  const TempFolder folder;
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> number(-1.0, 1.0);
  std::string lines = "x_mm,y_mm,z_mm,nx,ny,nz\n";
  for (int i = 0; i < 10'000; ++i) {
    for (int c = 0; c < 6; ++c) lines += fmt::format("{}{}", c == 0 ? "" : ",", number(random) * (c < 3 ? 700.0 : 1.0));
    lines += "\n";
  }
  folder.write("array.csv", lines);
  const Scene scene = read_scene(folder.write("scene.yaml", kSmallScene),
                                 {"array={positions: {file: " + folder.path().string() + "/array.csv}}"});
  const std::string text = resolved_yaml(scene);
  EXPECT_LT(text.size(), schema::kMostTextBytes);
  const Scene again = read_scene(folder.write("resolved.yaml", text), {});
  EXPECT_EQ(std::get<PositionsArray>(again.array.layout).points, std::get<PositionsArray>(scene.array.layout).points);
}

// One scene with every kind of value, and YAML's own marks.
const std::string kScene =
    "# A scene to spoil.\n"
    "name: \"all\"\n"
    "medium: {temperature_c: 21.5, absorption: true}\n"
    "array:\n"
    "  positions: {points_mm: [[0, 0, 0], [1.5e1, -2, 3]], axes: [[0, 0, 1], [0, 1, 1]]}\n"
    "  at_mm: &here [0, 0, -1]\n"
    "body:\n"
    "  mesh: {file: 'hand.stl', unit: cm, landmarks: {tip: *here}}\n"
    "  place: {landmark: tip, rotate_deg: [0, 0, 90]}\n"
    "target:\n"
    "  boxes:\n"
    "    - {at: tip, size_mm: [8, 40, 6]}\n"
    "    - centre_mm: *here\n"
    "      size_mm: [1, 2, 3]\n"
    "  pressure_pa: best\n"
    "solve:\n"
    "  methods: [paper, {paper: {as: b, start: {random: 7}}}, {fixed: {phases_rad: [0, 1]}}]\n"
    "  tolerance: 1e-6\n"
    "evaluation: {scheme: chief, split: 1}\n"
    "field: [{name: side, plane: xz, through_mm: [0, 0, 0], size_mm: [10, 20]}]\n"
    "write: [h5, png]\n";

// True if the text reads as a scene; anything but an InputError fails the test.
bool reads(const TempFolder& folder, const std::string& text, const std::vector<std::string>& overrides = {}) {
  const std::string file = folder.write("scene.yaml", text);
  try {
    read_scene(file, overrides);
    return true;
  } catch (const InputError& error) {
    EXPECT_FALSE(std::string(error.what()).empty());
  } catch (const std::exception& error) {
    ADD_FAILURE() << "not an InputError: " << error.what() << "\n" << text;
  }
  return false;
}

TEST(SceneFuzz, TruncatedOrMutated) {
  const TempFolder folder;
  EXPECT_TRUE(reads(folder, kScene));
  for (std::size_t length = 0; length + 20 < kScene.size(); ++length) {
    reads(folder, kScene.substr(0, length));
  }
  std::mt19937_64 random(20);
  const std::string marks = "{}[]:,-#&*!|>'\"%@`?~ \t\n\r.0e\\<=_\x80\xff";
  for (int round = 0; round < 3000; ++round) {
    std::string text = kScene;
    for (auto changes = 1 + random() % 4; changes > 0; --changes) {
      const char c = random() % 2 == 0 ? marks[random() % marks.size()] : static_cast<char>(random() % 256);
      text.replace(random() % text.size(), random() % 8, random() % 2, c);
    }
    reads(folder, text);
  }
}

TEST(SceneFuzz, MutatedOverrides) {
  const TempFolder folder;
  std::mt19937_64 random(22);
  const std::vector<std::string> valid = {"solve.methods.0.paper={iterations: 3}", "target.boxes[1].size_mm=[1, 2, 3]",
                                          "body.place=null", "array.at_mm.2=5"};
  for (int round = 0; round < 1000; ++round) {
    std::string text = valid[random() % valid.size()];
    const auto at = random() % text.size();
    if (random() % 2 == 0) {
      text[at] = static_cast<char>(random() % 256);
    } else {
      text.erase(at, 1 + random() % 4);
    }
    reads(folder, kScene, {text});
  }
}

}  // namespace
}  // namespace touchfield
