#include <filesystem>
#include <memory>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "apps/commands/command_line.h"
#include "apps/commands/commands.h"
#include "apps/commands/standard_streams.h"
#include "sim/core/files.h"
#include "sim/core/json.h"
#include "sim/core/require.h"
#include "sim/scene/input.h"
#include "sim/scene/schema_info.h"

namespace touchfield {

namespace {

constexpr const char* kScene = R"(# A hand above an array feels a strip on the pad of its index finger.
name: {}

# Transducers in the plane z = 0, emitting along +z. Others: autd3, sonicsurface, positions (a file).
array:
  grid: {{count: [44, 34], pitch_mm: 10.16}}
  level: 0.32                      # of full drive

# The body whose skin scatters the sound. Others: mesh (a file), capsule, sphere, box.
body:
  hand: {{pose: index_up}}
  place: {{landmark: index_pad, at_mm: [0, 0, 200]}}
  edge_mm: {{near_target: 1.6, far: 6.5, within_mm: 12}}  # shorter edges: less error, more time

# The target: the skin in a box, and the pressure that is wanted there.
target:
  box: {{at: index_pad, size_mm: [8, 20, 6]}}
  pressure_pa: best                # or a number

# The methods that search the phases.
solve:
  methods: [surface, unscattered, focus]
)";

struct InitCommand {
  std::string name;
  bool force = false;
};

int init_command(const InitCommand& command, const CommonFlags& flags) {
  std::filesystem::path path(command.name);
  path += path.extension() == ".yaml" ? "" : ".yaml";
  const std::string name = path.stem().string();
  require(schema::is_name(name), "init: the name {} must be letters, digits, _ and -",
          schema::quoted_for_message(name));
  require_free_output(path.string(), command.force);
  write_atomically(path.string(), {fmt::format(kScene, name)});
  if (flags.json) {
    put(json_text(nlohmann::ordered_json{{"file", path.string()}}, 2) + '\n');
  } else if (!flags.quiet) {
    put(fmt::format("{}: next, touchfield run {}\n", path.string(), path.string()));
  }
  return 0;
}

}  // namespace

void add_init_command(CLI::App& app, Invocation& invocation) {
  const auto init = std::make_shared<InitCommand>();
  CLI::App* command = app.add_subcommand("init", "Write a short scene with comments to start from");
  command->add_option("NAME", init->name, "Name of the scene; the file is NAME.yaml")->required();
  command->add_flag("--force", init->force, "Replace the file if it exists");
  finish_command(command, invocation, [init](const Invocation& invoked) { return init_command(*init, invoked.flags); });
}

}  // namespace touchfield
