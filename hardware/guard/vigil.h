#pragma once

#include <optional>
#include <string>
#include <sys/types.h>

#include "sim/core/child_process.h"

namespace touchfield {

/// What the system says of a process.
struct ProcessState {
  char letter = 'S';  // of /proc/PID/stat: R runs or waits for a processor, T is stopped, t held by a debugger, ...
  double worked = 0;  // time that it had a processor [s]
};

/// How long another process has said nothing, counted in looks. A look counts for kLongestLook at most, and only the
/// time in which the watched process could run counts. A pause of the whole machine, or of the one who looks, is not
/// the other's silence. Neither is waiting for a processor.
class Silence {
 public:
  explicit Silence(double now) : last_(now) {}
  /// The other one said something.
  void heard(double now);
  /// returns   whether it has now said nothing for too long
  bool look(double now, const ProcessState& state);

 private:
  double last_;        // heard or looked [s]
  double worked_ = 0;  // by then [s]
  double silent_ = 0;  // [s]
};

/// Time between looks at another process [s].
inline constexpr double kLookPeriod = 0.02;
/// What a look counts for at most [s].
inline constexpr double kLongestLook = 2 * kLookPeriod;
/// Silence that is too long [s]: with a look's period, it is found within 250 ms.
inline constexpr double kLongestSilence = 0.225;

/// A watch over another process of this machine, which has to say something all the time and must not be stopped.
class Vigil {
 public:
  /// throws   IoError if the system does not show the process or its state
  Vigil(pid_t process, double now);

  /// It said something.
  void heard(double now) { silence_.heard(now); }
  /// To be called every kLookPeriod while it has to speak.
  /// returns   "was stopped by a signal", "was held by a debugger", "said nothing for 250 ms", or nothing if all is
  ///           well
  std::optional<std::string> fault(double now);
  /// Whether a signal has stopped it.
  bool is_stopped() const;
  /// Lets it continue if it is stopped.
  void resume() const;

 private:
  /// Nothing if it is gone.
  std::optional<ProcessState> state() const;

  // Both go with the process and not with its number.
  pid_t number_;
  Descriptor process_;  // none where the system has none: the number serves then
  Descriptor file_;     // /proc/PID/stat
  Silence silence_;
};

}  // namespace touchfield
