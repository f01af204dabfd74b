// Whatever the bytes, a scene reads or is refused with an InputError.

#include <random>

#include <gtest/gtest.h>

#include "tests/support/scene_support.h"

namespace touchfield {
namespace {

using testing::TempFolder;

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
bool reads(const TempFolder& folder, const std::string& text) {
  const std::string file = folder.write("scene.yaml", text);
  try {
    read_scene(file, {});
    return true;
  } catch (const InputError& error) {
    EXPECT_FALSE(std::string(error.what()).empty());
  } catch (const std::exception& error) {
    ADD_FAILURE() << "not an InputError: " << error.what() << "\n" << text;
  }
  return false;
}

TEST(SceneFuzz, TheWholeSceneReads) {
  const TempFolder folder;
  EXPECT_TRUE(reads(folder, kScene));
}

TEST(SceneFuzz, Truncated) {
  const TempFolder folder;
  int read = 0;
  for (std::size_t length = 0; length < kScene.size(); ++length)
    read += reads(folder, kScene.substr(0, length)) ? 1 : 0;
  EXPECT_GE(read, 1);  // without the last line it is a scene
  EXPECT_LT(read, 100);
}

TEST(SceneFuzz, Mutated) {
  const TempFolder folder;
  std::mt19937_64 random(20);
  const std::string marks = "{}[]:,-#&*!|>'\"%@`?~ \t\n\r.0e\\<=_\x80\xff";
  for (int round = 0; round < 4000; ++round) {
    std::string text = kScene;
    const auto changes = 1 + random() % 4;
    for (std::size_t i = 0; i < changes; ++i) {
      const auto at = random() % text.size();
      const char c = random() % 2 == 0 ? marks[random() % marks.size()] : static_cast<char>(random() % 256);
      const auto kind = random() % 3;
      if (kind == 0) text[at] = c;
      if (kind == 1) text.insert(at, 1, c);
      if (kind == 2) text.erase(at, 1 + random() % 8);
    }
    reads(folder, text);
  }
}

TEST(SceneFuzz, RandomBytes) {
  const TempFolder folder;
  std::mt19937_64 random(21);
  for (int round = 0; round < 1000; ++round) {
    std::string text(random() % 200, ' ');
    for (char& c : text) c = static_cast<char>(32 + random() % 95);
    EXPECT_FALSE(reads(folder, text));
  }
}

TEST(SceneFuzz, MutatedOverrides) {
  const TempFolder folder;
  const std::string file = folder.write("scene.yaml", kScene);
  std::mt19937_64 random(22);
  const std::vector<std::string> valid = {"solve.methods.0.paper={iterations: 3}", "target.boxes[1].size_mm=[1, 2, 3]",
                                          "body.place=null", "array.at_mm.2=5"};
  for (int round = 0; round < 4000; ++round) {
    std::string text = valid[random() % valid.size()];
    const auto at = random() % text.size();
    if (random() % 2 == 0) {
      text[at] = static_cast<char>(random() % 256);
    } else {
      text.erase(at, 1 + random() % 4);
    }
    try {
      read_scene(file, {text});
    } catch (const InputError& error) {
      EXPECT_FALSE(std::string(error.what()).empty());
    } catch (const std::exception& error) {
      ADD_FAILURE() << "not an InputError: " << error.what() << "\n" << text;
    }
  }
}

}  // namespace
}  // namespace touchfield
