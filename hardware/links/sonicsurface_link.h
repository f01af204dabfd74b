#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "hardware/array_link.h"
#include "hardware/link_address.h"

/// What a SonicSurface board hears over its serial line. It never answers.
///
///   254            the phases of a frame follow, from the first
///   0 .. 31        phase of the next transducer, in 1/32 of a period of delay; 32: it is off
///   253            commit: the two buffers of phases change places, on every board of the line
///   192, 193       from here on board 0 (primary) or board 1 (secondary) listens, the other only to 253, 192 and 193
///   150, 151       clocks of the shift registers off, on
///   160 .. 191     tactile firmware only, in place of the last four: length of a step of its modulation
///
/// source   github.com/upnalab/SonicSurface, Firmware/FPGA*/src/Distribute.vhd, PhaseLine.vhd, AmpModulator.vhd
namespace touchfield::sonicsurface {

inline constexpr std::uint8_t kStart = 254;
inline constexpr std::uint8_t kCommit = 253;
inline constexpr std::uint8_t kClocksOn = 151;
inline constexpr std::uint8_t kSelectBoard = 192;  // plus the board's number
inline constexpr std::uint8_t kOff = 32;
inline constexpr int kTransducers = 256;
inline constexpr int kBytesPerFrame = kTransducers + 2;
inline constexpr unsigned kBaud = 230400;       // 8 data bits, no parity, one stop bit: ten bits per byte
inline constexpr double kFramesPerSecond = 89;  // kBaud / (10 kBytesPerFrame) is 89.3

/// Which of the 256 bytes of a frame drives transducer n of sonicsurface_layout().
std::array<int, kTransducers> wiring(SonicsurfaceOrder order);

/// Phases that the firmware tells apart. The tactile one drops the lowest bit of the byte.
int phase_levels(SonicsurfaceFirmware firmware);

/// Frequencies of the tactile firmware's modulation by its step length s = 0..31: 640 kHz / (512 (s + 1)) [Hz]. The
/// firmware switches the 256 transducers off one after another and on again, one every s + 1 ticks of 0.64 MHz. The
/// other firmwares have no frequencies.
std::vector<double> modulation_frequencies(SonicsurfaceFirmware firmware);
/// The byte that sets the step length s.
std::uint8_t modulation_byte(std::size_t s);

/// A frame and its commit. A transducer of intensity 0 is off.
std::vector<std::uint8_t> frame_bytes(const DriveFrame& frame, SonicsurfaceFirmware firmware, SonicsurfaceOrder order);

/// Switches everything off that listens on the line: both buffers of each board, since any later commit would bring
/// back what the other buffer holds. Leaves the firmware's own board selected.
std::vector<std::uint8_t> silent_bytes(SonicsurfaceFirmware firmware);

}  // namespace touchfield::sonicsurface

namespace touchfield {

class SerialPort;

/// The open-hardware 16 x 16 array on a serial port. It drives a transducer fully or not
/// at all. It answers nothing: only at the bench can one see that a board is there at all.
///
/// A frame waits for the time that the line needs to carry the one before. It also waits until the system reports that
/// the line has done so, as far as the system can tell. So no queue builds up behind a frame, and a line that stands
/// still is lost within kLinkPatience. A silence takes the place of everything that has not left yet. The board may
/// have part of a frame then, but this part is never committed.
class SonicsurfaceLink final : public ArrayLink {
 public:
  SonicsurfaceLink(std::string port, SonicsurfaceFirmware firmware, SonicsurfaceOrder order);
  ~SonicsurfaceLink() override;

  std::string describe() const override;
  const ArrayLayout& layout() const override { return layout_; }
  LinkAbilities abilities() const override;
  /// Switches the board off, since a board that was just powered emits, and its clocks on.
  void open() override;
  void set_modulation(const Modulation& modulation) override;
  void send(const DriveFrame& frame) override;
  void check() override;
  void silence() override;
  void close() noexcept override;

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
