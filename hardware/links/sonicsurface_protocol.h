#pragma once

#include <array>
#include <cstdint>
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
