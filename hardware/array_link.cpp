#include "hardware/array_link.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "sim/core/errors.h"

namespace touchfield {

void ArrayLink::store(std::size_t /*first*/, const std::vector<DriveFrame>& /*frames*/) {
  throw InputError(describe() + " stores no frames");
}

void ArrayLink::play_stored(std::size_t count, double rate) {
  stored_periods(count, rate, abilities().stored, describe());
}

int stored_periods(std::size_t count, double rate, const StoredAbility& ability, const std::string& device) {
  if (ability.most_frames == 0) {
    throw InputError(device + " stores no frames");
  }
  if (count < 2 || count > ability.most_frames) {
    throw InputError(fmt::format("{} stores 2 to {} frames, not {}", device, ability.most_frames, count));
  }
  const double periods = std::round(ability.clock / rate);
  constexpr double kRounding = 1e-9;
  if (!(periods >= ability.fewest_periods && periods <= ability.most_periods &&
        std::abs(periods * rate - ability.clock) <= kRounding * ability.clock)) {
    const double nearest = ability.clock / std::clamp<double>(periods, ability.fewest_periods, ability.most_periods);
    throw InputError(fmt::format(
        "{:g} stored frames per second must be {:g} Hz divided by a whole number from {} to {}, for {}; {:.9g} is near",
        rate, ability.clock, ability.fewest_periods, ability.most_periods, device, nearest));
  }
  return static_cast<int>(periods);
}

void require_fits(const DriveFrame& frame, const LinkAbilities& abilities, std::size_t count,
                  const std::string& device) {
  if (frame.phase.size() != count || frame.intensity.size() != count) {
    throw InputError(fmt::format("{}: a frame of {} phases and {} intensities for {} transducers", device,
                                 frame.phase.size(), frame.intensity.size(), count));
  }
  for (std::size_t n = 0; n < count; ++n) {
    if (frame.phase[n] >= abilities.steps.phase_levels || frame.intensity[n] >= abilities.steps.intensity_levels) {
      throw InputError(fmt::format("{}: transducer {}: phase step {} must be below {} and intensity step {} below {}",
                                   device, n, frame.phase[n], abilities.steps.phase_levels, frame.intensity[n],
                                   abilities.steps.intensity_levels));
    }
  }
}

}  // namespace touchfield
