#include <memory>

#include <fmt/format.h>

#include "apps/commands/command_line.h"
#include "apps/commands/commands.h"
#include "apps/commands/run_json.h"
#include "apps/commands/standard_streams.h"
#include "sim/store/run_file.h"

namespace touchfield {

namespace {

int info_command(const std::string& path, const CommonFlags& flags) {
  const Run run = read_run_file(run_file_at(path));
  if (!flags.json) {
    put(describe_run(run));
    return 0;
  }
  const nlohmann::ordered_json json = {{"name", run.name},
                                       {"complete", run.complete},
                                       {"faces", run.mesh.face_count()},
                                       {"channels", run.array.size()},
                                       {"target_faces", run.target ? run.target->size() : 0},
                                       {"methods", methods_json(run)},
                                       {"version", run.provenance.version},
                                       {"revision", run.provenance.revision},
                                       {"command_line", run.provenance.command_line},
                                       {"scene_hash", run.provenance.scene_hash}};
  put(fmt::format("{}\n", json.dump(2)));
  return 0;
}

}  // namespace

void add_info_command(CLI::App& app, Invocation& invocation) {
  const auto path = std::make_shared<std::string>();
  CLI::App* command = app.add_subcommand("info", "Describe a run.h5");
  command->add_option("RUN", *path, "run.h5, or the directory that holds it")->required();
  finish_command(command, invocation, [path](const Invocation& invoked) { return info_command(*path, invoked.flags); });
}

}  // namespace touchfield
