#include "hardware/links/autd3_udp_link.h"

#include <cstdint>
#include <span>
#include <utility>

#include <fmt/format.h>

#include "hardware/links/autd3_units.h"
#include "sim/core/errors.h"

namespace touchfield {

using namespace autd3_udp;

namespace {

constexpr std::size_t kMostUnits = 255;  // their numbers are bytes
// With the time that it takes to find out why a unit does not answer, within kLinkUdpPatience.
constexpr double kUdpPatience = 0.08;  // [s]

}  // namespace

Autd3UdpLink::Autd3UdpLink(std::string host, int port, const std::vector<UnitPlacement>& units)
    : chain_(std::move(host), port, units.size()), layout_(autd3_layout(units)) {
  if (units.empty() || units.size() > kMostUnits) {
    throw InputError(fmt::format("autd3-udp: {} units; there must be 1 to {}", units.size(), kMostUnits));
  }
}

std::string Autd3UdpLink::describe() const {
  return fmt::format("autd3-udp: {} unit{} on {}", chain_.size(), chain_.size() == 1 ? "" : "s", chain_.place());
}

void Autd3UdpLink::open() {
  if (chain_.is_open()) {
    throw DeviceError("autd3-udp: the link is open already");
  }
  lost_ = false;
  frames_sent_ = 0;
  stored_ = 0;
  try {
    chain_.open();
    run({{smoothing(kAutd3IntensitySteps, kAutd3PhaseSteps)}}, "smoothing");
  } catch (const DeviceError&) {
    close();
    throw;
  }
}

void Autd3UdpLink::take_over() {
  if (!chain_.adopt()) {
    chain_.close();
    open();
  }
}

void Autd3UdpLink::set_modulation(const Modulation& modulation) {
  require_live();
  const std::vector<std::uint8_t> samples = autd3_samples(modulation, describe());
  run({autd3_udp::modulation(chain_.version(), samples, kAutd3ModulationDivider)}, "modulation");
}

void Autd3UdpLink::send(const DriveFrame& frame) {
  require_live();
  require_fits_units(frame);
  run(programs_of(frame), fmt::format("frame {}", frames_sent_));
  ++frames_sent_;
}

void Autd3UdpLink::store(std::size_t first, const std::vector<DriveFrame>& frames) {
  require_live();
  if (first != stored_ || first % kStoredAtOnce != 0 || frames.size() > kStoredAtOnce ||
      first + frames.size() > kMostStored) {
    throw InputError(
        fmt::format("autd3-udp: {} frames from {} on cannot be stored after {}", frames.size(), first, stored_));
  }
  std::vector<Autd3UdpChain::Program> programs;
  for (std::size_t unit = 0; unit < chain_.size(); ++unit) {
    std::vector<UnitFrame> parts;
    for (const DriveFrame& frame : frames) {
      require_fits_units(frame);
      parts.push_back(part_of(frame, unit));
    }
    programs.push_back(stored(first, parts));
  }
  run(programs, "stored frames");
  stored_ += frames.size();
}

void Autd3UdpLink::play_stored(std::size_t count, double rate) {
  require_live();
  const int periods = stored_periods(count, rate, abilities().stored, describe());
  if (count > stored_) {
    throw InputError(fmt::format("autd3-udp: {} frames cannot be played, {} are stored", count, stored_));
  }
  run({played(count, static_cast<std::uint16_t>(periods))}, "the stored sequence");
}

void Autd3UdpLink::check() {
  require_live();
  const std::vector<Bytes> states = run({{kReadState}}, "while a frame is held");
  for (std::size_t unit = 0; unit < states.size(); ++unit) {
    if (!states[unit].empty() && (states[unit].front() & kSwitchedOff) != 0) {
      lost_ = true;
      throw DeviceError(fmt::format("autd3-udp: unit {} has switched itself off: it heard nothing for 0.5 s", unit));
    }
  }
}

void Autd3UdpLink::silence() {
  if (!chain_.is_open()) {
    throw DeviceError("autd3-udp: the link is not open");
  }
  run(programs_of(silent_frame(static_cast<std::size_t>(layout_.positions.cols()))), "the silent frame");
}

std::vector<Bytes> Autd3UdpLink::run(const std::vector<Autd3UdpChain::Program>& programs, const std::string& what) {
  try {
    return chain_.run(programs, what, kUdpPatience);
  } catch (const DeviceError&) {
    lost_ = true;
    throw;
  }
}

std::vector<Autd3UdpChain::Program> Autd3UdpLink::programs_of(const DriveFrame& frame) const {
  std::vector<Autd3UdpChain::Program> programs;
  for (std::size_t unit = 0; unit < chain_.size(); ++unit) {
    programs.push_back(pattern(chain_.version(), part_of(frame, unit)));
  }
  return programs;
}

UnitFrame Autd3UdpLink::part_of(const DriveFrame& frame, std::size_t unit) const {
  const std::size_t count = frame.size() / chain_.size();
  return {std::span(frame.phase).subspan(unit * count, count), std::span(frame.intensity).subspan(unit * count, count)};
}

void Autd3UdpLink::require_fits_units(const DriveFrame& frame) const {
  require_fits(frame, abilities(), static_cast<std::size_t>(layout_.positions.cols()), describe());
}

void Autd3UdpLink::require_live() const {
  if (!chain_.is_open()) {
    throw DeviceError("autd3-udp: the link is not open");
  }
  if (lost_) {
    throw DeviceError("autd3-udp: the link was lost before; nothing is sent until it is opened again");
  }
}

}  // namespace touchfield
