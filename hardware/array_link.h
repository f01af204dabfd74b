#pragma once

#include <string>
#include <vector>

#include "hardware/drive_frame.h"
#include "sim/acoustics/transducer_array.h"

namespace touchfield {

/// The frames that a device stores and plays by its own clock.
struct StoredAbility {
  std::size_t most_frames = 0;  // 0: it stores none
  double clock = 0;             // [Hz]: it plays clock / n frames per second
  int fewest_periods = 1;       // n is a whole number from this to most_periods
  int most_periods = 1;
};

/// What a device can do.
struct LinkAbilities {
  DriveSteps steps;
  double most_frames_per_second = 0;  // that the link carries, > 0
  ModulationAbility modulation;
  StoredAbility stored{};
  double switches_off_after = 0;  // of silence [s]; 0: never
};

/// A real array, or what stands for one. Made by make_link, or for another process by GuardedLink.
///
/// Order of calls: layout, abilities and describe at any time, without touching the device; open; set_modulation and
/// send any number of times; silence; close. A device that does not take what it is sent within kLinkPatience is
/// lost. After a DeviceError only silence and close may be called.
///
/// throws   DeviceError from everything that touches the device: missing, refused, silent, lost. InputError if the
///          caller asks for what the device cannot do, before a byte is sent.
class ArrayLink {
 public:
  ArrayLink() = default;
  ArrayLink(const ArrayLink&) = delete;
  ArrayLink& operator=(const ArrayLink&) = delete;
  /// Closes what is open, as close().
  virtual ~ArrayLink() = default;

  /// The device in a few words, for a person, e.g. "sonicsurface on /dev/ttyUSB0, primary firmware".
  virtual std::string describe() const = 0;
  /// Where the device's transducers sit, in its own order, up to a rigid motion of the whole.
  virtual const ArrayLayout& layout() const = 0;
  virtual LinkAbilities abilities() const = 0;

  /// Takes hold of the device; it emits nothing yet.
  virtual void open() = 0;
  /// Instead of open(): takes hold of a device that another process, which is gone, has left on. Only silent and close
  /// may follow.
  virtual void take_over() { open(); }
  /// From the next frame on. Without this call: static, or what the firmware always does.
  virtual void set_modulation(const Modulation& modulation) = 0;
  /// Emits a frame from now on, until the next.
  /// frame   of layout().positions.cols() transducers, steps below those of abilities().steps
  virtual void send(const DriveFrame& frame) = 0;
  /// Stores frames for play_stored, from number `first` on, and emits nothing. They may be kStoredAtOnce.
  virtual void store(std::size_t first, const std::vector<DriveFrame>& frames);
  /// Plays the first `count` stored frames from now on, again and again, until the next frame that is sent.
  /// rate   [frames/s], one that abilities().stored has
  virtual void play_stored(std::size_t count, double rate);
  /// Notices a device that went away while nothing was sent; called several times per second while a frame is held.
  virtual void check() {}
  /// Every transducer off, committed, and on its way out of this machine when the call returns.
  virtual void silence() = 0;
  /// Lets go of the device. Does not silence it. Errors are swallowed: nothing can be done about them.
  virtual void close() noexcept = 0;
};

/// Frames that are stored in one call.
inline constexpr std::size_t kStoredAtOnce = 8;

/// Longest time that a device may take nothing, or not confirm what it was sent [s]; an open() may take longer.
inline constexpr double kLinkPatience = 0.1;

/// Refuses a frame that does not fit a device: a wrong count, a step out of range.
/// device   its name, for the message
/// throws   InputError
void require_fits(const DriveFrame& frame, const LinkAbilities& abilities, std::size_t count,
                  const std::string& device);

/// How many periods of its clock a device plays each of its stored frames.
/// device   its name, for the message
/// throws   InputError if it cannot store so many frames, or has not that rate (to 1e-9)
int stored_periods(std::size_t count, double rate, const StoredAbility& ability, const std::string& device);

/// Where one unit of several sits: a point x of its own layout is at rotation x + position.
struct UnitPlacement {
  Vector3 position = Vector3::Zero();  // [m]
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
};

}  // namespace touchfield
