#pragma once

#include <functional>

namespace touchfield {

/// Signals are taken by a thread of their own, so that a long factorisation does not delay them. Block them before the
/// first thread starts.
void block_interrupts();

/// Waits beside the caller for SIGINT, SIGTERM or SIGHUP, calls `on_interrupt` with the signal's name, and ends the
/// process with 128 + signal. Runs until the process ends.
void handle_interrupts(std::function<void(const char* signal_name)> on_interrupt);

}  // namespace touchfield
