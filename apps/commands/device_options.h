#pragma once

#include <string>
#include <vector>

#include "apps/commands/command_line.h"
#include "hardware/emission/emission.h"
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
