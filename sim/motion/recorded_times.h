#pragma once

#include <cstddef>
#include <vector>

namespace touchfield {

/// The times of a recording, counted from its first frame.
class RecordedTimes {
 public:
  /// seconds   rising, from any start; one or more
  explicit RecordedTimes(std::vector<double> seconds);

  std::size_t size() const { return seconds_.size(); }
  double seconds(std::size_t frame) const { return seconds_.at(frame); }
  /// The newest frame at a time [s], which may be half a tick of the clock early.
  std::size_t newest(double seconds) const;
  /// What is recorded [s]: the last frame holds for as long as one usually does, the median of the last 32.
  double covered() const;

 private:
  std::vector<double> seconds_;
};

}  // namespace touchfield
