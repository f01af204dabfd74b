// The kernels that OpenBLAS runs, and those that it should.

#include "sim/core/program_start.h"

#include <sched.h>

#include "tests/support/testing.h"

namespace touchfield::program_start_test {

// What OpenBLAS or this program chooses is never refused, and threads of OpenBLAS are those of our own loops.
TEST(ProgramStart, TheKernelsInUseFitTheProcessor) {
  EXPECT_NO_THROW(require_sound_variables());
  EXPECT_FALSE(blas_core().empty());
  EXPECT_NE(better_blas_core(), blas_core());
  EXPECT_EQ(blas_threading(), "OpenMP");
}

TEST(ProgramStart, NobodyIsBoundWithoutPlaces) {
  cpu_set_t before;
  cpu_set_t after;
  ASSERT_EQ(sched_getaffinity(0, sizeof before, &before), 0);
  restore_processors();
  ASSERT_EQ(sched_getaffinity(0, sizeof after, &after), 0);
  EXPECT_TRUE(CPU_EQUAL(&before, &after));
  EXPECT_EQ(binding_warning(1000), "");
}

}  // namespace touchfield::program_start_test
