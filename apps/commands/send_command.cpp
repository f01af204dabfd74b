#include <cmath>
#include <memory>

#include <fmt/format.h>

#include "apps/commands/command_line.h"
#include "apps/commands/commands.h"
#include "apps/commands/device_options.h"
#include "sim/core/errors.h"
#include "sim/core/require.h"
#include "sim/run/archive_file.h"
#include "sim/run/motion_file.h"
#include "sim/run/run_file.h"

namespace touchfield {

namespace {

struct SendCommand {
  DeviceOptions options;
  std::vector<std::string> runs;  // run.h5, motion.h5 or their directory, in the order of the sequence
  std::string method;             // empty: the runs' only one
  bool rate_given = false;
};

template <class Method>
const Method& chosen_method(const std::vector<Method>& methods, const std::string& name, const std::string& path) {
  if (name.empty() && methods.size() == 1) {
    return methods.front();
  }
  std::string known;
  for (const Method& method : methods) {
    if (method.name == name) {
      return method;
    }
    known += (known.empty() ? "" : ", ") + method.name;
  }
  throw InputError(
      name.empty() ? fmt::format("{}: it has the methods {}; --method picks one", path, known)
                   : fmt::format("{}: it has no method '{}', it has {}", path, name, known.empty() ? "none" : known));
}

/// Frames per second of a motion.
/// throws   InputError unless they follow each other evenly, to 1 %
double frame_rate(const std::vector<MotionFrame>& frames, const std::string& path) {
  const double rate = static_cast<double>(frames.size() - 1) / (frames.back().shown - frames.front().shown);
  for (std::size_t k = 1; k < frames.size(); ++k) {
    require(std::abs((frames[k].shown - frames[k - 1].shown) * rate - 1.0) < 0.01,
            "{}: its frames do not follow each other evenly; --rate says how many are sent per second", path);
  }
  return rate;
}

/// The frames of a motion or a pattern as a sequence, at their own rate unless another is given.
void add_motion(const SendCommand& command, const std::string& path, EmissionPlan& plan, std::vector<Drive>& drives) {
  const Motion motion = read_motion_file(path);
  require(motion.complete, "{}: complete = 0: its end is missing, so its phases are not sent", path);
  const MotionMethod& method = chosen_method(motion.methods, command.method, path);
  require(!method.frames.empty(), "{}: method {} has no frames", path, method.name);
  for (const MotionFrame& frame : method.frames) {
    drives.push_back({frame.solution.phases, frame.solution.amplitudes});
  }
  if (!command.rate_given && method.frames.size() > 1) {
    plan.request.rate = frame_rate(method.frames, path);
  }
  plan.must_match.push_back(motion.array);
}

int send_command(const SendCommand& command, const CommonFlags& flags) {
  EmissionPlan plan = plan_of(command.options);
  std::vector<Drive> drives;
  for (const std::string& path : command.runs) {
    plan.read.push_back(result_file_at(path));
    if (archive_format(plan.read.back()) == kMotionArchive.name()) {
      require(command.runs.size() == 1 || command.rate_given, "{}: --rate must be given with more than one file", path);
      add_motion(command, plan.read.back(), plan, drives);
      continue;
    }
    const Run run = read_run_file(plan.read.back());
    if (!run.complete) {
      throw InputError(
          fmt::format("{}: complete = 0: the run did not finish, so its phases are not sent; "
                      "`touchfield run --from` computes it again",
                      path));
    }
    const MethodResult& method = chosen_method(run.methods, command.method, path);
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
  CLI::App* command = app.add_subcommand("send", "Send the phases of runs, motions or patterns to an array");
  command
      ->add_option("RUN", send->runs,
                   "run.h5, motion.h5 or pattern.h5, or the directory that holds it; several make a sequence")
      ->required()
      ->type_name(kH5File);
  command->add_option("--method", send->method, "Method of the phases; default: the only one");
  add_device(command, send->options);
  add_emission(command, send->options);
  add_number(
      command, "--seconds", request.seconds, schema::above(0),
      "Time of emission [s], the last frame is held; default: 1 for one run, else one pass through the sequence");
  CLI::Option* rate =
      add_number(command, "--rate", request.rate, schema::above(0),
                 "Frames per second of a sequence; default: that of a motion or pattern, or 10 of several runs");
  command->add_flag("--repeat", request.repeat, "Repeat the sequence after its last frame");
  command->add_flag("--stored", request.stored, "Let the device store the sequence and repeat it by its own clock");
  finish_command(command, invocation, [send, rate](const Invocation& invoked) {
    send->rate_given = rate->count() > 0;
    return send_command(*send, invoked.flags);
  });
}

}  // namespace touchfield
