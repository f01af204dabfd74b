#include "hardware/array_link.h"

#include <fmt/format.h>

#include "sim/core/errors.h"

namespace touchfield {

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
