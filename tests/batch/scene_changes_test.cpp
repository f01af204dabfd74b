#include "sim/batch/scene_changes.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sim/core/errors.h"

namespace touchfield {

bool operator==(const TextChange& x, const TextChange& y) { return x.what == y.what && x.a == y.a && x.b == y.b; }

void PrintTo(const TextChange& change, std::ostream* out) {
  *out << change.what << ": " << change.a.value_or("(absent)") << " -> " << change.b.value_or("(absent)");
}

namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::UnorderedElementsAre;

std::vector<TextChange> changes(const std::string& a, const std::string& b) { return scene_changes(a, b).changes; }

TEST(SceneChanges, NameTheKeyPath) {
  EXPECT_THAT(changes("name: x\narray:\n  at_mm: [0, 0, 0]\n  level: 1\n",
                      "name: x\narray:\n  at_mm: [0, 0, 5]\n  level: 0.5\n"),
              ElementsAre(TextChange{"array.at_mm[2]", "0", "5"}, TextChange{"array.level", "1", "0.5"}));
}

TEST(SceneChanges, TheSameSaidInAnotherWayIsNone) {
  EXPECT_THAT(changes("a: 5\nb: [1, 2]\nc: word\nd:\n", "d: null\nc: \"word\"\nb:\n  - 1.0\n  - 2e0\na: 5.0\n"),
              IsEmpty());
  EXPECT_THAT(changes("", ""), IsEmpty());
}

TEST(SceneChanges, ANumberInQuotesIsText) {
  EXPECT_EQ(changes("a: 5\n", "a: \"5\"\n").size(), 1U);
  EXPECT_EQ(changes("a: 5\n", "a: 5x\n").size(), 1U);
}

TEST(SceneChanges, WhatOneSceneLacksIsOneChange) {
  EXPECT_THAT(changes("a: 1\nsensing:\n  seed: 1\n  noise: 2\n", "a: 1\nlist: [1, 2]\n"),
              ElementsAre(TextChange{"sensing", "{seed: 1, noise: 2}", std::nullopt},
                          TextChange{"list", std::nullopt, "[1, 2]"}));
  EXPECT_THAT(changes("judge: same\n", "judge:\n  scheme: chief\n"),
              ElementsAre(TextChange{"judge", "same", "{scheme: chief}"}));
}

TEST(SceneChanges, ThingsOfOtherKindsAreExchangedAsAWhole) {
  EXPECT_THAT(changes("m:\n  - paper: {iterations: 30}\n", "m:\n  - focus: {iterations: 30}\n"),
              ElementsAre(TextChange{"m[0]", "{paper: {iterations: 30}}", "{focus: {iterations: 30}}"}));
  EXPECT_THAT(changes("m:\n  - paper: {iterations: 30}\n", "m:\n  - paper: {iterations: 40}\n"),
              ElementsAre(TextChange{"m[0].paper.iterations", "30", "40"}));
}

TEST(SceneChanges, AnElementMoreLeavesTheOthersInPlace) {
  EXPECT_THAT(changes("m: [a, b, c]\n", "m: [b, c]\n"), ElementsAre(TextChange{"m[0]", "a", std::nullopt}));
  EXPECT_THAT(changes("m: [a, b]\n", "m: [a, x, b]\n"), ElementsAre(TextChange{"m[1]", std::nullopt, "x"}));
  EXPECT_THAT(changes("m: [a, b]\n", "m: [a, b, b]\n"), ElementsAre(TextChange{"m[2]", std::nullopt, "b"}));
  EXPECT_THAT(changes("m: [a, b, c]\n", "m: [a, x]\n"),
              ElementsAre(TextChange{"m[1]", "b", "x"}, TextChange{"m[2]", "c", std::nullopt}));
  EXPECT_THAT(changes("m: []\n", "m: [a]\n"), ElementsAre(TextChange{"m[0]", std::nullopt, "a"}));
}

TEST(SceneChanges, AKeyThatCameSinceIsNoneAtItsDefault) {
  const std::string old = "solve:\n  methods:\n    - paper: {iterations: 30}\n";
  const std::string now = "solve:\n  methods:\n    - paper: {iterations: 30, faces: equal}\n  tolerance: 1.0e-4\n";
  const SceneDifference difference = scene_changes(old, now);
  EXPECT_THAT(difference.changes, IsEmpty());
  EXPECT_THAT(difference.at_defaults.a, IsEmpty());
  EXPECT_THAT(difference.at_defaults.b, ElementsAre("solve.methods[0].paper.faces", "solve.tolerance"));
  EXPECT_THAT(scene_changes(now, old).at_defaults.a, ElementsAre("solve.methods[0].paper.faces", "solve.tolerance"));
  EXPECT_THAT(changes(old, "solve:\n  methods:\n    - paper: {iterations: 30, faces: area}\n"),
              ElementsAre(TextChange{"solve.methods[0].paper.faces", "equal", "area"}));
  EXPECT_THAT(changes(old, "solve:\n  methods:\n    - focus: {}\n    - paper: {iterations: 30, faces: equal}\n"),
              ElementsAre(TextChange{"solve.methods[0]", std::nullopt, "{focus: {}}"}));
}

TEST(SceneChanges, ATextThatIsNoSceneNamesTheRun) {
  try {
    changes("a: 1\n", "a: [1\n");
    FAIL() << "no error";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("the scene that B holds cannot be read"));
  }
}

}  // namespace
}  // namespace touchfield
