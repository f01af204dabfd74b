#include "hardware/links/sonicsurface_link.h"

#include <stdexcept>
#include <thread>
#include <utility>

#include <fmt/format.h>

#include "hardware/links/sonicsurface_protocol.h"
#include "sim/core/errors.h"

namespace touchfield {

namespace {

using Clock = std::chrono::steady_clock;

const char* firmware_name(SonicsurfaceFirmware firmware) {
  switch (firmware) {
    case SonicsurfaceFirmware::kPrimary:
      return "primary";
    case SonicsurfaceFirmware::kSecondary:
      return "secondary";
    case SonicsurfaceFirmware::kTactile:
      return "tactile";
  }
  throw std::logic_error("unknown firmware");
}

}  // namespace

SonicsurfaceLink::SonicsurfaceLink(std::string port, SonicsurfaceFirmware firmware, SonicsurfaceOrder order)
    : port_(std::move(port)), firmware_(firmware), order_(order), layout_(sonicsurface_layout()) {}

std::string SonicsurfaceLink::describe() const {
  return fmt::format("sonicsurface on {}, {} firmware{}", port_, firmware_name(firmware_),
                     order_ == SonicsurfaceOrder::kNatural ? ", natural order" : "");
}

LinkAbilities SonicsurfaceLink::abilities() const {
  return {{sonicsurface::phase_levels(firmware_), 2},
          sonicsurface::kFramesPerSecond,
          {0, 0, sonicsurface::modulation_frequencies(firmware_)}};
}

void SonicsurfaceLink::open() {
  serial_ = std::make_unique<SerialPort>(port_, sonicsurface::kBaud);
  free_at_ = Clock::now();
  stuck_ = false;
  silence();
  if (firmware_ != SonicsurfaceFirmware::kTactile) {
    write({sonicsurface::kClocksOn});
  }
}

void SonicsurfaceLink::set_modulation(const Modulation& modulation) {
  const ModulationAbility ability = abilities().modulation;
  require_ability(modulation, ability, describe());
  if (const auto* sine = std::get_if<SineModulation>(&modulation)) {
    write({sonicsurface::modulation_byte(own_frequency(*sine, ability, describe()))});
  }
}

void SonicsurfaceLink::send(const DriveFrame& frame) {
  require_fits(frame, abilities(), sonicsurface::kTransducers, describe());
  drain();
  write(sonicsurface::frame_bytes(frame, firmware_, order_));
}

void SonicsurfaceLink::check() {
  serial().check();
  drain();
}

void SonicsurfaceLink::silence() {
  if (stuck_ || serial().unsent() > 0) {
    serial().discard();
    free_at_ = Clock::now();
    stuck_ = false;
  }
  write(sonicsurface::silent_bytes(firmware_));
  drain();
}

void SonicsurfaceLink::drain() {
  std::this_thread::sleep_until(free_at_);
  unless_stuck([&] { serial().drain(kLinkPatience); });
}

void SonicsurfaceLink::write(const std::vector<std::uint8_t>& bytes) {
  constexpr double kBitsPerByte = 10;
  std::this_thread::sleep_until(free_at_);
  const auto carried =
      std::chrono::duration<double>(kBitsPerByte * static_cast<double>(bytes.size()) / sonicsurface::kBaud);
  const auto start = Clock::now();
  unless_stuck([&] { serial().write(bytes, kLinkPatience); });
  free_at_ = start + std::chrono::duration_cast<Clock::duration>(carried);
}

template <class Action>
void SonicsurfaceLink::unless_stuck(const Action& act) {
  try {
    act();
  } catch (const DeviceError&) {
    stuck_ = true;
    throw;
  }
}

SerialPort& SonicsurfaceLink::serial() {
  if (!serial_) {
    throw DeviceError(fmt::format("{}: it is not open", describe()));
  }
  return *serial_;
}

}  // namespace touchfield
