#include "hardware/links/sonicsurface_protocol.h"

#include <numeric>

namespace touchfield::sonicsurface {

namespace {

constexpr int kSide = 16;
constexpr int kBlockColumns = 4;                                // a block of 64 bytes is four columns wide
constexpr int kGroup = 8;                                       // and goes down two rows every 8 bytes
constexpr int kGroupColumn[kGroup] = {0, 2, 3, 1, 0, 3, 2, 1};  // of each byte of a group in its block
constexpr int kGroupRow[kGroup] = {0, 0, 0, 1, 1, 1, 1, 0};
constexpr int kBytePhases = 32;

void append_all_off(std::vector<std::uint8_t>& bytes) {
  bytes.push_back(kStart);
  bytes.insert(bytes.end(), kTransducers, kOff);
}

std::uint8_t board_byte(int board) { return static_cast<std::uint8_t>(kSelectBoard + board); }

}  // namespace

std::array<int, kTransducers> wiring(SonicsurfaceOrder order) {
  std::array<int, kTransducers> byte_of{};
  if (order == SonicsurfaceOrder::kNatural) {
    std::iota(byte_of.begin(), byte_of.end(), 0);
    return byte_of;
  }
  for (int byte = 0; byte < kTransducers; ++byte) {
    const int block = byte / (kBlockColumns * kSide);
    const int group = byte / kGroup % (kSide / 2);
    const int column = kBlockColumns * block + kGroupColumn[byte % kGroup];
    const int row = 2 * group + kGroupRow[byte % kGroup];
    const int place = row * kSide + column;
    byte_of[static_cast<std::size_t>(place)] = byte;
  }
  return byte_of;
}

int phase_levels(SonicsurfaceFirmware firmware) {
  return firmware == SonicsurfaceFirmware::kTactile ? kBytePhases / 2 : kBytePhases;
}

std::vector<double> modulation_frequencies(SonicsurfaceFirmware firmware) {
  constexpr double kTicks = 640e3;               // [Hz]
  constexpr double kSteps = 2.0 * kTransducers;  // in a period
  constexpr int kStepLengths = 32;
  std::vector<double> frequencies;
  if (firmware == SonicsurfaceFirmware::kTactile) {
    for (int s = 0; s < kStepLengths; ++s) {
      frequencies.push_back(kTicks / (kSteps * (s + 1)));
    }
  }
  return frequencies;
}

std::uint8_t modulation_byte(std::size_t s) { return static_cast<std::uint8_t>(0xA0 | s); }

std::vector<std::uint8_t> frame_bytes(const DriveFrame& frame, SonicsurfaceFirmware firmware, SonicsurfaceOrder order) {
  const int per_step = kBytePhases / phase_levels(firmware);
  const std::array<int, kTransducers> byte_of = wiring(order);
  std::vector<std::uint8_t> bytes(kBytesPerFrame);
  bytes.front() = kStart;
  bytes.back() = kCommit;
  for (std::size_t n = 0; n < kTransducers; ++n) {
    bytes[1 + static_cast<std::size_t>(byte_of[n])] =
        frame.intensity[n] == 0 ? kOff : static_cast<std::uint8_t>(per_step * frame.phase[n]);
  }
  return bytes;
}

std::vector<std::uint8_t> silent_bytes(SonicsurfaceFirmware firmware) {
  std::vector<std::uint8_t> bytes;
  const bool tactile = firmware == SonicsurfaceFirmware::kTactile;
  for (int buffer = 0; buffer < 2; ++buffer) {
    for (int board = 0; board < (tactile ? 1 : 2); ++board) {
      if (!tactile) bytes.push_back(board_byte(board));
      append_all_off(bytes);
    }
    bytes.push_back(kCommit);
  }
  if (!tactile) {
    bytes.push_back(board_byte(firmware == SonicsurfaceFirmware::kPrimary ? 0 : 1));
  }
  return bytes;
}

}  // namespace touchfield::sonicsurface
