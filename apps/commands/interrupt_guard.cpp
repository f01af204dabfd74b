#include "apps/commands/interrupt_guard.h"

#include <algorithm>
#include <csignal>
#include <ctime>
#include <thread>
#include <unistd.h>
#include <utility>

#include "hardware/stop_signals.h"

namespace touchfield {

void block_interrupts() {
  const sigset_t set = StopSignals::polite();
  pthread_sigmask(SIG_BLOCK, &set, nullptr);
}

int take_interrupt() {
  const sigset_t set = StopSignals::polite();
  const timespec at_once{};
  return std::max(0, sigtimedwait(&set, nullptr, &at_once));
}

std::string interrupt_text(int signal) {
  return StopSignals::name(signal) + (signal == SIGXCPU ? ", the limit on processor time (ulimit -t)" : "");
}

void handle_interrupts(std::function<void(const char* signal_name)> on_interrupt) {
  std::thread([act = std::move(on_interrupt)] {
    const sigset_t set = StopSignals::polite();
    int signal = 0;
    if (sigwait(&set, &signal) == 0) {
      act(interrupt_text(signal).c_str());
      _exit(128 + signal);
    }
  }).detach();
}

}  // namespace touchfield
