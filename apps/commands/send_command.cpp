#include <fmt/format.h>

#include "apps/commands/device_commands.h"
#include "apps/commands/emission.h"
#include "apps/commands/standard_streams.h"
#include "sim/core/errors.h"
#include "sim/store/run_file.h"

namespace touchfield {

namespace {

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

}  // namespace

int send_command(const SendCommand& command, const CommonFlags& flags) {
  EmissionPlan plan;
  plan.device = command.device;
  plan.rate = command.rate;
  plan.seconds = command.seconds;
  plan.repeat = command.repeat;
  std::vector<Drive> drives;
  for (const std::string& path : command.runs) {
    const Run run = read_run_file(run_file_at(path));
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
  const EmissionReport report = emit(plan);
  if (flags.json) {
    put(emission_json(report, command.device));
  } else if (!flags.quiet) {
    put(describe_emission(report, command.device));
  }
  return report.exit_code;
}

}  // namespace touchfield
