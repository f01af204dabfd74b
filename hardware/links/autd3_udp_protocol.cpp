#include "hardware/links/autd3_udp_protocol.h"

#include <algorithm>
#include <concepts>

#include <fmt/format.h>

namespace touchfield::autd3_udp {

namespace {

constexpr std::size_t kMostBytes = 1452;
constexpr std::size_t kHeader = 4;
constexpr std::uint8_t kAtOnce = 0xff;      // a change of banks does not wait for an event
constexpr std::uint16_t kForEver = 0xffff;  // of repetitions
constexpr std::uint16_t kHeld = 0xffff;     // divider of a pattern that stands alone
constexpr std::uint8_t kRaw = 1;            // patterns of phases and intensities, not of foci
constexpr std::uint8_t kStrict = 1 << 1;    // smoothing: what would be cut short is refused
constexpr std::uint16_t kUpdateRate = 256;  // of the other kind of smoothing, without effect here
constexpr std::size_t kFramesPerWrite = 2;  // that fit into a datagram
constexpr std::uint8_t kBank = 0;           // of modulation, and of patterns that are sent one by one
constexpr std::uint8_t kStoredBank = 1;     // of stored patterns

template <std::unsigned_integral Number>
void append(Bytes& bytes, Number number) {
  for (std::size_t byte = 0; byte < sizeof(Number); ++byte) {
    bytes.push_back(static_cast<std::uint8_t>(number >> (8 * byte)));
  }
}

void append(Bytes& bytes, std::span<const std::uint8_t> more) { bytes.insert(bytes.end(), more.begin(), more.end()); }

template <class... Numbers>
Bytes packed(Numbers... numbers) {
  Bytes bytes;
  (append(bytes, numbers), ...);
  return bytes;
}

void append(Bytes& bytes, const UnitFrame& frame) {
  append(bytes, frame.phases);
  append(bytes, frame.intensities);
}

std::uint64_t clock_at(const Bytes& body, std::size_t at) {
  std::uint64_t clock = 0;
  for (std::size_t byte = 0; byte < sizeof clock; ++byte) {
    clock |= std::uint64_t{body[at + byte]} << (8 * byte);
  }
  return clock;
}

Command write_patterns(std::uint8_t bank, std::size_t index, std::span<const UnitFrame> frames) {
  Bytes payload = packed(bank, static_cast<std::uint8_t>(frames.size()), static_cast<std::uint16_t>(index));
  for (const UnitFrame& frame : frames) {
    append(payload, frame);
  }
  return {0x15, payload};
}

Command configure_patterns(std::uint8_t bank, std::uint16_t divider, std::size_t count) {
  constexpr std::uint32_t kNoFoci = 0;
  return {0x11, packed(bank, kRaw, divider, static_cast<std::uint32_t>(count), kNoFoci, kForEver)};
}

Bytes activation(std::uint8_t bank) { return packed(bank, kAtOnce, std::uint64_t{0}); }

}  // namespace

std::vector<Command> pattern(int version, const UnitFrame& frame) {
  if (version < 3) {
    return {write_patterns(kBank, 0, {&frame, 1}), configure_patterns(kBank, kHeld, 1), {0x12, activation(kBank)}};
  }
  Bytes payload = activation(kBank);
  append(payload, frame);
  return {{0x16, payload}};
}

std::vector<Command> stored(std::size_t first, std::span<const UnitFrame> frames) {
  std::vector<Command> commands;
  for (std::size_t at = 0; at < frames.size(); at += kFramesPerWrite) {
    commands.push_back(
        write_patterns(kStoredBank, first + at, frames.subspan(at, std::min(kFramesPerWrite, frames.size() - at))));
  }
  return commands;
}

std::vector<Command> played(std::size_t count, std::uint16_t divider) {
  return {configure_patterns(kStoredBank, divider, count), {0x12, activation(kStoredBank)}};
}

std::vector<Command> modulation(int version, std::span<const std::uint8_t> samples, std::uint16_t divider) {
  constexpr std::size_t kBeforeSamples = 6;
  const std::size_t most = kMostBytes - kHeader - (version < 3 ? 2 : 6) - kBeforeSamples;
  std::vector<Command> commands;
  for (std::size_t at = 0; at < samples.size(); at += most) {
    Bytes payload = packed(kBank, std::uint8_t{0}, static_cast<std::uint32_t>(at));
    append(payload, samples.subspan(at, std::min(most, samples.size() - at)));
    commands.push_back({0x20, payload});
  }
  commands.push_back(
      {0x21, packed(kBank, std::uint8_t{0}, divider, static_cast<std::uint32_t>(samples.size()), kForEver)});
  commands.push_back({0x22, activation(kBank)});
  return commands;
}

Command smoothing(std::uint16_t intensity_steps, std::uint16_t phase_steps) {
  return {0x30, packed(kStrict, std::uint8_t{0}, kUpdateRate, kUpdateRate, intensity_steps, phase_steps)};
}

std::string status_text(std::uint8_t status) {
  const char* known = status == 0x01   ? "it does not know the command"
                      : status == 0x02 ? "its data are invalid"
                      : status == 0x04 ? "it changes faster than the smoothing allows"
                      : status == 0x05 ? "its start does not suit its repetition"
                      : status == 0x07 ? "its gates did not respond"
                      : status == 0x08 ? "its clock does not run"
                                       : "the vendor's documents name the reason";
  return fmt::format("status {:#04x}: {}", status, known);
}

Bytes clock_bytes(std::uint64_t clock) { return packed(clock); }

Bytes datagram(int version, Kind kind, std::uint16_t message, std::span<const std::uint8_t> body) {
  Bytes bytes = packed(static_cast<std::uint8_t>(version), static_cast<std::uint8_t>(kind), message);
  append(bytes, body);
  return bytes;
}

Bytes frame(int version, std::uint16_t message, std::uint8_t sequence, const Command& command) {
  Bytes body = packed(sequence, command.number);
  if (version >= 3) {
    append(body, std::uint32_t{0});
  }
  append(body, command.payload);
  return datagram(version, Kind::kFrame, message, body);
}

std::optional<Answer> answer_of(std::span<const std::uint8_t> datagram) {
  if (datagram.size() <= kHeader) {
    return std::nullopt;
  }
  return Answer{datagram[0], datagram[1], static_cast<std::uint16_t>(datagram[2] | datagram[3] << 8),
                Bytes(datagram.begin() + kHeader, datagram.end())};
}

std::optional<FrameAnswer> frame_answer_of(const Answer& answer) {
  constexpr std::size_t kBeforeData = 12;
  if (answer.kind != static_cast<std::uint8_t>(Kind::kFrame) || answer.body.size() < kBeforeData) {
    return std::nullopt;
  }
  return FrameAnswer{answer.body[0], answer.body[1], clock_at(answer.body, 4),
                     Bytes(answer.body.begin() + kBeforeData, answer.body.end())};
}

std::optional<UnitInfo> unit_info_of(const Answer& answer) {
  constexpr std::size_t kLength = 21;  // status, number, flags, port, -, firmware (3), -, clock (8), its error (4)
  if (answer.body.size() < kLength || answer.body[0] != 0) {
    return std::nullopt;
  }
  return UnitInfo{answer.body[1], answer.body[2], firmware_text(std::span(answer.body).subspan(5)),
                  clock_at(answer.body, 9)};
}

std::string firmware_text(std::span<const std::uint8_t> bytes) {
  return bytes.size() < 3 ? "unknown" : fmt::format("{}.{}.{}", bytes[0], bytes[1], bytes[2]);
}

}  // namespace touchfield::autd3_udp
