#pragma once

#include <string>

#include "hardware/array_link.h"

namespace touchfield {

/// The descriptor that a guard finds its end of the program's socket at.
inline constexpr int kGuardDescriptor = 3;

/// The guard: owns a device on behalf of the program at the other end of a socket, and outlives it.
///
/// It stops the device: it sends a silent frame, commits and closes, each within kLinkPatience. The reasons are:
///
///   - it is told to
///   - any of StopSignals::all() comes
///   - the device fails
///   - kGuardGrace has passed since the end of the time that the program may emit
///   - the program is gone, or it was silent for 250 ms while the device may emit (stopped, frozen, stuck)
///   - the guard itself did not look for longer than kLongestGap while the device may emit
///
/// The program that asked gets the error of a device that fails. Every other stop that the guard was not told to make
/// is reported on standard error. The guard refuses frames above the level it was given. SIGKILL and SIGSTOP of the
/// guard itself are the program's business, see GuardedLink.
///
/// throws   InputError if no program has handed it a socket
void run_guard();

/// How much later than its owner the guard ends an emission that took its time [s].
inline constexpr double kGuardGrace = 0.25;

/// How the last that was asked of a device went.
struct Silencing {
  bool silent = false;
  std::string text;  // "the array is silent after 3 ms", or why it is not
};

/// Silences an open device, which stays open. The system may block the caller that closes a stalled line, and the
/// result is to be reported before that.
Silencing silenced(ArrayLink& link);

/// "; the array may still be on: switch off its supply": said wherever nobody can tell.
inline constexpr const char* kMayBeOn = "; the array may still be on: switch off its supply";

}  // namespace touchfield
