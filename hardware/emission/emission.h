#pragma once

#include <cstddef>
#include <exception>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "hardware/array_link.h"
#include "hardware/attention.h"
#include "hardware/drive_frame.h"
#include "hardware/player.h"
#include "sim/acoustics/transducer_array.h"

namespace touchfield {

class StopSignals;

/// How hard, long and fast an array is asked to be driven, and the caps on that. Messages name the fields as the
/// command line does.
struct EmissionRequest {
  std::optional<double> level;    // --level: 0 < level <= 1; default kUsualLevel, or 1 where a device has no other
  double most_level = 0.5;        // --max-level: cap, 0 < most_level <= 1
  std::optional<double> seconds;  // --seconds: default kOneFrameSeconds for one frame, else once through
  double most_seconds = 10;       // --max-seconds: cap, > 0 [s]
  double rate = 1;                // [frames/s]
  bool repeat = false;            // begin a sequence again after its last frame
  bool stored = false;            // --stored: the device stores a sequence and repeats it by its own clock
};

inline constexpr double kUsualLevel = 0.5;
inline constexpr double kOneFrameSeconds = 1;  // [s]

/// The level that may be emitted: what is asked for, else min(kUsualLevel, most_level), else 1 where a device drives
/// its transducers fully or not at all.
///
/// device   its name, for messages
/// throws   InputError: a level or cap out of range, above the cap, or that the device does not have
double permitted_level(const EmissionRequest& request, const LinkAbilities& abilities, const std::string& device);

/// The time that may be emitted [s]: what is asked for, else kOneFrameSeconds for one frame and frames / rate for more.
///
/// frames   at least 1
/// throws   InputError: a time or cap that is not positive and finite, or above the cap
double permitted_seconds(const EmissionRequest& request, std::size_t frames);

/// The rate of frames [1/s].
///
/// throws   InputError if it is not positive or more than the device carries
double permitted_rate(const EmissionRequest& request, const LinkAbilities& abilities, const std::string& device);

/// Which device, and what its carrier is modulated by.
struct DeviceChoice {
  std::string link = "dry-run";                      // see LinkAddress
  bool replace = false;                              // the files of a dry run that are there
  std::optional<double> frequency;                   // of a sine that modulates [Hz]
  double depth = 1;                                  // of that sine
  std::optional<std::vector<std::uint8_t>> samples;  // that modulate, at the device's own rate; beats the sine
};

/// One pattern before it is rounded.
struct Drive {
  Eigen::VectorXd phases;      // N [rad]
  Eigen::VectorXd amplitudes;  // N, 0..1
};

/// Rounds a drive for the device of a plan, at the plan's level.
///
/// throws   InputError as quantise, and if the count is not the device's
using Rounding = std::function<DriveFrame(const Drive& drive)>;

/// What is to be sent, and how.
struct EmissionPlan {
  DeviceChoice device;
  EmissionRequest request;
  bool emit = false;                        // else everything but the device
  ArrayLayout array;                        // for the link, see LinkSettings; may be empty
  std::vector<TransducerArray> must_match;  // the device; each is compared with it before anything is sent
  std::function<std::vector<Drive>(const ArrayLayout& device)> drives;
  /// Is played instead of `drives`, if given, of which it is then only found whether the device can do them. Without
  /// `emit` it is played all the same, to no device.
  std::function<FrameStream(const Rounding& rounded)> stream;
  StopSignals* signals = nullptr;  // of a caller who has threads, and of every stream; else they are made here
  FrameObserver observer;          // told of each frame that was sent
  std::vector<std::string> guard;  // program and arguments that GuardedLink starts
  std::vector<std::string> read;   // files that the caller reads: a dry run writes to none of them
};

/// What was found and done.
struct EmissionReport {
  std::string link;    // as it was asked for
  std::string device;  // in a few words
  bool dry = false;    // no device: a dry run
  std::size_t transducers = 0;
  std::size_t frames = 0;  // of a stream: that were sent
  double rate = 0;
  double seconds = 0;  // planned
  double level = 0;
  std::string modulation;
  QuantisationReport quantisation;
  bool emitted = false;
  bool silent = false;         // after an emission: this program has silenced the array; else the guard had to
  std::size_t written = 0;     // files of a dry run
  PlayReport play;             // if emitted, or a stream
  Gaps gaps;                   // the same: of this program or, if that has more, of the guard
  std::exception_ptr failure;  // the DeviceError that ended the emission before its time; null: none
  int signal = 0;              // that ended the emission; 0: none
};

/// Where an array's channels sit.
ArrayLayout layout_of(const TransducerArray& array);

/// The link that a choice names, in this process.
std::unique_ptr<ArrayLink> local_link(const DeviceChoice& device, const ArrayLayout& array, std::size_t frames = 1);

/// Checks everything that can be checked (the functions above, require_match, quantise). If the plan is to emit, it
/// then sends through a guard and leaves the array silent. A dry run writes its files.
///
/// throws   InputError before the device hears anything: a value out of range, above its cap, or that the device cannot
///          do, an array that is not the device's. DeviceError before the first frame; a later one is in the report
EmissionReport emit(const EmissionPlan& plan);

/// Farthest that a transducer of a run may be from where the device has it, once the one array is laid on the other
/// [m].
inline constexpr double kMatchTolerance = 1e-4;
/// Where along its axis a transducer is compared as well, so that the tolerance allows 10 mrad of its direction [m].
inline constexpr double kMatchReach = 1e-2;

/// Refuses an array that is not the device's. The array may be moved and turned as a whole. It must agree with the
/// device in count, places, axes, and the order of units and channels.
///
/// run      an array as a run has it
/// device   the device's own layout
/// name     of the device, for the message
/// throws   InputError saying what differs: the count, the pitch, the order, a place or direction, a number
void require_match(const TransducerArray& run, const ArrayLayout& device, const std::string& name);

}  // namespace touchfield
