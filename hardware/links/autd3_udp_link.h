#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "hardware/array_link.h"
#include "hardware/links/autd3_udp_chain.h"
#include "hardware/links/autd3_units.h"

namespace touchfield {

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
