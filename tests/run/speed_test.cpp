#include <chrono>
#include <stdexcept>
#include <thread>

#include "sim/run/estimates.h"
#include "tests/support/testing.h"

namespace touchfield::speed_test {

TEST(Speed, IsOperationsOverSeconds) {
  const Speed speed = speed_of([] { std::this_thread::sleep_for(std::chrono::milliseconds(20)); }, 1e6);
  EXPECT_LE(speed.flops, 1e6 / 0.02);  // a sleep may last longer, never shorter
  EXPECT_GT(speed.flops, 0.0);
  EXPECT_EQ(speed.note, "");
}

TEST(Speed, WorkThatFailsGivesAGuessAndANote) {
  const Speed speed = speed_of([] { throw std::runtime_error("the matrix is singular"); }, 1e6);
  EXPECT_GE(speed.flops, 1e10);
  EXPECT_TRUE(std::isfinite(speed.flops));
  EXPECT_THAT(speed.note, HasSubstr("the matrix is singular"));
}

// Under every core type that scripts/test --processors tries.
TEST(Speed, OfThisMachineIsMeasured) {
  for (const double rows : {1.0, 300.0, kTimedRows, 20 * kTimedRows}) {
    EXPECT_EQ(measured_speed(rows).note, "") << rows;
    EXPECT_GT(measured_speed(rows).flops, 1e8) << rows;
  }
}

}  // namespace touchfield::speed_test
