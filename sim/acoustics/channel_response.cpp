#include "sim/acoustics/channel_response.h"

#include <algorithm>
#include <complex>

#include "sim/core/random.h"

namespace touchfield {

Eigen::VectorXcd factors(const ChannelResponse& response) {
  Eigen::VectorXcd values(response.gain.size());
  for (Eigen::Index n = 0; n < values.size(); ++n) {
    values(n) = std::polar(response.gain(n), response.phase(n));
  }
  return values;
}

ChannelResponse product(const ChannelResponse& first, const ChannelResponse& second) {
  if (first.as_designed() || second.as_designed()) {
    return first.as_designed() ? second : first;
  }
  return {first.gain.cwiseProduct(second.gain), first.phase + second.phase};
}

ChannelResponse random_response(Eigen::Index channels, const ChannelTolerances& tolerances, unsigned seed) {
  ChannelResponse response{Eigen::VectorXd(channels), Eigen::VectorXd(channels)};
  NormalPairs random(seed);
  for (Eigen::Index n = 0; n < channels; ++n) {
    const NormalPairs::Polar normal = random.next();
    const bool dead = random.uniform() <= tolerances.dead;
    response.gain(n) = dead ? 0.0 : std::max(0.0, 1.0 + tolerances.gain * normal.first());
    response.phase(n) = tolerances.phase * normal.second();
  }
  return response;
}

}  // namespace touchfield
