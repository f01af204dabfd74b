#include "apps/commands/interrupt_guard.h"

#include <csignal>
#include <string>
#include <thread>
#include <unistd.h>
#include <utility>

#include "hardware/stop_signals.h"

namespace touchfield {

void block_interrupts() {
  const sigset_t set = StopSignals::polite();
  pthread_sigmask(SIG_BLOCK, &set, nullptr);
}

void handle_interrupts(std::function<void(const char* signal_name)> on_interrupt) {
  std::thread([act = std::move(on_interrupt)] {
    const sigset_t set = StopSignals::polite();
    int signal = 0;
    if (sigwait(&set, &signal) == 0) {
      const std::string why = signal == SIGXCPU ? ", the limit on processor time (ulimit -t)" : "";
      act((StopSignals::name(signal) + why).c_str());
      _exit(128 + signal);
    }
  }).detach();
}

}  // namespace touchfield
