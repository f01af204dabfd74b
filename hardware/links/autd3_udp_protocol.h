#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace touchfield::autd3_udp {

/// The UDP protocol of AUTD3 units with firmware 0.10 and later: version 2 is that of firmware 0.10 and 0.11, version 3
/// that of 0.12. Numbers are little-endian. A datagram holds at most 1452 bytes:
///
///   to a unit        version u8, kind u8, message u16, body
///   body of a frame  sequence u8, command u8, in version 3 the time of execution u32 (0: at once), payload
///   answer           version u8, kind u8, message u16, status u8 (0: done), data
///   to a frame       version u8, kind u8, message u16, sequence u8 of the command that was executed last (255: none
///                    since the reset), its status u8, flags u8, unit u8, clock u64 [ns], data
///
/// A unit executes the commands of a sequence in order and each once, whoever sends them. It answers a repeated one
/// again, and drops any other that is not the next. It switches its output off 500 ms after the last frame.
///
/// Source: the bytes of the SDK of the vendor, 0.10 to 0.12 (PyPI autd3);
/// github.com/shinolab/autd3-sdk, firmware/cpu/wire.

inline constexpr int kPort = 44336;
inline constexpr int kNewest = 3;
inline constexpr int kOldest = 2;

enum class Kind : std::uint8_t {
  kFrame = 0,
  kReadUnit = 1,  // to all or one -> UnitInfo
  kResetId = 2,   // to all: they forget their numbers, and close the way to the next unit, within 20 ms
  kDiscover = 3,  // to all: answered by units without a number
  kAssignId = 4,  // to one: number u8, role u8 (1: its clock leads)
  kUnblock = 5,   // to one: opens the way to the next unit -> u8: whether there is one
  kSetTime = 6,   // to the one that leads: clock u64 [ns], below 2^32 s
};

using Bytes = std::vector<std::uint8_t>;

/// Bits of the flags of a unit.
inline constexpr std::uint8_t kAssigned = 1 << 0;
inline constexpr std::uint8_t kClockInStep =
    1 << 3 | 1 << 4;  // its clock follows that of the first unit and gives a pulse

/// The state that kReadState is answered with.
inline constexpr std::uint8_t kSwitchedOff = 1 << 7;  // by the failsafe, until it is cleared

struct Command {
  std::uint8_t number = 0;
  Bytes payload;
};

/// One pattern of one unit, 249 steps each.
struct UnitFrame {
  std::span<const std::uint8_t> phases;
  std::span<const std::uint8_t> intensities;
};

/// Begins a sequence: the next command is number 0. Executed at once, and answered with kAfterReset.
inline const Command kReset{0x00, {}};
inline constexpr std::uint8_t kAfterReset = 255;  // as the number of the command that was executed last
/// In step with the pulse of the clock.
inline const Command kSynchronize{0x01, {}};
/// Everything as after power-up, silent; the failsafe is released.
inline const Command kClear{0x03, {}};
inline const Command kReadState{0xe7, {}};
/// -> firmware of processor and gates, three numbers each.
inline const Command kReadFirmware{0xeb, {}};

/// The pattern that is emitted from now on.
std::vector<Command> pattern(int version, const UnitFrame& frame);

/// Stores patterns, from number `first` on, which is even. They are not emitted: the bank is not that of pattern().
std::vector<Command> stored(std::size_t first, std::span<const UnitFrame> frames);

/// Plays the first stored patterns by the clock of the unit, again and again.
///
/// count     2..kMostStored
/// divider   40 kHz over the patterns per second, 1..65535
std::vector<Command> played(std::size_t count, std::uint16_t divider);

inline constexpr std::size_t kMostStored = 1024;

/// The samples that modulate from now on, repeated for ever.
///
/// samples   2..65536
/// divider   40 kHz over the samples per second
std::vector<Command> modulation(int version, std::span<const std::uint8_t> samples, std::uint16_t divider);

/// Smoothing: a change is spread over so many periods of the carrier. A modulation or a stored sequence that changes
/// faster is refused by the unit.
Command smoothing(std::uint16_t intensity_steps, std::uint16_t phase_steps);

/// What a unit says on a refused command.
std::string status_text(std::uint8_t status);

/// The body of kSetTime.
Bytes clock_bytes(std::uint64_t clock);

Bytes datagram(int version, Kind kind, std::uint16_t message, std::span<const std::uint8_t> body);
Bytes frame(int version, std::uint16_t message, std::uint8_t sequence, const Command& command);

struct Answer {
  int version = 0;
  std::uint8_t kind = 0;
  std::uint16_t message = 0;
  Bytes body;  // after the header
};

struct FrameAnswer {
  std::uint8_t sequence = 0;
  std::uint8_t status = 0;
  std::uint64_t clock = 0;  // [ns]
  Bytes data;
};

struct UnitInfo {
  std::uint8_t id = 255;  // 255: it has none
  std::uint8_t flags = 0;
  std::string firmware;     // "0.12.0"
  std::uint64_t clock = 0;  // [ns]
};

/// Nothing if the bytes are too few.
std::optional<Answer> answer_of(std::span<const std::uint8_t> datagram);
std::optional<FrameAnswer> frame_answer_of(const Answer& answer);
/// Nothing also if the unit did not understand.
std::optional<UnitInfo> unit_info_of(const Answer& answer);
/// "0.12.0" from three bytes on.
std::string firmware_text(std::span<const std::uint8_t> bytes);

}  // namespace touchfield::autd3_udp
