#include <filesystem>
#include <memory>

#include <fmt/format.h>

#include "apps/commands/command_line.h"
#include "apps/commands/commands.h"
#include "apps/commands/run_json.h"
#include "apps/commands/standard_streams.h"
#include "sim/core/json_text.h"
#include "sim/store/archive_file.h"
#include "sim/store/motion_file.h"
#include "sim/store/motion_summary.h"
#include "sim/store/motion_text.h"
#include "sim/store/run_file.h"

namespace touchfield {

namespace {

/// Which file of a directory is described: that of a run, of a motion where that is the only one.
std::string result_file_at(const std::string& path) {
  const std::filesystem::path folder = path;
  const bool motion = !std::filesystem::exists(folder / "run.h5") && std::filesystem::exists(folder / "motion.h5");
  return motion ? (folder / "motion.h5").string() : run_file_at(path);
}

nlohmann::ordered_json json_of(const Run& run) {
  return {{"name", run.name},
          {"complete", run.complete},
          {"faces", run.mesh.face_count()},
          {"channels", run.array.size()},
          {"target_faces", run.target ? run.target->size() : 0},
          {"solved_skin", to_string(run.solved_skin)},
          {"judged_skin", to_string(run.judged_skin)},
          {"methods", methods_json(run)},
          {"version", run.provenance.version},
          {"revision", run.provenance.revision},
          {"command_line", run.provenance.command_line},
          {"scene_hash", run.provenance.scene_hash}};
}

nlohmann::ordered_json json_of(const Motion& motion) {
  nlohmann::ordered_json methods = nlohmann::ordered_json::array();
  for (const MotionMethod& method : motion.methods) {
    nlohmann::ordered_json entry = {{"name", method.name}, {"method", method.method}, {"scheme", method.scheme}};
    for (const auto& [name, value] : summary_columns(summary(method))) {
      entry[name] = number_or_null(value);
    }
    methods.push_back(std::move(entry));
  }
  return {{"name", motion.name},
          {"complete", motion.complete},
          {"seconds", motion.seconds},
          {"faces", motion.mesh.face_count()},
          {"judge_faces", motion.judge ? motion.judge->face_count() : motion.mesh.face_count()},
          {"channels", motion.array.size()},
          {"solved_skin", to_string(motion.solved_skin)},
          {"judged_skin", to_string(motion.judged_skin)},
          {"methods", methods},
          {"version", motion.provenance.version},
          {"revision", motion.provenance.revision},
          {"command_line", motion.provenance.command_line},
          {"scene_hash", motion.provenance.scene_hash}};
}

int info_command(const std::string& path, const CommonFlags& flags) {
  const std::string file = result_file_at(path);
  const auto print = [&](const auto& result, const auto& describe) {
    put(flags.json ? fmt::format("{}\n", json_text(json_of(result), 2)) : describe(result));
  };
  if (archive_format(file) == kMotionArchive.name()) {
    print(read_motion_file(file), describe_motion);
  } else {
    print(read_run_file(file), describe_run);
  }
  return 0;
}

}  // namespace

void add_info_command(CLI::App& app, Invocation& invocation) {
  const auto path = std::make_shared<std::string>();
  CLI::App* command = app.add_subcommand("info", "Describe a run.h5 or a motion.h5");
  command->add_option("RUN", *path, "run.h5 or motion.h5, or the directory that holds it")
      ->required()
      ->type_name(kH5File);
  finish_command(command, invocation, [path](const Invocation& invoked) { return info_command(*path, invoked.flags); });
}

}  // namespace touchfield
