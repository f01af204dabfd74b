#pragma once

#include <csignal>
#include <string>

#include "hardware/attention.h"
#include "hardware/player.h"

namespace touchfield {

/// Takes signals in turn with other work, instead of letting them end or stop the process. From the construction on,
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
  /// SIGINT, SIGTERM, SIGHUP and SIGXCPU: those that ask a program to end.
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

/// The clock of steady_now, stopped by a signal; and by a gap in which nobody looked after an array that is on.
class SignalledPace final : public Pace {
 public:
  /// on   whether there is such an array
  SignalledPace(StopSignals& signals, bool on) : signals_(signals), on_(on) { attention_.begin(now()); }
  double now() override;
  bool wait_until(double t) override;
  /// To be called at the end, so that the time since the last wait counts.
  void end() { look(0); }
  /// Whether a gap has stopped it.
  bool overslept() const { return overslept_; }
  const Attention& attention() const { return attention_; }

 private:
  void look(double planned) { overslept_ = (attention_.look(now(), planned) && on_) || overslept_; }

  StopSignals& signals_;
  bool on_;
  bool overslept_ = false;
  Attention attention_;
};

}  // namespace touchfield
