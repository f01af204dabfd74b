#pragma once

#include <optional>
#include <string>
#include <vector>

#include "apps/commands/command_line.h"
#include "sim/core/types.h"

namespace touchfield {

/// Which device, and how hard, long and fast it may be driven.
struct DeviceOptions {
  std::string link = "dry-run";     // see LinkAddress
  std::string library;              // of autd3
  bool emit = false;                // else everything but the device
  std::optional<double> level;      // 0 < level <= 1; default 0.5, or 1 where a device has no other
  double most_level = 0.5;          // --max-level
  double most_seconds = 10;         // --max-seconds [s]
  std::optional<double> frequency;  // of a sine that modulates [Hz]
  double depth = 1;                 // of that sine
  std::string samples;              // file of modulation samples
  bool force = false;               // replace the files of a dry run
};

struct SendCommand {
  DeviceOptions device;
  std::vector<std::string> runs;  // run.h5 or its directory, in the order of the sequence
  std::string method;             // empty: the runs' only one
  std::optional<double> seconds;  // default: 1 s for one frame, else once through
  double rate = 10;               // [frames/s]
  bool repeat = false;
};

struct ArrayCommand {
  enum class Action { kList, kTest, kWalk, kOff };

  Action action = Action::kList;
  DeviceOptions device;
  std::string run;              // whose array the device is; empty: what the link says
  Vector3 at = {0, 0, 0.15};    // of the test's focus, in the array's frame [m]
  double temperature = 293.15;  // of the air, for the focus [K]
  double seconds = 1;           // of the test
  long first = 0;               // transducer of the walk
  std::optional<long> count;    // of the walk; default: to the last
  double dwell = 0.5;           // on each transducer of the walk [s]
};

/// Each prints its results on standard output and returns the exit code; errors are thrown.
int send_command(const SendCommand& command, const CommonFlags& flags);
int array_command(const ArrayCommand& command, const CommonFlags& flags);

}  // namespace touchfield
