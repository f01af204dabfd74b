#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "hardware/array_link.h"
#include "hardware/links/autd3_udp_chain.h"
#include "sim/acoustics/transducer_array.h"

namespace touchfield {

/// Samples per second that an AUTD3's modulation buffer is played at, and 40 kHz over that.
inline constexpr double kAutd3ModulationRate = 4000;
inline constexpr std::uint16_t kAutd3ModulationDivider = 10;

/// The smoothing of an AUTD3: a change of phase or intensity is spread over this many periods of the 40 kHz carrier.
///
/// In this mode every transducer arrives exactly at the values that it was sent, and all at the same time. Phases
/// arrive 1 ms after a frame, before the next one can follow. Intensities arrive within one sample of the modulation.
/// Without smoothing each change would be heard as a click.
inline constexpr int kAutd3PhaseSteps = 40;
inline constexpr int kAutd3IntensitySteps = 10;

/// Farthest that a transducer may be from where it is expected [m].
inline constexpr double kAutd3PositionTolerance = 1e-6;

/// What AUTD3 units can do. They take 256 steps of phase and intensity, up to 4000 samples, and frames to repeat.
LinkAbilities autd3_abilities();

/// The samples of a modulation; a single one twice, as the firmware takes no fewer than two.
///
/// device   its name, for the message
/// throws   InputError on what autd3_abilities does not have
std::vector<std::uint8_t> autd3_samples(const Modulation& modulation, const std::string& device);

/// The transducers of placed AUTD3 units, unit after unit.
ArrayLayout autd3_layout(const std::vector<UnitPlacement>& units);

/// Where the units of a layout sit.
///
/// The rotation takes x to the direction from channel 0 to the last of its row, and y to that from channel 0 to the
/// last row. Every transducer must then be within kAutd3PositionTolerance of its place in autd3_layout, and its axis
/// within 1e-5 rad.
///
/// layout   of AUTD3 units, in any order; devices from 0, channels 0..248 on each
/// returns  one placement a device, in their order
/// throws   InputError naming the unit and transducer that do not fit
std::vector<UnitPlacement> autd3_placements(const ArrayLayout& layout);

/// AUTD3 units with firmware 0.10 and later on a network: 249 transducers per unit, 256 phases and 256 intensities.
/// Intensities are linear in pressure: the firmware's own table of pulse widths makes them so.
///
/// Every frame is confirmed by every unit before the next. While a frame is held, check() keeps the units on: without a
/// message they switch themselves off after 0.5 s, and stay so until the link is opened again.
class Autd3UdpLink final : public ArrayLink {
 public:
  /// host, port   see Autd3UdpChain
  /// units        in the order of the cables, one or more
  /// throws       InputError without a unit, or with more than 255
  Autd3UdpLink(std::string host, int port, const std::vector<UnitPlacement>& units);

  std::string describe() const override;
  const ArrayLayout& layout() const override { return layout_; }
  LinkAbilities abilities() const override { return autd3_abilities(); }
  /// throws   DeviceError also on a firmware that is not known, and on another number of units
  void open() override;
  void take_over() override;
  void set_modulation(const Modulation& modulation) override;
  void send(const DriveFrame& frame) override;
  void store(std::size_t first, const std::vector<DriveFrame>& frames) override;
  void play_stored(std::size_t count, double rate) override;
  void check() override;
  void silence() override;
  void close() noexcept override { chain_.close(); }

 private:
  void require_live() const;
  std::vector<autd3_udp::Bytes> run(const std::vector<Autd3UdpChain::Program>& programs, const std::string& what);
  void require_fits_units(const DriveFrame& frame) const;
  /// What a unit emits of a frame.
  autd3_udp::UnitFrame part_of(const DriveFrame& frame, std::size_t unit) const;
  std::vector<Autd3UdpChain::Program> programs_of(const DriveFrame& frame) const;

  Autd3UdpChain chain_;
  ArrayLayout layout_;
  bool lost_ = false;
  int frames_sent_ = 0;
  std::size_t stored_ = 0;  // frames since open
};

}  // namespace touchfield
