#include "hardware/emission_policy.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "sim/core/errors.h"

namespace touchfield {

double permitted_level(const EmissionRequest& request, const LinkAbilities& abilities, const std::string& device) {
  if (!(request.most_level > 0 && request.most_level <= 1)) {
    throw InputError(fmt::format("--max-level = {} must be > 0 and <= 1", request.most_level));
  }
  const bool fixed = abilities.steps.intensity_levels == 2;
  const double level = request.level.value_or(fixed ? 1.0 : std::min(kUsualLevel, request.most_level));
  if (!(level > 0 && level <= 1)) {
    throw InputError(fmt::format("--level = {} must be > 0 and <= 1", level));
  }
  if (fixed && level != 1) {
    throw InputError(
        fmt::format("--level = {}: {} drives its transducers fully or not at all, level 1; its supply "
                    "voltage sets the pressure",
                    level, device));
  }
  if (level > request.most_level) {
    throw InputError(fmt::format("level = {} must be <= {}{}; --max-level raises the cap", level, request.most_level,
                                 fixed ? fmt::format(" and {} has no other", device) : ""));
  }
  return level;
}

double permitted_seconds(const EmissionRequest& request, std::size_t frames) {
  const double most = request.most_seconds;
  if (!(most > 0) || !std::isfinite(most)) {
    throw InputError(fmt::format("--max-seconds = {} must be > 0 and finite", most));
  }
  const double once = frames == 1 ? kOneFrameSeconds : static_cast<double>(frames) / request.rate;
  const double seconds = request.seconds.value_or(once);
  if (!(seconds > 0) || !std::isfinite(seconds)) {
    throw InputError(fmt::format("--seconds = {} must be > 0 and finite", seconds));
  }
  if (seconds > most) {
    throw InputError(fmt::format("{:g} s of emission must be <= {:g} s; --max-seconds raises the cap", seconds, most));
  }
  return seconds;
}

double permitted_rate(const EmissionRequest& request, const LinkAbilities& abilities, const std::string& device) {
  const double most = abilities.most_frames_per_second;
  if (!(request.rate > 0 && request.rate <= most)) {
    throw InputError(
        fmt::format("{:g} frames a second must be > 0 and <= {:g}, what {} carries", request.rate, most, device));
  }
  return request.rate;
}

void require_read_back(const DriveFrame& sent, ArrayLink& link) {
  const std::optional<DriveFrame> held = link.read_back();
  if (!held || *held == sent) {
    return;
  }
  std::size_t n = 0;
  while (n < sent.size() && n < held->size() && sent.phase[n] == held->phase[n] &&
         sent.intensity[n] == held->intensity[n]) {
    ++n;
  }
  throw DeviceError(
      fmt::format("{}: it reads back another pattern than was sent, from transducer {} on", link.describe(), n));
}

void require_read_back(const Modulation& sent, ArrayLink& link) {
  const std::optional<std::vector<std::uint8_t>> held = link.read_back_modulation();
  if (!held) {
    return;
  }
  const std::vector<std::uint8_t> wanted = modulation_samples(sent, link.abilities().modulation);
  bool same = !held->empty() && held->size() % wanted.size() == 0;
  for (std::size_t k = 0; same && k < held->size(); ++k) {
    same = (*held)[k] == wanted[k % wanted.size()];
  }
  if (!same) {
    throw DeviceError(fmt::format("{}: it reads back another modulation than was sent", link.describe()));
  }
}

}  // namespace touchfield
