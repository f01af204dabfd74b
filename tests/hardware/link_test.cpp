#include "hardware/guard/guard_message.h"
#include "hardware/link_address.h"
#include "hardware/links/dry_run_link.h"
#include "hardware/links/sonicsurface_link.h"
#include "tests/support/testing.h"

namespace touchfield::link_test {

void expect_refused(const std::string& text, const char* says) {
  EXPECT_THAT([&] { parse_link_address(text); },
              ThrowsMessage<InputError>(AllOf(HasSubstr("link '" + text + "'"), HasSubstr(says))));
}

TEST(LinkAddress, DryRun) {
  EXPECT_EQ(parse_link_address("dry-run").path, "");
  const LinkAddress address = parse_link_address("dry-run:C:/a.txt?levels=32");
  EXPECT_EQ(address.kind, LinkAddress::Kind::kDryRun);
  EXPECT_EQ(address.path, "C:/a.txt");
  EXPECT_EQ(address.levels, 32);
  expect_refused("dry-run?levels=1", "from 2 to 256");
  expect_refused("dry-run?levels=3e1", "whole number");
  expect_refused("dry-run?levels=32&levels=16", "twice");
  expect_refused("dry-run?levels", "KEY=VALUE");
}

TEST(LinkAddress, Sonicsurface) {
  const LinkAddress address = parse_link_address("sonicsurface:/dev/ttyUSB0");
  EXPECT_EQ(address.kind, LinkAddress::Kind::kSonicsurface);
  EXPECT_EQ(address.path, "/dev/ttyUSB0");
  EXPECT_EQ(address.firmware, SonicsurfaceFirmware::kPrimary);
  EXPECT_EQ(address.order, SonicsurfaceOrder::kFpga);
  const LinkAddress other = parse_link_address("sonicsurface:p?order=natural&firmware=tactile");
  EXPECT_EQ(other.firmware, SonicsurfaceFirmware::kTactile);
  EXPECT_EQ(other.order, SonicsurfaceOrder::kNatural);
  expect_refused("sonicsurface", "sonicsurface:PORT");
  expect_refused("sonicsurface:p?firmware=stock", "primary, secondary, tactile");
  expect_refused("sonicsurface:p?levels=16", "no option 'levels'");
}

TEST(LinkAddress, Autd3Udp) {
  EXPECT_EQ(parse_link_address("autd3-udp").kind, LinkAddress::Kind::kAutd3Udp);
  EXPECT_EQ(parse_link_address("autd3-udp").host, "");
  EXPECT_EQ(parse_link_address("autd3-udp:eth0").host, "eth0");
  EXPECT_EQ(parse_link_address("autd3-udp:eth0").port, 0);
  EXPECT_EQ(parse_link_address("autd3-udp:[::1]:44336").host, "::1");
  EXPECT_EQ(parse_link_address("autd3-udp:[::1]:44336").port, 44336);
  for (const char* text :
       {"autd3-udp:[]:80", "autd3-udp::80", "autd3-udp:[::1]", "autd3-udp:::1", "autd3-udp:fe80::1:80"}) {
    expect_refused(text, "must be autd3-udp:HOST:PORT, e.g. autd3-udp:[::1]:8080");
  }
  expect_refused("autd3-udp:[::1]:0", "from 1 to 65535");
  expect_refused("autd3-udp:eth0?levels=3", "no option 'levels'");
}

TEST(LinkAddress, OthersAreRefused) {
  expect_refused("", "dry-run");
  expect_refused("serial:x", "sonicsurface:PORT");
  expect_refused("autd3", "autd3-udp:HOST:PORT");
}

TEST(RequireFits, CountAndSteps) {
  const LinkAbilities abilities{{32, 2}, 1, {}};
  const DriveFrame frame{{31, 0}, {1, 0}};
  EXPECT_NO_THROW(require_fits(frame, abilities, 2, "board"));
  EXPECT_THROW(require_fits(frame, abilities, 3, "board"), InputError);
  EXPECT_THROW(require_fits({{32, 0}, {1, 0}}, abilities, 2, "board"), InputError);
  EXPECT_THROW(require_fits({{0, 0}, {2, 0}}, abilities, 2, "board"), InputError);
  EXPECT_THROW(require_fits({{0, 0}, {0}}, abilities, 2, "board"), InputError);
}

// Each byte drives one transducer; the first block is the four columns at -x, and its first bytes the row at -y.
TEST(Sonicsurface, Wiring) {
  const auto byte_of = sonicsurface::wiring(SonicsurfaceOrder::kFpga);
  EXPECT_EQ(std::set<int>(byte_of.begin(), byte_of.end()).size(), 256U);
  EXPECT_THAT(std::vector<int>(byte_of.begin(), byte_of.begin() + 8), ElementsAre(0, 7, 1, 2, 64, 71, 65, 66));
  EXPECT_THAT(std::vector<int>(byte_of.begin() + 16, byte_of.begin() + 20), ElementsAre(4, 3, 6, 5));
  EXPECT_EQ(byte_of[32], 8);
  EXPECT_EQ(byte_of[255], 253);
  EXPECT_EQ(sonicsurface::wiring(SonicsurfaceOrder::kNatural)[77], 77);
}

TEST(Sonicsurface, FrameBytes) {
  DriveFrame frame{std::vector<std::uint8_t>(256, 31), std::vector<std::uint8_t>(256, 1)};
  frame.phase[1] = 5;
  frame.intensity[255] = 0;
  const auto bytes = sonicsurface::frame_bytes(frame, SonicsurfaceFirmware::kPrimary, SonicsurfaceOrder::kFpga);
  ASSERT_EQ(bytes.size(), 258U);
  EXPECT_EQ(bytes.front(), 254);
  EXPECT_EQ(bytes.back(), 253);
  EXPECT_EQ(bytes[1 + 7], 5);
  EXPECT_EQ(bytes[1 + 253], 32);
  EXPECT_EQ(std::count(bytes.begin(), bytes.end(), 32), 1);
  EXPECT_EQ(std::count(bytes.begin(), bytes.end(), 31), 254);
  // The tactile firmware drops the lowest bit: its step is two of the byte's.
  frame.phase.assign(256, 15);
  const auto tactile = sonicsurface::frame_bytes(frame, SonicsurfaceFirmware::kTactile, SonicsurfaceOrder::kFpga);
  EXPECT_EQ(std::count(tactile.begin(), tactile.end(), 30), 255);
}

TEST(Sonicsurface, ModulationOfTheTactileFirmware) {
  EXPECT_THAT(sonicsurface::modulation_frequencies(SonicsurfaceFirmware::kPrimary), IsEmpty());
  const auto frequencies = sonicsurface::modulation_frequencies(SonicsurfaceFirmware::kTactile);
  ASSERT_EQ(frequencies.size(), 32U);
  EXPECT_DOUBLE_EQ(frequencies[5], 0.64e6 / 512 / 6);
  EXPECT_EQ(sonicsurface::modulation_byte(0), 0xA0);
  EXPECT_EQ(sonicsurface::modulation_byte(31), 0xBF);
}

template <class Value>
Value brought_back(const Value& value) {
  return unpacked<Value>(packed(value));
}

TEST(GuardMessage, BringsBackWhatWentIn) {
  EXPECT_EQ(brought_back(std::string("a text")), "a text");
  const DriveFrame frame{{1, 2, 3}, {4, 5, 6}};
  EXPECT_EQ(brought_back(frame), frame);
  for (const Modulation& modulation :
       std::vector<Modulation>{StaticModulation{}, SineModulation{30, 0.5}, SampledModulation{{7, 8}, 8000}}) {
    EXPECT_EQ(brought_back(modulation), modulation);
  }
  const LinkSettings settings{"autd3-udp:eth0", autd3_tiles(2, 1, 10.16e-3), 7, true};
  const GuardStart start = brought_back(GuardStart{{0.25, 3}, settings});
  EXPECT_EQ(start.limits.level, 0.25);
  EXPECT_EQ(start.limits.seconds, 3);
  EXPECT_EQ(start.settings.address, settings.address);
  EXPECT_EQ(start.settings.array.positions, settings.array.positions);
  EXPECT_EQ(start.settings.array.axes, settings.array.axes);
  EXPECT_EQ(start.settings.array.device, settings.array.device);
  EXPECT_EQ(start.settings.array.channel, settings.array.channel);
  EXPECT_EQ(start.settings.frames, 7U);
  EXPECT_TRUE(start.settings.replace);
}

// Cut anywhere, or of another kind, it is an error and not a read past the end.
TEST(GuardMessage, CutShort) {
  const GuardBytes whole = packed(GuardStart{{}, {"dry-run", grid_layout(2, 2, 0.01), 1, false}});
  for (std::size_t length = 0; length < whole.size(); ++length) {
    const GuardBytes cut(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(length));
    EXPECT_THROW(unpacked<GuardStart>(cut), IoError) << length;
  }
  EXPECT_THROW(unpacked<DriveFrame>(whole), IoError);
}

}  // namespace touchfield::link_test
