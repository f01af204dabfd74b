#pragma once

#include <memory>

#include <gtest/gtest.h>

#include "sim/gpu/cuda/context.cuh"
#include "sim/gpu/gpu_library.h"

namespace touchfield {

/// Tests that need a graphics card: skipped, with a line that says why, where there is none.
class CardTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (gpu_library().cards == 0) {
      GTEST_SKIP() << gpu_library().why_none;
    }
    gpu_ = open_gpu(0);
  }

  Gpu& gpu() { return *gpu_; }
  /// The same as the library's own code sees it.
  cuda::Context& context() { return dynamic_cast<cuda::Context&>(*gpu_); }

 private:
  std::shared_ptr<Gpu> gpu_;
};

}  // namespace touchfield
