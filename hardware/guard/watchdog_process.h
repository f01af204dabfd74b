#pragma once

#include <string>
#include <vector>

namespace touchfield {

/// The watchdog: starts a guard in a session of its own, hands it the channel to the program, and watches it.
///
/// While the device may emit, a guard that is stopped, or silent for 250 ms, is continued and asked to quiet the device
/// and to end. If that does not help within kMercy, the guard is killed. If it has not ended kHopeless after its fault
/// was found, for example because it is frozen, the watchdog says so. The guard is also asked to end when the watchdog
/// itself did not look for longer than kLongestGap meanwhile. If a guard is gone and has not quieted its device, the
/// watchdog opens the device itself and quiets it. It reports this on standard error. The watchdog passes the first
/// signal that would end or stop it on to the guard. The guard in turn quiets the device when its watchdog is stopped,
/// silent or gone.
///
/// descriptor      its end of the channel between the program and the guard
/// guard_command   program and arguments that call run_guard(kGuardDescriptor)
/// returns         the exit code of the process: the guard's, or after it took over the device 0, or 4 if it could
///                 not quiet that
/// throws          InputError if the descriptor is not a socket; IoError if the guard cannot be started
int run_watchdog(int descriptor, const std::vector<std::string>& guard_command);

/// Time that a guard that was stopped has to come back [s].
inline constexpr double kMercy = 0.1;
/// Time from the fault of a guard to the report that it cannot be ended [s].
inline constexpr double kHopeless = 1;

}  // namespace touchfield
