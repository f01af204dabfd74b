#include "apps/commands/command_line.h"
#include "apps/commands/commands.h"
#include "apps/commands/device_options.h"
#include "hardware/guard/guard_process.h"

namespace touchfield {

namespace {

constexpr const char* kGuardName = "link-guard";

}  // namespace

std::vector<std::string> guard_command() { return {"/proc/self/exe", kGuardName}; }

void add_link_guard(CLI::App& app, Invocation& invocation) {
  add_hidden_command(app, invocation, kGuardName, [] {
    run_guard();
    return 0;
  });
}

}  // namespace touchfield
