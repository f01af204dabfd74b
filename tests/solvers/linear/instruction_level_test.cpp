#include "solvers/linear/instruction_level.h"

#include <stdexcept>

#include <gtest/gtest.h>

namespace touchfield::instruction_level_test {

TEST(InstructionLevel, TheOneInUseIsTheProcessorsOrTheOneAskedFor) {
  const char* wanted = std::getenv("TOUCHFIELD_LEVEL");
  EXPECT_EQ(to_string(instruction_level()), wanted != nullptr ? wanted : to_string(processor_level()));
}

TEST(InstructionLevel, TheProcessorsAreAscendingAndEndWithItsOwn) {
  const std::vector<InstructionLevel> levels = processor_levels();
  EXPECT_EQ(levels.front(), InstructionLevel::kGeneric);
  EXPECT_EQ(levels.back(), processor_level());
  EXPECT_TRUE(std::is_sorted(levels.begin(), levels.end()));
}

// In a process of its own, since the level is read once.
TEST(InstructionLevelDeathTest, ANameThatIsNoLevelIsRefusedWithThoseThereAre) {
  testing::GTEST_FLAG(death_test_style) = "threadsafe";
  const auto message = [](const char* name) {
    setenv("TOUCHFIELD_LEVEL", name, 1);
    try {
      instruction_level();
    } catch (const std::invalid_argument& error) {
      std::fprintf(stderr, "%s", error.what());
      std::_Exit(3);
    }
    std::_Exit(0);
  };
  EXPECT_EXIT(message("v5"), testing::ExitedWithCode(3), "TOUCHFIELD_LEVEL = 'v5' must be a level .*: generic");
  EXPECT_EXIT(message("generic"), testing::ExitedWithCode(0), "");
}

}  // namespace touchfield::instruction_level_test
