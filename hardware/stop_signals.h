#pragma once

#include <csignal>
#include <string>

#include "hardware/player.h"

namespace touchfield {

/// Takes signals in turn with other work, instead of letting them end or stop the process: from the construction on
/// all() wait until they are asked for. To be made before the process has threads that do not block them.
class StopSignals {
 public:
  /// throws   IoError if the system refuses
  StopSignals();
  /// Lets the signals through again that were not held back before; one that was not asked for then takes effect.
  ~StopSignals();
  StopSignals(const StopSignals&) = delete;
  StopSignals& operator=(const StopSignals&) = delete;

  /// Readable when a signal has come.
  int descriptor() const { return descriptor_; }
  /// Waits for a signal, at most so many seconds.
  /// returns  whether one has come, now or before
  bool wait(double seconds);
  /// The first signal that came; 0: none.
  int signal() const { return signal_; }
  /// SIGINT, SIGTERM and SIGHUP: those that ask a program to end.
  static sigset_t polite();
  /// Every signal that ends or stops a process, but for SIGKILL and SIGSTOP, which nobody can hold back. A fault of the
  /// process's own (SIGSEGV, SIGABRT, ...) still ends it at once.
  static sigset_t all();
  /// "SIGINT", ...
  static std::string name(int signal);

 private:
  sigset_t before_;
  int descriptor_;
  int signal_ = 0;
};

/// The steady clock, stopped by a signal.
class SignalledPace final : public Pace {
 public:
  explicit SignalledPace(StopSignals& signals) : signals_(signals) {}
  double now() override;
  bool wait_until(double t) override;

 private:
  StopSignals& signals_;
};

}  // namespace touchfield
