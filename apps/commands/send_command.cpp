#include <memory>

#include <fmt/format.h>

#include "apps/commands/command_line.h"
#include "apps/commands/commands.h"
#include "apps/commands/device_options.h"
#include "sim/core/errors.h"
#include "sim/store/run_file.h"

namespace touchfield {

namespace {

struct SendCommand {
  DeviceOptions options;
  std::vector<std::string> runs;  // run.h5 or its directory, in the order of the sequence
  std::string method;             // empty: the runs' only one
};

const MethodResult& chosen_method(const Run& run, const std::string& name, const std::string& path) {
  if (name.empty() && run.methods.size() == 1) {
    return run.methods.front();
  }
  std::string known;
  for (const MethodResult& method : run.methods) {
    if (method.name == name) {
      return method;
    }
    known += (known.empty() ? "" : ", ") + method.name;
  }
  throw InputError(
      name.empty() ? fmt::format("{}: it has the methods {}; --method picks one", path, known)
                   : fmt::format("{}: it has no method '{}', it has {}", path, name, known.empty() ? "none" : known));
}

int send_command(const SendCommand& command, const CommonFlags& flags) {
  EmissionPlan plan = plan_of(command.options);
  std::vector<Drive> drives;
  for (const std::string& path : command.runs) {
    plan.read.push_back(run_file_at(path));
    const Run run = read_run_file(plan.read.back());
    if (!run.complete) {
      throw InputError(
          fmt::format("{}: complete = 0: the run did not finish, so its phases are not sent; "
                      "`touchfield run --from` computes it again",
                      path));
    }
    const MethodResult& method = chosen_method(run, command.method, path);
    drives.push_back({method.solution.phases, method.solution.amplitudes});
    plan.must_match.push_back(run.array);
  }
  plan.array = layout_of(plan.must_match.front());
  plan.drives = [&](const ArrayLayout&) { return drives; };
  return print_emission(emit(plan), flags);
}

}  // namespace

void add_send_command(CLI::App& app, Invocation& invocation) {
  const auto send = std::make_shared<SendCommand>();
  EmissionRequest& request = send->options.request;
  request.rate = 10;
  CLI::App* command = app.add_subcommand("send", "Send the phases of runs to an array");
  command->add_option("RUN", send->runs, "run.h5, or the directory that holds it; several make a sequence")
      ->required()
      ->type_name(kH5File);
  command->add_option("--method", send->method, "Method of the phases; default: the only one");
  add_device(command, send->options);
  add_emission(command, send->options);
  add_number(
      command, "--seconds", request.seconds, schema::above(0),
      "Time of emission [s], the last frame is held; default: 1 for one run, else one pass through the sequence");
  add_number(command, "--rate", request.rate, schema::above(0), "Frames per second of a sequence");
  command->add_flag("--repeat", request.repeat, "Repeat the sequence after its last frame");
  command->add_flag("--stored", request.stored, "Let the device store the sequence and repeat it by its own clock");
  finish_command(command, invocation, [send](const Invocation& invoked) { return send_command(*send, invoked.flags); });
}

}  // namespace touchfield
