#include "solvers/linear/blas_core.h"

#include <gtest/gtest.h>

#include "solvers/linear/instruction_level.h"

namespace touchfield::blas_core_test {

// What OpenBLAS 0.3.21 does on a processor that is newer than itself.
TEST(BlasCore, APrescottGivesWayToTheProcessorsInstructionSets) {
  EXPECT_EQ(better_blas_core("Prescott", true, true, true), "SkylakeX");
  EXPECT_EQ(better_blas_core("Prescott", true, true, false), "Haswell");
  EXPECT_EQ(better_blas_core("Prescott", true, false, false), "Sandybridge");
  EXPECT_EQ(better_blas_core("Prescott", false, false, false), "");
}

TEST(BlasCore, ACoreThatFitsStays) {
  EXPECT_EQ(better_blas_core("SkylakeX", true, true, true), "");
  EXPECT_EQ(better_blas_core("Cooperlake", true, true, true), "");
  EXPECT_EQ(better_blas_core("Zen", true, true, false), "");
  EXPECT_EQ(better_blas_core("Haswell", true, true, false), "");
  EXPECT_EQ(better_blas_core("Sandybridge", true, false, false), "");
}

TEST(BlasCore, KernelsOfAnOlderGenerationGiveWay) {
  EXPECT_EQ(better_blas_core("Haswell", true, true, true), "SkylakeX");
  EXPECT_EQ(better_blas_core("Sandybridge", true, true, false), "Haswell");
  EXPECT_EQ(better_blas_core("Nehalem", true, true, false), "Haswell");
}

// A core that the processor cannot carry out is never proposed.
TEST(BlasCore, NothingIsProposedBeyondTheProcessor) {
  for (const char* core : {"Prescott", "Nehalem", "Sandybridge", "Haswell", "SkylakeX", "a name of the future"}) {
    EXPECT_NE(better_blas_core(core, true, true, false), "SkylakeX") << core;
    EXPECT_NE(better_blas_core(core, true, false, false), "Haswell") << core;
    EXPECT_EQ(better_blas_core(core, false, false, false), "") << core;
  }
}

TEST(BlasCore, KernelsAreHeldAgainstTheProcessor) {
  EXPECT_EQ(lacking_instructions("Prescott"), "");
  EXPECT_EQ(lacking_instructions("a name of the future"), "");
#ifdef __x86_64__
  EXPECT_EQ(lacking_instructions("Haswell"), processor_level() >= InstructionLevel::kV3 ? "" : "AVX2 and FMA");
  EXPECT_EQ(lacking_instructions("SkylakeX"), processor_level() >= InstructionLevel::kV4 ? "" : "AVX-512");
  EXPECT_EQ(lacking_instructions("Bulldozer"), __builtin_cpu_supports("fma4") != 0 ? "" : "FMA4");
  if (lacking_instructions("SkylakeX") != "") {
    EXPECT_NE(lacking_instructions("Cooperlake"), "");
  }
#endif
}

// What OpenBLAS or this program chooses is never refused.
TEST(BlasCore, TheOneInUseFitsTheProcessor) {
  EXPECT_EQ(lacking_instructions(blas_core()), "");
  EXPECT_EQ(lacking_instructions(better_blas_core()), "");
}

TEST(BlasCore, IsNamed) {
  EXPECT_FALSE(blas_core().empty());
  EXPECT_EQ(blas_threading(), "OpenMP");
}

}  // namespace touchfield::blas_core_test
