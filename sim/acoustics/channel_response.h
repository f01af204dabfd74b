#pragma once

#include "sim/core/types.h"
#include "solvers/phase/robust_surface.h"

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

/// Gains and phases are normal, independent from channel to channel. Channel n gets the same three numbers whatever the
/// tolerances and N are, so that larger tolerances with one seed are the same array made worse. A gain below 0 becomes
/// 0.
///
/// seed   the same seed gives the same numbers on every machine, but for the rounding of log, cos and sin
ChannelResponse random_response(Eigen::Index channels, const ChannelTolerances& tolerances, unsigned seed);

}  // namespace touchfield
