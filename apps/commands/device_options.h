#pragma once

#include <string>
#include <vector>

#include <fmt/format.h>

#include "apps/commands/command_line.h"
#include "hardware/emission/emission.h"
#include "sim/core/errors.h"
#include "sim/core/json.h"

namespace touchfield {

/// What `send` and `array` are told of the device and of the emission.
struct DeviceOptions {
  DeviceChoice device;
  EmissionRequest request;
  bool emit = false;
  std::string samples;  // file of modulation samples
};

/// --to.
void add_device(CLI::App* command, DeviceOptions& options);
/// --emit, the level, the caps and the modulation; not the time nor the rate.
void add_emission(CLI::App* command, DeviceOptions& options);

/// The plan that the options make: the device with its samples read, the request, and the guard that this program is.
EmissionPlan plan_of(const DeviceOptions& options);

/// The method of a name; without one the only one.
/// holder   of the methods, for messages
template <class Method>
const Method& chosen_method(const std::vector<Method>& methods, const std::string& name, const std::string& holder) {
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
  throw InputError(name.empty()
                       ? fmt::format("{} has the methods {}; --method picks one", holder, known)
                       : fmt::format("{} has no method '{}', it has {}", holder, name, known.empty() ? "none" : known));
}

Json emission_value(const EmissionReport& report);

/// Says on standard error by what signal an emission was stopped, if by one.
/// returns  the exit code
int said_exit_code(const EmissionReport& report);

/// Does so and prints the report.
///
/// more     entries after those of the report
/// returns  the exit code
/// throws   the error that ended it, if one did
int print_emission(const EmissionReport& report, const CommonFlags& flags, const Json& more = Json::object());

}  // namespace touchfield
