#pragma once

#include <memory>
#include <optional>
#include <string>
#include <sys/types.h>
#include <vector>

#include "hardware/array_link.h"
#include "hardware/guard/guard_message.h"
#include "hardware/links/make_link.h"

namespace touchfield {

/// Time for an answer of a guard, or its sign of life [s]. The link itself gives up after kLinkPatience. Time in which
/// this process is stopped or frozen does not count.
inline constexpr double kGuardPatience = 0.25;

/// A link that lives in a process of its own, the guard, which owns the device. Guard and program watch each other:
///
///   - the guard silences the device when this process, or the guard itself, is told to stop, and when this process is
///     gone or silent (run_guard)
///   - every request is also a look at the guard. If it is gone, stopped or late, it is killed, and this process opens
///     the device itself and silences it. The request then throws a DeviceError that says how that went
///
/// So the owner has to call check() every 50 ms while the device may emit, as players do.
class GuardedLink final : public ArrayLink {
 public:
  /// Starts the guard; touches no device.
  /// command   program and arguments that call run_guard()
  /// throws    InputError as make_link; IoError if the guard cannot be started
  GuardedLink(const std::vector<std::string>& command, const LinkSettings& settings, const GuardLimits& limits);
  ~GuardedLink() override;

  std::string describe() const override { return own_->describe(); }
  const ArrayLayout& layout() const override { return own_->layout(); }
  LinkAbilities abilities() const override { return own_->abilities(); }
  void open() override;
  void set_modulation(const Modulation& modulation) override;
  /// throws   InputError also on a frame above the limits
  void send(const DriveFrame& frame) override;
  /// throws   InputError also on a frame above the limits
  void store(std::size_t first, const std::vector<DriveFrame>& frames) override;
  void play_stored(std::size_t count, double rate) override;
  void check() override;
  void silence() override;
  void close() noexcept override;
  /// Of the guard, once it is closed: when it did not look after the array.
  const Gaps& gaps() const { return gaps_; }
  /// Whether the guard stopped of its own accord: it has then told on standard error how it left the array.
  bool has_told() const { return has_told_; }

 private:
  GuardBytes ask(GuardRequest request, GuardBytes with = {}, double patience = kGuardPatience);
  GuardBytes result_of(GuardMessage answer, GuardRequest request);
  /// Ends a guard that does not do its work, and silences the device in its place.
  /// fault   "was stopped by a signal"; empty: it is gone
  [[noreturn]] void lose(std::string fault);
  /// Waits for the guard's end and returns its status; nothing if it does not end in time.
  std::optional<int> end_of_guard(double seconds);

  std::unique_ptr<ArrayLink> own_;  // to the device, once it is the guard's no more
  GuardChannel channel_;
  pid_t guard_ = -1;
  bool on_ = false;  // the device may emit
  bool has_told_ = false;
  Gaps gaps_;
};

}  // namespace touchfield
