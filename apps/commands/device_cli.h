#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "apps/commands/device_commands.h"

namespace CLI {
class App;
}

namespace touchfield {

/// The command lines of `send` and `array`, and of the hidden commands that the guard and its watchdog are.
struct DeviceCommands {
  SendCommand send;
  ArrayCommand array;
  CLI::App* send_app = nullptr;
  CLI::App* guard_app = nullptr;
  CLI::App* watchdog_app = nullptr;
  std::vector<std::pair<CLI::App*, ArrayCommand::Action>> array_apps;
  std::optional<double> temperature_c;
  std::vector<double> at_mm;
};

/// Adds the commands; `state` has to outlive the app. add_common: adds the flags that every command takes.
void add_device_commands(CLI::App& app, DeviceCommands& state, const std::function<void(CLI::App*)>& add_common);

/// Runs the one of them that was parsed; nothing if it was another command.
std::optional<int> run_device_commands(DeviceCommands& state, const CommonFlags& flags);

/// How this program is started as the watchdog of a link's guard.
std::vector<std::string> watchdog_command();

}  // namespace touchfield
