#include "hardware/attention.h"

#include "tests/support/testing.h"

namespace touchfield::attention_test {

constexpr double kTurn = 0.02;  // [s] planned between looks

TEST(Attention, WhoLooksAsPlannedHasNoGap) {
  Attention attention;
  double now = 7;
  attention.begin(now);
  for (int k = 0; k < 1000; ++k) {
    now += kTurn + 0.03;  // a busy machine
    EXPECT_FALSE(attention.look(now, kTurn)) << now;
  }
  EXPECT_EQ(attention.gaps().count, 0U);
  EXPECT_NEAR(attention.gaps().longest, 0.03, 1e-9);
}

TEST(Attention, CountsAGapAndGoesOn) {
  Attention attention;
  attention.begin(0);
  EXPECT_FALSE(attention.look(0.02, kTurn));
  EXPECT_FALSE(attention.look(0.12, kTurn));
  EXPECT_FALSE(attention.look(0.14, kTurn));
  EXPECT_EQ(attention.gaps().count, 1U);
  EXPECT_NEAR(attention.gaps().longest, 0.08, 1e-9);
}

TEST(Attention, EndsAtTheFirstGapThatIsTooLong) {
  Attention attention;
  attention.begin(100);
  EXPECT_FALSE(attention.look(100.26, kTurn)) << "0.24 s";
  EXPECT_TRUE(attention.look(102.28, kTurn)) << "2 s";
  EXPECT_EQ(attention.gaps().count, 2U);
  EXPECT_THAT(attention.fault(), HasSubstr("did not supervise the array for 2.00 s (at most 0.25 s)"));
}

TEST(Patience, IsOverWhenItsTimeIs) {
  Patience patience(0.1, 5);
  double now = 5;
  while (!patience.over(now += kPatienceStep)) {
  }
  EXPECT_NEAR(now, 5.1, kPatienceStep + 1e-9);
}

// Who was frozen himself has not waited.
TEST(Patience, DoesNotRunOutInAPause) {
  Patience patience(0.1, 5);
  EXPECT_FALSE(patience.over(60));
  EXPECT_FALSE(patience.over(120));
  EXPECT_TRUE(patience.over(180)) << "three pauses of two steps each";
}

}  // namespace touchfield::attention_test
