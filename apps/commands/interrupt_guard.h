#pragma once

#include <functional>
#include <string>

namespace touchfield {

/// Signals are taken by a thread of their own, so that a long factorisation does not delay them. Block them before the
/// first thread starts.
void block_interrupts();

/// The signal that has come since then and that nobody has taken, SIGINT, SIGTERM, SIGHUP or SIGXCPU; 0: none.
int take_interrupt();

/// Its name, and of SIGXCPU what it stands for.
std::string interrupt_text(int signal);

/// Waits beside the caller for SIGINT, SIGTERM or SIGHUP, calls `on_interrupt` with the signal's name, and ends the
/// process with 128 + signal. Runs until the process ends.
void handle_interrupts(std::function<void(const char* signal_name)> on_interrupt);

}  // namespace touchfield
