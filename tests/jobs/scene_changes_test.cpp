#include "sim/jobs/scene_changes.h"

#include "tests/support/testing.h"

namespace touchfield::scene_changes_test {

/// "path: a -> b", one after another.
std::string changes(const std::string& a, const std::string& b) {
  std::string text;
  for (const SceneKeyChange& change : scene_changes(a, b)) {
    text += change.path + ": " + change.a.value_or("(absent)") + " -> " + change.b.value_or("(absent)") + '\n';
  }
  return text;
}

TEST(SceneChanges, NameTheKeyPath) {
  EXPECT_EQ(changes("name: x\narray:\n  at_mm: [0, 0, 0]\n  level: 1\n",
                    "name: x\narray:\n  at_mm: [0, 0, 5]\n  level: 0.5\n"),
            "array.at_mm[2]: 0 -> 5\narray.level: 1 -> 0.5\n");
  EXPECT_EQ(changes("a: 1\nsensing: {seed: 1}\nb: {}\n", "b: {}\nlist: [1, 2]\na: 1\n"),
            "sensing.seed: 1 -> (absent)\nlist[0]: (absent) -> 1\nlist[1]: (absent) -> 2\n");
  EXPECT_EQ(changes("", ""), "");
}

}  // namespace touchfield::scene_changes_test
