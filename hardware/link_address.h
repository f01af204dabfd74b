#pragma once

#include <string>

namespace touchfield {

/// Which firmware a SonicSurface board holds, by the folders of its makers' sources.
enum class SonicsurfaceFirmware {
  kPrimary,    // "FPGA primary": 32 phases, no modulation; board 0 of a pair, or a single board
  kSecondary,  // "FPGA secondary": the same, board 1 of a pair
  kTactile,    // "FPGA tactile modulation": 16 phases, always modulated, a single board
};

/// In which order a SonicSurface board takes its 256 phases.
enum class SonicsurfaceOrder {
  kFpga,     // of its wiring: blocks of four columns; what all three published firmwares expect
  kNatural,  // row by row: for a firmware that undoes the wiring itself
};

/// What the text after --to names:
///
///   dry-run[:FILE][?levels=256|32|16]
///   sonicsurface:PORT[?firmware=primary|secondary|tactile][&order=fpga|natural]
///   autd3-udp | autd3-udp:INTERFACE | autd3-udp:HOST:PORT
struct LinkAddress {
  enum class Kind { kDryRun, kSonicsurface, kAutd3Udp };

  Kind kind = Kind::kDryRun;
  std::string path;  // file or port; empty: a dry run that writes nothing
  int levels = 256;  // phases of a dry run, 2..256
  SonicsurfaceFirmware firmware = SonicsurfaceFirmware::kPrimary;
  SonicsurfaceOrder order = SonicsurfaceOrder::kFpga;
  std::string host;  // of autd3-udp: with port 0 a network interface, or empty: whichever
  int port = 0;
};

/// throws   InputError naming what is wrong and what there is
LinkAddress parse_link_address(const std::string& text);

}  // namespace touchfield
