#include "apps/commands/commands.h"

#include <string>

#include <CLI/CLI.hpp>

#include "apps/commands/command_line.h"
#include "sim/core/errors.h"

namespace touchfield {

namespace {

struct Command {
  void (*add)(CLI::App&, Invocation&);
  const char* group;
  const char* examples;  // a line each, each but the first after two spaces
};

constexpr const char* kStills = "Scenes";
constexpr const char* kMotions = "Moving hands";
constexpr const char* kResults = "Results";
constexpr const char* kMeshes = "Meshes";
constexpr const char* kArrays = "Arrays";
constexpr const char* kHelp = "Help";

constexpr Command kCommands[] = {
    {add_init_command, kStills, "touchfield init mine"},
    {add_check_command, kStills, "touchfield check mine.yaml\n  touchfield check mine.yaml --accuracy"},
    {add_run_command, kStills,
     "touchfield run mine.yaml -o mine\n  "
     "touchfield run mine.yaml -o wide --set target.box.size_mm=[11,20,6]\n  "
     "touchfield run --from mine -o again"},
    {add_sweep_command, kStills,
     "touchfield sweep heights.yaml -o heights --jobs 2\n  touchfield sweep heights.yaml --list"},
    {add_study_command, kStills, "touchfield study mine.yaml -o study"},
    {add_pattern_command, kStills, "touchfield pattern circle.yaml -o circle --check 10"},
    {add_play_command, kMotions, "touchfield play moving.yaml -o played"},
    {add_live_command, kMotions,
     "touchfield live moving.yaml -o live\n  touchfield live moving.yaml --to sonicsurface:/dev/ttyUSB0 --emit"},
    {add_see_command, kMotions, "touchfield see cameras.yaml -o images"},
    {add_fit_command, kMotions, "touchfield fit images -o hand"},
    {add_info_command, kResults, "touchfield info mine/run.h5"},
    {add_view_command, kResults, "touchfield view mine\n  touchfield view mine -o mine.html"},
    {add_felt_command, kResults,
     "touchfield felt mine --set felt.modulation_hz=100\n  touchfield felt circle --against mine"},
    {add_compare_command, kResults, "touchfield compare mine wide\n  touchfield compare mine --points measured.csv"},
    {add_hand_command, kMeshes, "touchfield hand -o hand.stl --pose flat --edge-mm 3"},
    {add_mesh_command, kMeshes,
     "touchfield mesh scan.ply --unit mm\n  touchfield mesh scan.ply --resurface 2 -o hand.obj"},
    {add_send_command, kArrays,
     "touchfield send mine/run.h5 --method surface\n  "
     "touchfield send circle --repeat --seconds 2\n  "
     "touchfield send mine/run.h5 --method surface --to sonicsurface:/dev/ttyUSB0 --emit"},
    {add_array_command, kArrays,
     "touchfield array list\n  touchfield array walk --to sonicsurface:/dev/ttyUSB0 --emit"},
    {add_doctor_command, kHelp, "touchfield doctor"},
    {add_schema_command, kHelp, "touchfield schema edge_mm\n  touchfield schema --format markdown"},
};

}  // namespace

#ifndef TOUCHFIELD_CAMERAS

namespace {

void add_missing_command(CLI::App& app, Invocation& invocation, const std::string& name) {
  CLI::App* command = app.add_subcommand(name, "Not in this program, which was built without cameras")->allow_extras();
  command->callback([&invocation, name] {
    invocation.action = [name]() -> int {
      throw NotBuiltError(name + ": this program was built without cameras: configure with -DTOUCHFIELD_CAMERAS=ON");
    };
  });
}

}  // namespace

void add_see_command(CLI::App& app, Invocation& invocation) { add_missing_command(app, invocation, "see"); }
void add_fit_command(CLI::App& app, Invocation& invocation) { add_missing_command(app, invocation, "fit"); }

#endif

void add_commands(CLI::App& app, Invocation& invocation) {
  const auto all = [&app] { return app.get_subcommands([](const CLI::App*) { return true; }); };
  for (const Command& command : kCommands) {
    const std::size_t before = all().size();
    command.add(app, invocation);
    CLI::App* added = all()[before];
    added->group(command.group)->footer(std::string("Examples:\n  ") + command.examples);
  }
  add_link_guard(app, invocation);
}

}  // namespace touchfield
