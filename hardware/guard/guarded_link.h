#pragma once

#include <optional>
#include <string>
#include <sys/types.h>
#include <vector>

#include "hardware/array_link.h"
#include "hardware/attention.h"
#include "hardware/guard/guard_channel.h"
#include "hardware/guard/vigil.h"
#include "hardware/links/make_link.h"

namespace touchfield {

/// Time for an answer of a guard [s]. The link itself gives up after kLinkPatience. A guard that was away for longer
/// than kLongestGap quiets the device when it is back. Time in which this process is stopped or frozen does not count.
inline constexpr double kGuardPatience = 1;
/// Time for the end of a watchdog that has to quiet the device itself [s].
inline constexpr double kEndPatience = 2;

/// A link that lives in a process of its own, the guard, which owns the device. The guard quiets the device when this
/// process, or the guard itself, is told to stop. It also does so when this process is gone, stopped or silent. The
/// guard has a watchdog, which is a process too. See run_guard and run_watchdog.
class GuardedLink final : public ArrayLink {
 public:
  /// Starts the watchdog, and with it the guard; touches no device.
  /// command   program and arguments that call run_watchdog(kGuardDescriptor, ...)
  /// throws    InputError as make_link; IoError if the guard cannot be started
  GuardedLink(const std::vector<std::string>& command, const LinkSettings& settings, const GuardLimits& limits);
  ~GuardedLink() override;

  std::string describe() const override { return device_.description; }
  const ArrayLayout& layout() const override { return device_.layout; }
  LinkAbilities abilities() const override { return device_.abilities; }
  void open() override;
  void set_modulation(const Modulation& modulation) override;
  /// throws   InputError also on a frame above the limits
  void send(const DriveFrame& frame) override;
  /// throws   InputError also on a frame above the limits
  void store(std::size_t first, const std::vector<DriveFrame>& frames) override;
  void play_stored(std::size_t count, double rate) override;
  void check() override;
  void quiet() override;
  void close() noexcept override;
  /// Of the guard, once it is closed: when it did not look after the array.
  const Gaps& gaps() const { return gaps_; }
  /// Whether the guard stopped of its own accord: it has then told on standard error how it left the array.
  bool has_told() const { return has_told_; }

 private:
  GuardBytes ask(GuardRequest request, GuardBytes with = {}, double patience = kGuardPatience);
  /// Lets guard and watchdog continue if they are stopped: each then sees to the other and to the array.
  void resume_others() const;
  /// Waits for the watchdog's end, and takes its exit code; nothing if it does not end, or was ended by a signal.
  std::optional<int> end_of_watchdog();
  /// How the watchdog of a guard that is gone has left the array.
  std::string last_word();

  GuardChannel channel_;
  pid_t watchdog_ = -1;
  GuardedDevice device_;
  std::optional<Vigil> guard_;
  bool answers_ = true;
  bool has_told_ = false;
  Gaps gaps_;
};

}  // namespace touchfield
