#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/commands/device_commands.h"
#include "hardware/array_link.h"
#include "hardware/make_link.h"
#include "hardware/player.h"
#include "hardware/quantise.h"

namespace touchfield {

/// One pattern before it is rounded.
struct Drive {
  Eigen::VectorXd phases;      // N [rad]
  Eigen::VectorXd amplitudes;  // N, 0..1
};

/// What is to be sent, and how.
struct EmissionPlan {
  DeviceOptions device;
  ArrayLayout array;                        // for the link, see LinkSettings; may be empty
  std::vector<TransducerArray> must_match;  // the device; each is compared with it before anything is sent
  std::function<std::vector<Drive>(const ArrayLayout& device)> drives;
  double rate = 1;                // [frames/s]
  std::optional<double> seconds;  // default: 1 s for one frame, else once through
  bool repeat = false;
  FrameObserver observer;  // told of each frame that was sent
};

/// What was found and done.
struct EmissionReport {
  std::string device;
  std::size_t transducers = 0;
  std::size_t frames = 0;
  double rate = 0;
  double seconds = 0;  // planned
  double level = 0;
  std::string modulation;
  QuantisationReport quantisation;
  bool emitted = false;
  bool quiet = false;       // after an emission: this program has quieted the array; else the guard had to
  std::size_t written = 0;  // files of a dry run
  PlayReport play;          // if emitted
  bool read_back = false;   // every frame and the modulation, and equal
  int exit_code = 0;        // 128 + signal if one ended the emission
};

/// Where an array's channels sit.
ArrayLayout layout_of(const TransducerArray& array);

/// The link that the options name, in this process.
std::unique_ptr<ArrayLink> local_link(const DeviceOptions& options, const ArrayLayout& array, std::size_t frames = 1);

/// Checks everything that can be checked, and then, with --emit, sends through a guard. A dry run writes its files.
///
/// throws   InputError before the device hears anything: a value out of range, above its cap, or that the device cannot
///          do, an array that is not the device's; DeviceError, also if the device reads back what was not sent
EmissionReport emit(const EmissionPlan& plan);

/// The report as a person reads it, line by line, and as --json prints it.
std::string describe_emission(const EmissionReport& report, const DeviceOptions& options);
std::string emission_json(const EmissionReport& report, const DeviceOptions& options);

}  // namespace touchfield
