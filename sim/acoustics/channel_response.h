#pragma once

#include "sim/core/types.h"

namespace touchfield {

/// What real channels make of their drives: channel n radiates gain_n exp(i phase_n) times what it was designed to.
/// Both empty: every channel is as designed.
struct ChannelResponse {
  Eigen::VectorXd gain;   // N, >= 0; 0: dead
  Eigen::VectorXd phase;  // N [rad]

  bool as_designed() const { return gain.size() == 0; }
};

/// gain_n exp(i phase_n) of a response that is not as designed.
Eigen::VectorXcd factors(const ChannelResponse& response);

/// One response after the other: gains multiply, phases add. Sizes are the same, or one is as designed.
ChannelResponse product(const ChannelResponse& first, const ChannelResponse& second);

/// How transducers differ at random.
struct ResponseSpread {
  double gain = 0;    // standard deviation of the gain, whose mean is 1; what would be below 0 is 0
  double phase = 0;   // standard deviation of the phase, whose mean is 0 [rad]
  double dead = 0;    // probability that a channel is dead, 0 to 1
  unsigned seed = 1;  // the same seed gives the same numbers on every machine, but for the rounding of log, cos and sin
};

/// Gains and phases are normal, independent from channel to channel. Channel n gets the same three numbers whatever the
/// spread and N are, so that a larger spread of one seed is the same array made worse.
ChannelResponse random_response(Eigen::Index channels, const ResponseSpread& spread);

}  // namespace touchfield
