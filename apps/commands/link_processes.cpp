#include "apps/commands/command_line.h"
#include "apps/commands/commands.h"
#include "apps/commands/device_options.h"
#include "hardware/guard/guard_process.h"
#include "hardware/guard/guard_start.h"
#include "hardware/guard/watchdog_process.h"

namespace touchfield {

namespace {

constexpr const char* kProgram = "/proc/self/exe";
constexpr const char* kGuardName = "link-guard";
constexpr const char* kWatchdogName = "link-watchdog";

}  // namespace

std::vector<std::string> watchdog_command() { return {kProgram, kWatchdogName}; }

void add_link_processes(CLI::App& app, Invocation& invocation) {
  add_hidden_command(app, invocation, kGuardName, [] { return run_guard(kGuardDescriptor); });
  add_hidden_command(app, invocation, kWatchdogName, [] {
    return run_watchdog(kGuardDescriptor, {kProgram, kGuardName});
  });
}

}  // namespace touchfield
