#pragma once

#include <cstddef>
#include <string>

namespace touchfield {

/// Times in which a process that has to look after an array all the time did not.
struct Gaps {
  std::size_t count = 0;  // longer than kShownGap
  double longest = 0;     // [s]
};

/// A gap that is counted [s].
inline constexpr double kShownGap = 0.05;
/// A gap that ends an emission [s]: as long as the silence of another process that ends it. On a machine with three
/// times as many busy processes as cores a gap is 21 ms at most, with twelve times as many 139 ms.
inline constexpr double kLongestGap = 0.25;

/// Whether a process looks after an array all the time. One that was stopped, frozen or throttled, or whose machine
/// slept, cannot be told of it: it sees it from the clock when it continues.
class Attention {
 public:
  /// It has to look from now on.
  void begin(double now) { last_ = now; }
  /// It looks.
  /// planned   how long after the last look, or the beginning, it was to look again [s]
  /// returns   whether that was more than kLongestGap ago
  bool look(double now, double planned);

  const Gaps& gaps() const { return gaps_; }
  /// "did not look after the array for 2.00 s (at most 0.25 s): ..." of the longest gap.
  std::string fault() const;

 private:
  double last_ = 0;  // [s]
  Gaps gaps_;
};

/// Patience for another process: it does not run out while the one who waits is stopped or frozen, and so the other one
/// as well.
class Patience {
 public:
  Patience(double seconds, double now) : left_(seconds), last_(now) {}
  /// To be asked at least every kPatienceStep.
  /// returns   whether it is over
  bool over(double now);

 private:
  double left_;  // [s]
  double last_;  // asked [s]
};

inline constexpr double kPatienceStep = 0.02;  // [s]

}  // namespace touchfield
