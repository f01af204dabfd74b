#include "apps/commands/interrupt_guard.h"

#include <csignal>
#include <thread>
#include <unistd.h>
#include <utility>

namespace touchfield {

namespace {

sigset_t interrupts() {
  sigset_t set;
  sigemptyset(&set);
  sigaddset(&set, SIGINT);
  sigaddset(&set, SIGTERM);
  sigaddset(&set, SIGHUP);
  return set;
}

}  // namespace

void block_interrupts() {
  const sigset_t set = interrupts();
  pthread_sigmask(SIG_BLOCK, &set, nullptr);
}

void handle_interrupts(std::function<void(const char* signal_name)> on_interrupt) {
  std::thread([act = std::move(on_interrupt)] {
    const sigset_t set = interrupts();
    int signal = 0;
    if (sigwait(&set, &signal) == 0) {
      act(signal == SIGINT ? "SIGINT" : signal == SIGTERM ? "SIGTERM" : "SIGHUP");
      _exit(128 + signal);
    }
  }).detach();
}

}  // namespace touchfield
