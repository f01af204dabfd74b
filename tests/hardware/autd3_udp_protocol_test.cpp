#include "hardware/links/autd3_udp_protocol.h"

#include <fstream>

#include <fmt/format.h>

#include "hardware/links/autd3_udp_link.h"
#include "tests/support/testing.h"

namespace touchfield::autd3_udp_protocol_test {

using autd3_udp::Bytes;
using autd3_udp::Command;

constexpr std::size_t kUnits = 2;
constexpr std::size_t kTransducers = 249;

// The bytes that tests/hardware/autd3_udp_vectors.py makes too.
Bytes seeded(std::uint32_t seed, std::size_t count) {
  Bytes made(count);
  for (std::uint8_t& byte : made) {
    seed = 1664525 * seed + 1013904223;
    byte = static_cast<std::uint8_t>(seed >> 24);
  }
  return made;
}

// The part of the second unit: phases of both units, then intensities of both.
autd3_udp::UnitFrame second(const Bytes& pattern) {
  const std::span<const std::uint8_t> all = pattern;
  return {all.subspan(kTransducers, kTransducers), all.subspan((kUnits + 1) * kTransducers, kTransducers)};
}

Bytes pattern_bytes(std::uint32_t seed) { return seeded(seed, 2 * kUnits * kTransducers); }

std::string hex(std::span<const std::uint8_t> bytes) {
  std::string text;
  for (const std::uint8_t byte : bytes) text += fmt::format("{:02x}", byte);
  return text;
}

// What the vendor's SDK sends, by version and name, from the command's number on: see autd3_udp_vectors.py.
std::map<std::string, std::vector<std::string>> kept() {
  std::ifstream file(TOUCHFIELD_SOURCE_DIR "/tests/data/autd3_udp_commands.txt");
  std::map<std::string, std::vector<std::string>> lines;
  for (std::string line; std::getline(file, line);) {
    std::istringstream words(line);
    std::string version;
    std::string name;
    words >> version >> name;
    for (std::string bytes; words >> bytes;) lines[version + " " + name].push_back(bytes);
  }
  return lines;
}

TEST(Autd3UdpProtocol, CommandsAreThoseOfTheSdk) {
  const auto expected = kept();
  ASSERT_EQ(expected.size(), 14);
  const std::vector<Bytes> patterns{pattern_bytes(10), pattern_bytes(11), pattern_bytes(12)};
  std::vector<autd3_udp::UnitFrame> stored;
  for (const Bytes& one : patterns) stored.push_back(second(one));
  std::vector<Command> sequence = autd3_udp::stored(0, stored);
  const std::vector<Command> played = autd3_udp::played(stored.size(), 40);
  sequence.insert(sequence.end(), played.begin(), played.end());
  const Bytes one = pattern_bytes(1);
  const Bytes few = seeded(2, 20);
  const Bytes many = seeded(3, 1500);
  for (const int version : {2, 3}) {
    const std::map<std::string, std::vector<Command>> ours{
        {"smoothing", {autd3_udp::smoothing(kAutd3IntensitySteps, kAutd3PhaseSteps)}},
        {"pattern", autd3_udp::pattern(version, second(one))},
        {"modulation_20", autd3_udp::modulation(version, few, kAutd3ModulationDivider)},
        {"modulation_1500", autd3_udp::modulation(version, many, kAutd3ModulationDivider)},
        {"stored_3", sequence},
        {"clear", {autd3_udp::kClear}},
        {"synchronize", {autd3_udp::kSynchronize}}};
    for (const auto& [name, commands] : ours) {
      constexpr std::size_t kBeforeCommand = 5;
      std::vector<std::string> bytes;
      for (const Command& command : commands) {
        const Bytes datagram = autd3_udp::frame(version, 0, 0, command);
        EXPECT_LE(datagram.size(), 1452);
        bytes.push_back(hex(std::span(datagram).subspan(kBeforeCommand)));
      }
      EXPECT_EQ(bytes, expected.at(fmt::format("{} {}", version, name))) << name << " of version " << version;
    }
  }
}

TEST(Autd3UdpProtocol, HeadersAndAnswers) {
  EXPECT_THAT(autd3_udp::frame(3, 0x1234, 7, autd3_udp::kReadState),
              ElementsAre(3, 0, 0x34, 0x12, 7, 0xe7, 0, 0, 0, 0));
  EXPECT_THAT(autd3_udp::frame(2, 0x1234, 7, autd3_udp::kReadState), ElementsAre(2, 0, 0x34, 0x12, 7, 0xe7));
  const Bytes body{1, 2};
  EXPECT_THAT(autd3_udp::datagram(3, autd3_udp::Kind::kAssignId, 5, body), ElementsAre(3, 4, 5, 0, 1, 2));

  // Both as the emulator of SDK 0.12 sent them.
  const auto state = autd3_udp::answer_of(Bytes{3, 0, 9, 0, 7, 0, 0x3f, 0, 0x2c, 0x65, 0x9a, 6, 0, 0, 0, 0, 0x88});
  ASSERT_TRUE(state);
  const auto frame = autd3_udp::frame_answer_of(*state);
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->sequence, 7);
  EXPECT_EQ(frame->status, 0);
  EXPECT_EQ(frame->clock, 0x069a652cU);
  EXPECT_THAT(frame->data, ElementsAre(0x88));
  const auto about = autd3_udp::answer_of(
      Bytes{3, 1, 8, 0, 0, 1, 3, 0, 0, 0, 12, 0, 0, 0xcc, 0x6b, 0xe4, 0x15, 0, 0, 0, 0, 0, 0, 0, 0});
  ASSERT_TRUE(about);
  const auto info = autd3_udp::unit_info_of(*about);
  ASSERT_TRUE(info);
  EXPECT_EQ(info->id, 1);
  EXPECT_EQ(info->flags, 3);
  EXPECT_EQ(info->firmware, "0.12.0");
  EXPECT_EQ(info->clock, 0x15e46bccU);
  EXPECT_THAT(autd3_udp::clock_bytes(info->clock), ElementsAre(0xcc, 0x6b, 0xe4, 0x15, 0, 0, 0, 0));
}

TEST(Autd3UdpProtocol, WhatIsTooShortIsNoAnswer) {
  EXPECT_FALSE(autd3_udp::answer_of(Bytes{3, 0, 9, 0}));
  EXPECT_FALSE(autd3_udp::frame_answer_of({3, 0, 9, Bytes(11)}));
  EXPECT_FALSE(autd3_udp::frame_answer_of({3, 1, 9, Bytes(12)}));
  EXPECT_FALSE(autd3_udp::unit_info_of({3, 1, 9, Bytes(20)}));
  EXPECT_FALSE(autd3_udp::unit_info_of({3, 1, 9, Bytes(21, 1)})) << "it did not understand";
}

}  // namespace touchfield::autd3_udp_protocol_test
