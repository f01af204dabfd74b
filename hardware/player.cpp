#include "hardware/player.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "sim/core/errors.h"

namespace touchfield {

namespace {

constexpr double kCheckPeriod = 0.05;   // [s] between looks at a device that is sent nothing
constexpr double kStreamPeriod = 1e-3;  // [s] between looks at a stream
constexpr double kSlack = 1e-9;         // [s]: what is due now must not wait for another turn by rounding

void require_positive(const char* name, double value) {
  if (!(value > 0) || !std::isfinite(value)) {
    throw InputError(fmt::format("{} = {} must be > 0", name, value));
  }
}

void require_options(std::size_t count, const PlayOptions& options, const ArrayLink& link) {
  if (count == 0) {
    throw InputError("no frame to play");
  }
  require_positive("seconds", options.seconds);
  const double most = link.abilities().most_frames_per_second;
  if (!(options.rate > 0 && options.rate <= most)) {
    throw InputError(
        fmt::format("rate = {} Hz must be > 0 and <= {} Hz, the limit of {}", options.rate, most, link.describe()));
  }
}

/// A stream on its way to a link.
class StreamPlayer {
 public:
  StreamPlayer(const FrameStream& stream, ArrayLink& link, Pace& pace, PlayReport& report,
               const FrameObserver& observer)
      : stream_(stream),
        link_(link),
        pace_(pace),
        report_(report),
        observer_(observer),
        apart_(1 / link.abilities().most_frames_per_second),
        silent_(silent_frame(static_cast<std::size_t>(link.layout().positions.cols()))) {}

  void play(double seconds) {
    const double start = pace_.now();
    spoke_ = start;
    next_ = start;
    stream_.begin(start);
    while (!report_.stopped && pace_.now() - start < seconds - kSlack && !stream_.over()) {
      report_.seconds = pace_.now() - start;
      if (pace_.now() >= next_ - kSlack) {
        if (const std::optional<StreamFrame> frame = stream_.newest()) {
          take(*frame);
        }
      }
      if (seen_ && pace_.now() - *seen_ > stream_.stale) {
        seen_.reset();
        send(silent_);
        silent_since_ = spoke_;
        ++report_.silences;
        tell(false, stream_.stale);
      }
      if (pace_.now() - spoke_ >= kCheckPeriod) {
        link_.check();
        spoke_ = pace_.now();
      }
      report_.stopped = !pace_.wait_until(std::min(pace_.now() + kStreamPeriod, start + seconds));
    }
    end_silence();
    report_.seconds = pace_.now() - start;
  }

 private:
  void take(const StreamFrame& frame) {
    if (pace_.now() - frame.seen > stream_.stale) {
      ++report_.stale;
      tell(seen_.has_value(), pace_.now() - frame.seen);
      return;
    }
    send(frame.frame);
    stream_.committed(frame.number, spoke_);
    ++report_.sent;
    seen_ = frame.seen;
    next_ = spoke_ + apart_;
    end_silence();
    tell(true, spoke_ - frame.seen);
    if (observer_) {
      observer_(frame.number, frame.frame);
    }
  }

  void tell(bool sounds, double age) {
    if (stream_.told) {
      stream_.told(report_, sounds, age);
    }
  }

  void send(const DriveFrame& frame) {
    link_.send(frame);
    spoke_ = pace_.now();
  }

  void end_silence() {
    if (silent_since_) {
      report_.silent += pace_.now() - *silent_since_;
      silent_since_.reset();
    }
  }

  const FrameStream& stream_;
  ArrayLink& link_;
  Pace& pace_;
  PlayReport& report_;
  const FrameObserver& observer_;
  double apart_;  // of frames, at least [s]
  DriveFrame silent_;
  double spoke_ = 0;                    // to the link
  double next_ = 0;                     // when it takes another frame
  std::optional<double> seen_;          // of the frame that it has, while that is not too old
  std::optional<double> silent_since_;  // because what it had was
};

}  // namespace

void play(std::size_t count, const FrameSource& source, ArrayLink& link, const PlayOptions& options, Pace& pace,
          PlayReport& report, const FrameObserver& observer) {
  require_options(count, options, link);
  std::optional<std::size_t> last;  // tick of the frame that is out
  const double start = pace.now();
  for (;;) {
    const double now = pace.now() - start;
    report.seconds = now;
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
}

void play_stored(const std::vector<DriveFrame>& frames, ArrayLink& link, const PlayOptions& options, Pace& pace,
                 PlayReport& report) {
  require_positive("seconds", options.seconds);
  stored_periods(frames.size(), options.rate, link.abilities().stored, link.describe());
  for (std::size_t at = 0; at < frames.size(); at += kStoredAtOnce) {
    const auto first = frames.begin() + static_cast<std::ptrdiff_t>(at);
    const auto count = static_cast<std::ptrdiff_t>(std::min(kStoredAtOnce, frames.size() - at));
    link.store(at, {first, first + count});
    if (!pace.wait_until(pace.now())) {
      report.stopped = true;
      return;
    }
  }
  const double start = pace.now();
  link.play_stored(frames.size(), options.rate);
  report.sent = frames.size();
  while (!report.stopped && pace.now() - start < options.seconds - kSlack) {
    report.stopped = !pace.wait_until(start + std::min(options.seconds, pace.now() - start + kCheckPeriod));
    link.check();
    report.seconds = pace.now() - start;
  }
}

void play(const FrameStream& stream, ArrayLink& link, double seconds, Pace& pace, PlayReport& report,
          const FrameObserver& observer) {
  require_positive("seconds", seconds);
  require_positive("stale", stream.stale);
  try {
    StreamPlayer(stream, link, pace, report, observer).play(seconds);
  } catch (...) {
    try {
      link.silence();
    } catch (const std::exception&) {  // it is lost: the first error says so
    }
    throw;
  }
  link.silence();
}

}  // namespace touchfield
