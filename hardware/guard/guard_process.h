#pragma once

namespace touchfield {

/// The guard: owns a device on behalf of the process at the other end of a socket, and outlives it.
///
/// It sends a quiet frame, commits and closes the device, each within kLinkPatience, when it is told to, when SIGINT,
/// SIGTERM or SIGHUP comes, when the socket closes because its owner is gone, when the time that its owner may emit
/// is over by kGuardGrace, and when the device fails. Of every stop but the first it tells on standard error. It
/// refuses frames above the level it was given. SIGKILL of the guard itself is out of its reach.
///
/// descriptor   its end of the socket
/// returns      the exit code of the process: 0, or 4 if the device could not be quieted
/// throws       InputError if the descriptor is no socket
int run_guard(int descriptor);

/// How much later than its owner the guard ends an emission that took its time [s].
inline constexpr double kGuardGrace = 0.25;

}  // namespace touchfield
