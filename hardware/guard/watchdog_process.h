#pragma once

#include <string>
#include <vector>

namespace touchfield {

/// The watchdog: starts a guard in a session of its own, hands it the channel to the program, and watches it.
///
/// A guard that is stopped, or silent for 250 ms while the device may emit, is continued and asked to quiet the device
/// and to end. If that does not help within kMercy, it is killed. If it then does not end within kHopeless, as a frozen
/// one, the watchdog says so. It is asked to end as well when the watchdog itself did not look for longer than
/// kLongestGap. When a guard is gone that has not quieted its device, the watchdog opens the device itself and quiets
/// it, and tells of it on standard error. It passes every signal that would end or stop it on to the guard. The guard
/// in turn quiets the device when its watchdog is stopped, silent or gone.
///
/// descriptor      its end of the channel between the program and the guard
/// guard_command   program and arguments that call run_guard(kGuardDescriptor)
/// returns         the exit code of the process: the guard's, or of a device that it had to quiet 0, or 4 if it could
///                 not
/// throws          InputError if the descriptor is no socket; IoError if the guard cannot be started
int run_watchdog(int descriptor, const std::vector<std::string>& guard_command);

/// Time that a guard that was stopped has to come back [s].
inline constexpr double kMercy = 0.1;
/// Time after which a guard that was killed is told of that has not ended [s].
inline constexpr double kHopeless = 1;

}  // namespace touchfield
