#include "sim/motion/motion_prediction.h"

#include <gtest/gtest.h>

namespace touchfield::motion_prediction_test {

using Prediction = MotionSpec::Prediction;

constexpr double kAThirtieth = 1 / 30.0;

Points moved(double seconds) { return Points::Constant(3, 4, 0.2).array() + 0.05 * seconds; }

/// All that a state may hold, each at its own constant velocity.
Seen seen_at(double seconds) {
  MotionState state{Eigen::Vector2d(seconds, 7 - 3 * seconds)};
  state.vertices = 2 * moved(seconds);
  state.skin = moved(seconds);
  state.patches = Points(-moved(seconds).leftCols(2));
  return {seconds, state};
}

TEST(MotionPrediction, MeetsASteadyMotion) {
  for (const Prediction kind : {Prediction::kLinear, Prediction::kKalman}) {
    MotionPrediction prediction(kind, kAThirtieth);
    for (int k = 0; k < 40; ++k) prediction.see(seen_at(k * kAThirtieth));
    ASSERT_TRUE(prediction.predicts());
    const MotionState expected = prediction.at(1.4);
    const MotionState truth = seen_at(1.4).state;
    EXPECT_LT((expected.numbers - truth.numbers).norm(), 1e-6);
    EXPECT_LT((*expected.vertices - *truth.vertices).norm(), 1e-7);
    EXPECT_LT((*expected.skin - *truth.skin).norm(), 1e-7);
    EXPECT_LT((*expected.patches - *truth.patches).norm(), 1e-7);
  }
}

TEST(MotionPrediction, NoneIsWhatWasSeenLast) {
  MotionPrediction prediction;
  for (int k = 0; k < 5; ++k) prediction.see(seen_at(k * kAThirtieth));
  EXPECT_FALSE(prediction.predicts());
  EXPECT_EQ(*prediction.at(1).skin, moved(4 * kAThirtieth));
}

TEST(MotionPrediction, ExpectsNothingAcrossALoss) {
  for (const Prediction kind : {Prediction::kLinear, Prediction::kKalman}) {
    MotionPrediction prediction(kind, kAThirtieth);
    prediction.see(seen_at(0));
    EXPECT_FALSE(prediction.predicts());
    prediction.see(seen_at(0.1));
    EXPECT_TRUE(prediction.predicts());
    Seen lost = seen_at(0.2);
    lost.lost = true;
    prediction.see(lost);
    EXPECT_FALSE(prediction.predicts());
    prediction.see(seen_at(0.3));
    EXPECT_FALSE(prediction.predicts());
    EXPECT_EQ(*prediction.at(0.4).skin, moved(0.3));
    MotionPrediction fresh(kind, kAThirtieth);
    fresh.see(seen_at(0.3));
    for (MotionPrediction* one : {&prediction, &fresh}) one->see(seen_at(0.33));
    EXPECT_TRUE(prediction.predicts());
    EXPECT_EQ(*prediction.at(0.4).skin, *fresh.at(0.4).skin);
    EXPECT_EQ(prediction.at(0.4).numbers, fresh.at(0.4).numbers);
  }
}

TEST(MotionPrediction, WhatIsSeenTwiceHasNoVelocityOfItsOwn) {
  for (const Prediction kind : {Prediction::kLinear, Prediction::kKalman}) {
    MotionPrediction once(kind, kAThirtieth);
    MotionPrediction twice(kind, kAThirtieth);
    for (int k = 0; k < 6; ++k) {
      once.see(seen_at(0.05 * k));
      twice.see(seen_at(0.05 * k));
      twice.see(seen_at(0.05 * k));
      EXPECT_EQ(twice.predicts(), k > 0);
    }
    EXPECT_EQ(*once.at(0.4).skin, *twice.at(0.4).skin);
  }
}

}  // namespace touchfield::motion_prediction_test
