// How much a scene may be: what is more is refused before time or memory is spent on it.

#include <random>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sim/scene/yaml_tree.h"
#include "tests/support/scene_support.h"

namespace touchfield {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::kSmallScene;
using testing::problems_of;
using testing::TempFolder;

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

}  // namespace
}  // namespace touchfield
