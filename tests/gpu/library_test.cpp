#include <gtest/gtest.h>

#include "sim/core/errors.h"
#include "sim/gpu/gpu_library.h"
#include "tests/gpu/card.h"

namespace touchfield {
namespace {

TEST(GpuLibrary, SaysWhyThereIsNoCard) {
  const GpuLibrary& library = gpu_library();
  EXPECT_EQ(library.cards == 0, !library.why_none.empty());
}

TEST(GpuLibrary, NamesACardThatIsNotThere) { EXPECT_THROW(open_gpu(gpu_library().cards + 3), NotBuiltError); }

using GpuContext = CardTest;

TEST_F(GpuContext, KeepsToItsCap) {
  GpuLimits limits;
  limits.memory = std::size_t{1} << 20U;
  const auto capped = open_gpu(0, limits);
  auto& context = dynamic_cast<cuda::Context&>(*capped);
  cuda::Array<char> half(context, limits.memory / 2);
  EXPECT_THROW(cuda::Array<char>(context, limits.memory), GpuMemoryFailure);
  EXPECT_EQ(capped->taken(), limits.memory / 2);
  half.reset();
  EXPECT_EQ(capped->taken(), 0U);
}

}  // namespace
}  // namespace touchfield
