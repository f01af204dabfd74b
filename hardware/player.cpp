#include "hardware/player.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include <fmt/format.h>

#include "sim/core/errors.h"

namespace touchfield {

namespace {

constexpr double kCheckPeriod = 0.05;  // [s] between looks at a device that is sent nothing
constexpr double kSlack = 1e-9;        // [s]: what is due now must not wait for another turn by rounding

void require_options(std::size_t count, const PlayOptions& options, const ArrayLink& link) {
  if (count == 0) {
    throw InputError("there is no frame to play");
  }
  if (!(options.seconds > 0) || !std::isfinite(options.seconds)) {
    throw InputError(fmt::format("seconds = {} must be > 0", options.seconds));
  }
  const double most = link.abilities().most_frames_per_second;
  if (!(options.rate > 0 && options.rate <= most)) {
    throw InputError(
        fmt::format("rate = {} Hz must be > 0 and <= {} Hz, what {} carries", options.rate, most, link.describe()));
  }
}

}  // namespace

PlayReport play(std::size_t count, const FrameSource& source, ArrayLink& link, const PlayOptions& options, Pace& pace,
                const FrameObserver& observer) {
  require_options(count, options, link);
  PlayReport report;
  std::optional<std::size_t> last;  // tick of the frame that is out
  const double start = pace.now();
  for (;;) {
    const double now = pace.now() - start;
    if (now >= options.seconds - kSlack) {
      break;
    }
    auto due = static_cast<std::size_t>(std::floor((now + kSlack) * options.rate));
    if (!options.repeat) {
      due = std::min(due, count - 1);
    }
    if (!last || due > *last) {
      const DriveFrame frame = source(due % count);
      const double delay = pace.now() - start - static_cast<double>(due) / options.rate;
      link.send(frame);
      report.dropped += due - (last ? *last + 1 : 0);
      report.late += delay > 0.5 / options.rate ? 1 : 0;
      report.worst_delay = std::max(report.worst_delay, delay);
      ++report.sent;
      last = due;
      if (observer) {
        observer(due % count, frame);
      }
    } else {
      link.check();
    }
    const bool ended = !options.repeat && *last == count - 1;
    const double next = ended ? options.seconds : static_cast<double>(*last + 1) / options.rate;
    if (!pace.wait_until(start + std::min({next, options.seconds, pace.now() - start + kCheckPeriod}))) {
      report.stopped = true;
      break;
    }
  }
  report.seconds = pace.now() - start;
  return report;
}

}  // namespace touchfield
