#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "hardware/array_link.h"
#include "hardware/links/autd3_library.h"
#include "hardware/links/autd3_units.h"

namespace touchfield {

struct Autd3Options {
  std::string library;  // path, see Autd3Library
  std::string mode;     // audit: the vendor's emulator of the firmware, in this process; nop; remote; twincat
  std::string host;     // of remote: a name or an address
  int port = 8080;      // of remote
  std::vector<UnitPlacement> units = {UnitPlacement{}};  // in the order of the cables
  int break_after = -1;  // of audit: the frame before which the link breaks, on purpose, from 0; negative: never
};

/// What the audit link tells of one unit.
struct Autd3UnitState {
  DriveFrame drives;
  std::vector<std::uint8_t> modulation;
  int modulation_divider = 0;  // 40 kHz over the samples per second
  int phase_steps = 0;         // of the smoothing
  int intensity_steps = 0;
  bool fixed_steps = false;  // the smoothing is of the kind of kAutd3PhaseSteps
};

/// AUTD3 units, through the vendor's own library: 249 transducers per unit, 256 phases and 256 intensities.
///
/// Intensities are linear in pressure: the firmware's own table of pulse widths makes them so. Reads back with audit.
class Autd3Link final : public ArrayLink {
 public:
  /// Loads the library; touches no device.
  /// throws   InputError: the library (see Autd3Library), an unknown mode, no unit, a rotation that is not one, a port
  ///          out of range
  explicit Autd3Link(Autd3Options options);
  ~Autd3Link() override;

  std::string describe() const override;
  const ArrayLayout& layout() const override { return layout_; }
  LinkAbilities abilities() const override;
  /// throws   DeviceError also if the library puts a transducer farther than kAutd3PositionTolerance from layout()
  void open() override;
  void set_modulation(const Modulation& modulation) override;
  void send(const DriveFrame& frame) override;
  void check() override;
  std::optional<DriveFrame> read_back() override;
  /// A single sample is held as two, the fewest that the firmware takes.
  std::optional<std::vector<std::uint8_t>> read_back_modulation() override;
  void quiet() override;
  void close() noexcept override;

  /// Where the library says that the transducers are [m], unit after unit; open only.
  ArrayLayout library_layout() const;
  /// Of the audit link, open only: one unit's state, and the loss of the link.
  Autd3UnitState audit(std::size_t unit) const;
  void break_down();

 private:
  autd3::Controller* opened(autd3::Link* link) const;
  autd3::Controller* opened_remote() const;
  void check_layout() const;
  void require_open() const;
  void require_live() const;
  autd3::Link* open_audit() const;
  template <class T>
  T value_or_lost(const autd3::Result<T>& result, std::string_view what);
  void send_datagram(autd3::Datagram* datagram, std::string_view what);

  Autd3Options options_;
  Autd3Library library_;
  ArrayLayout layout_;
  autd3::Controller* controller_ = nullptr;
  autd3::Sender* sender_ = nullptr;  // one for all messages: the library never frees it
  bool lost_ = false;
  int frames_sent_ = 0;
};

}  // namespace touchfield
