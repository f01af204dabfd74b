#include <numeric>

#include <gmock/gmock.h>
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

TEST_F(GpuContext, CopiesThereAndBack) {
  std::vector<double> values(1000);
  std::iota(values.begin(), values.end(), 0.5);
  cuda::Array<double> there(context());
  there.upload(values);
  std::vector<double> back(values.size());
  there.download(back.data(), back.size());
  EXPECT_EQ(back, values);
  EXPECT_EQ(gpu().taken(), values.size() * sizeof(double));
}

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

TEST_F(GpuContext, FailsWhereItIsAskedTo) {
  GpuLimits limits;
  limits.fail_after = 1;
  const auto broken = open_gpu(0, limits);
  auto& context = dynamic_cast<cuda::Context&>(*broken);
  context.synchronize();
  EXPECT_THROW(context.synchronize(), GpuFailure);
}

}  // namespace
}  // namespace touchfield
