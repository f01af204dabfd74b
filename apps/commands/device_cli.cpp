#include "apps/commands/device_cli.h"

#include <CLI/CLI.hpp>

#include "hardware/guard/guard_process.h"
#include "hardware/guard/guard_start.h"
#include "hardware/guard/watchdog_process.h"
#include "sim/core/units.h"

namespace touchfield {

namespace {

constexpr const char* kGuardName = "link-guard";
constexpr const char* kWatchdogName = "link-watchdog";

void add_device(CLI::App* command, DeviceOptions& device) {
  command
      ->add_option("--to", device.link,
                   "dry-run[:FILE][?levels=N], sonicsurface:PORT[?firmware=primary|secondary|tactile], autd3:audit, "
                   "autd3:nop, autd3:remote:HOST:PORT, autd3:twincat")
      ->capture_default_str();
  command->add_option("--library", device.library, "The AUTD3 vendor's library, or the folder that holds it");
}

void add_emission(CLI::App* command, DeviceOptions& device) {
  command->add_flag("--emit", device.emit, "Emit sound; without it everything is done but that");
  command->add_option("--level", device.level,
                      "Drive of a transducer at full amplitude, 0..1; default: 0.5, or 1 where a device has no other");
  command->add_option("--max-level", device.most_level, "Cap on the level")->capture_default_str();
  command->add_option("--max-seconds", device.most_seconds, "Cap on the time of emission [s]")->capture_default_str();
  auto* modulation =
      command->add_option("--modulation", device.frequency, "Modulate the amplitude by a sine of this frequency [Hz]");
  command->add_option("--depth", device.depth, "Depth of that sine, 0..1")->needs(modulation)->capture_default_str();
  command
      ->add_option("--modulation-samples", device.samples,
                   "File of modulation samples 0..255, played round and round at the device's own rate")
      ->excludes(modulation);
  command->add_flag("--force", device.force, "Replace the files of a dry run that are there");
}

}  // namespace

void add_device_commands(CLI::App& app, DeviceCommands& state, const std::function<void(CLI::App*)>& add_common) {
  SendCommand& send = state.send;
  state.send_app = app.add_subcommand("send", "Send the phases of runs to an array");
  state.send_app->add_option("RUN", send.runs, "run.h5, or the directory that holds it; several are a sequence")
      ->required();
  state.send_app->add_option("--method", send.method, "Which method's phases; default: the only one there is");
  add_device(state.send_app, send.device);
  add_emission(state.send_app, send.device);
  state.send_app->add_option("--seconds", send.seconds,
                             "Time of emission, the last frame is held; default: 1 s for one run, else once through");
  state.send_app->add_option("--rate", send.rate, "Frames a second of a sequence")->capture_default_str();
  state.send_app->add_flag("--repeat", send.repeat, "Begin a sequence again after its last frame");
  add_common(state.send_app);

  ArrayCommand& array = state.array;
  CLI::App* array_app = app.add_subcommand("array", "What a bench needs: list, test, walk, off");
  array_app->require_subcommand(1);
  const auto add_action = [&](const char* name, const char* what, ArrayCommand::Action action) {
    CLI::App* action_app = array_app->add_subcommand(name, what);
    add_device(action_app, array.device);
    action_app->add_option("--run", array.run,
                           "A run of this array: where its units sit, or what a dry run stands for");
    add_common(action_app);
    state.array_apps.emplace_back(action_app, action);
    return action_app;
  };
  add_action("list", "Links there are and serial ports; with --to: what that device is", ArrayCommand::Action::kList);
  CLI::App* test = add_action("test", "A focus at a point", ArrayCommand::Action::kTest);
  add_emission(test, array.device);
  test->add_option("--at-mm", state.at_mm, "The focus, x y z in the array's own frame; default: 0 0 150")->expected(3);
  test->add_option("--temperature-c", state.temperature_c, "Of the air; default: 20");
  test->add_option("--seconds", array.seconds, "Time of emission")->capture_default_str();
  CLI::App* walk = add_action("walk", "One transducer after another, to check the wiring", ArrayCommand::Action::kWalk);
  add_emission(walk, array.device);
  walk->add_option("--first", array.first, "Number of the first transducer, from 0")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  walk->add_option("--count", array.count, "How many; default: to the last")->check(CLI::PositiveNumber);
  walk->add_option("--dwell", array.dwell, "Time on each [s]")->capture_default_str();
  add_action("off", "Switch every transducer off", ArrayCommand::Action::kOff);

  state.guard_app = app.add_subcommand(kGuardName, "")->group("");
  state.watchdog_app = app.add_subcommand(kWatchdogName, "")->group("");
}

std::optional<int> run_device_commands(DeviceCommands& state, const CommonFlags& flags) {
  if (state.guard_app->parsed()) {
    return run_guard(kGuardDescriptor);
  }
  if (state.watchdog_app->parsed()) {
    return run_watchdog(kGuardDescriptor, {"/proc/self/exe", kGuardName});
  }
  if (state.send_app->parsed()) {
    return send_command(state.send, flags);
  }
  for (const auto& [app, action] : state.array_apps) {
    if (app->parsed()) {
      state.array.action = action;
      if (!state.at_mm.empty()) {
        state.array.at = kMillimetre * Vector3(state.at_mm[0], state.at_mm[1], state.at_mm[2]);
      }
      if (state.temperature_c) {
        state.array.temperature = *state.temperature_c + kZeroCelsius;
      }
      return array_command(state.array, flags);
    }
  }
  return std::nullopt;
}

std::vector<std::string> watchdog_command() { return {"/proc/self/exe", kWatchdogName}; }

}  // namespace touchfield
