#pragma once

#include <chrono>
#include <memory>

#include "hardware/array_link.h"
#include "hardware/link_address.h"
#include "hardware/links/serial_port.h"

namespace touchfield {

/// The open-hardware 16 x 16 array on a serial port, see sonicsurface_protocol.h. It drives a transducer fully or not
/// at all. It answers nothing: only at the bench can one see that a board is there at all.
///
/// A frame waits for the time that the line needs to carry the one before. It also waits until the system reports that
/// the line has done so, as far as the system can tell. So no queue builds up behind a frame, and a line that stands
/// still is lost within kLinkPatience. A silence takes the place of everything that has not left yet. The board may
/// have part of a frame then, but this part is never committed.
class SonicsurfaceLink final : public ArrayLink {
 public:
  SonicsurfaceLink(std::string port, SonicsurfaceFirmware firmware, SonicsurfaceOrder order);

  std::string describe() const override;
  const ArrayLayout& layout() const override { return layout_; }
  LinkAbilities abilities() const override;
  /// Switches the board off, since a board that was just powered emits, and its clocks on.
  void open() override;
  void set_modulation(const Modulation& modulation) override;
  void send(const DriveFrame& frame) override;
  void check() override;
  void silence() override;
  void close() noexcept override { serial_.reset(); }

 private:
  /// Writes bytes once the line has had the time to carry what was written before.
  void write(const std::vector<std::uint8_t>& bytes);
  /// Waits until it has done so.
  void drain();
  /// Remembers if an action leaves bytes behind.
  template <class Action>
  void unless_stuck(const Action& act);
  SerialPort& serial();

  std::string port_;
  SonicsurfaceFirmware firmware_;
  SonicsurfaceOrder order_;
  ArrayLayout layout_;
  std::unique_ptr<SerialPort> serial_;
  std::chrono::steady_clock::time_point free_at_{};  // when the line has carried everything
  bool stuck_ = false;                               // part of a frame may still wait in the system
};

}  // namespace touchfield
