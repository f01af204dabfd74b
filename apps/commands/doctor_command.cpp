#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "apps/commands/command_line.h"
#include "apps/commands/commands.h"
#include "apps/commands/standard_streams.h"
#include "sim/core/json.h"
#include "sim/jobs/doctor.h"

namespace touchfield {

namespace {

int doctor_command(const CommonFlags& flags) {
  const std::vector<Finding> findings = examine_machine(apply_threads(flags));
  if (flags.json) {
    nlohmann::ordered_json json = nlohmann::ordered_json::object();
    for (const Finding& finding : findings) {
      json[finding.subject] = {{"state", finding.state}, {"advice", finding.advice}};
    }
    put(json_text(json, 2) + "\n");
    return 0;
  }
  for (const Finding& finding : findings) {
    if (!flags.quiet || !finding.advice.empty()) {
      put(fmt::format("{:<10} {}{}{}\n", finding.subject, finding.state, finding.advice.empty() ? "" : " -- ",
                      finding.advice));
    }
  }
  return 0;
}

}  // namespace

void add_doctor_command(CLI::App& app, Invocation& invocation) {
  CLI::App* command =
      app.add_subcommand("doctor", "Check this machine for anything that makes runs slow or incomplete");
  finish_command(command, invocation, [](const Invocation& invoked) { return doctor_command(invoked.flags); });
}

}  // namespace touchfield
