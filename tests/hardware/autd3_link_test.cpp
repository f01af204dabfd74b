// The AUTD3 link against the vendor's own library, whose audit link runs an emulator of the firmware.
#include <array>
#include <cmath>
#include <dlfcn.h>
#include <numbers>

#include "hardware/links/autd3_units.h"
#include "hardware/quantise.h"
#include "tests/hardware/autd3_support.h"
#include "tests/support/testing.h"

namespace touchfield::autd3_link_test {

constexpr double kTwoPi = 2 * std::numbers::pi;

DriveFrame frame_of(const std::function<std::uint8_t(std::size_t)>& phase,
                    const std::function<std::uint8_t(std::size_t)>& intensity) {
  DriveFrame frame;
  for (std::size_t n = 0; n < 6 * kPerUnit; ++n) {
    frame.phase.push_back(phase(n));
    frame.intensity.push_back(intensity(n));
  }
  return frame;
}

// Byte by byte, unit by unit, by what the emulator says of each unit.
void expect_emitted(const Autd3Link& link, const DriveFrame& frame) {
  for (std::size_t u = 0; u < 6; ++u) {
    const Autd3UnitState state = link.audit(u);
    ASSERT_EQ(state.drives.size(), kPerUnit);
    for (std::size_t i = 0; i < kPerUnit; ++i) {
      ASSERT_EQ(state.drives.phase[i], frame.phase[u * kPerUnit + i]) << "unit " << u << ", transducer " << i;
      ASSERT_EQ(state.drives.intensity[i], frame.intensity[u * kPerUnit + i]) << "unit " << u << ", transducer " << i;
    }
  }
}

TEST_F(Autd3Test, EveryByteArrives) {
  Autd3Link link(options("audit"));
  EXPECT_EQ(link.layout().positions.cols(), 1494);
  link.open();
  std::mt19937_64 bits(3);
  const auto random_byte = [&](std::size_t) { return static_cast<std::uint8_t>(bits() >> 56U); };
  for (int pattern = 0; pattern < 10; ++pattern) {
    const DriveFrame frame = frame_of(random_byte, random_byte);
    link.send(frame);
    expect_emitted(link, frame);
    EXPECT_EQ(link.read_back(), frame);
  }
  const DriveFrame zero = frame_of([](std::size_t) { return 0; }, [](std::size_t) { return 255; });
  link.send(zero);
  expect_emitted(link, zero);
  // Phases just below 2 pi: more than half a step below they are step 255, else they have come round to 0.
  const Eigen::VectorXd below = Eigen::VectorXd::LinSpaced(1494, 1, 0) * kTwoPi / 256;
  const DriveFrame wrapped =
      quantise(kTwoPi - below.array(), Eigen::VectorXd::Ones(1494), 1, link.abilities().steps, "autd3").frame;
  EXPECT_EQ(wrapped.phase[746], 255);
  EXPECT_EQ(wrapped.phase[747], 0);
  link.send(wrapped);
  expect_emitted(link, wrapped);
}

TEST_F(Autd3Test, QuietIsEveryTransducerOff) {
  Autd3Link link(options("audit"));
  link.open();
  EXPECT_EQ(link.read_back(), quiet_frame(1494)) << "an open link must emit nothing yet";
  link.send(frame_of([](std::size_t n) { return static_cast<std::uint8_t>(n); }, [](std::size_t) { return 255; }));
  EXPECT_NE(link.read_back(), quiet_frame(1494));
  link.quiet();
  expect_emitted(link, quiet_frame(1494));
}

// The sign of a phase and the place of each transducer: the vendor's own focus is where ours would be. Both compute in
// their own precision (single: 40 waves of 256 steps with 2^-23 each, times some operations), so a value on the border
// between two steps may fall on either side.
TEST_F(Autd3Test, PhasesHaveTheSignOfTheVendorsFocus) {
  struct FocusOption {
    std::uint8_t intensity;
    std::uint8_t phase_offset;
  };
  const Autd3Library library(library_);
  void* handle = dlopen(library.file().c_str(), RTLD_NOW);
  const auto focus = reinterpret_cast<autd3::Gain* (*)(autd3::Point, FocusOption)>(dlsym(handle, "AUTDGainFocus"));
  const auto environment = reinterpret_cast<void* (*)(autd3::Controller*)>(dlsym(handle, "AUTDEnvironment"));
  const auto wave_number = reinterpret_cast<float (*)(void*)>(dlsym(handle, "AUTDEnvironmentWavenumber"));
  ASSERT_TRUE(focus != nullptr && environment != nullptr && wave_number != nullptr);

  const autd3::Calls& call = library.call();
  const autd3::SenderOption option{autd3_duration(1e-3), autd3_duration(1e-3), autd3_duration(-1)};
  const autd3::Point origin{0, 0, 0};
  const autd3::Quaternion unturned{1, 0, 0, 0};
  autd3::Controller* controller = library.value_of(call.open(&origin, &unturned, 1, call.audit_link(), option), "open");
  const Vector3 at(0.05, 0.12, 0.2);
  const autd3::Point at_mm{50, 120, 200};
  library.value_of(call.send(call.sender(controller, option), call.gain_datagram(focus(at_mm, {200, 0}))), "focus");

  std::array<autd3::Drive, kPerUnit> drives{};
  autd3::Link* link = call.link_of(controller);
  call.audit_drives(link, call.audit_gain_segment(link, 0), 0, 0, drives.data());
  const double k = 1e3 * static_cast<double>(wave_number(environment(controller)));  // [1/m] of [1/mm]
  const ArrayLayout unit = autd3_unit(kAutd3Pitch);
  for (Eigen::Index n = 0; n < unit.positions.cols(); ++n) {
    // p = exp(i phase) exp(i k r) / r is in phase at the focus if phase = -k r.
    const double steps = -k * (at - unit.positions.col(n)).norm() * 256 / kTwoPi;
    const double off = std::remainder(steps - drives[static_cast<std::size_t>(n)].phase, 256);
    EXPECT_LT(std::abs(off), 0.51) << "transducer " << n;
    EXPECT_EQ(drives[static_cast<std::size_t>(n)].intensity, 200);
  }
  library.value_of(call.close(controller), "close");
}

// A pulse of w of 512 counts has the amplitude sin(pi w / 512) at the carrier, so with half a count of rounding the
// amplitude is off by pi / 1024 at most.
TEST_F(Autd3Test, PressureIsLinearInIntensity) {
  struct Width {
    std::uint64_t value;
  };
  const Autd3Library library(library_);
  void* handle = dlopen(library.file().c_str(), RTLD_NOW);
  const auto table = reinterpret_cast<void (*)(autd3::Link*, std::uint16_t, Width*)>(
      dlsym(handle, "AUTDLinkAuditFpgaPulseWidthEncoderTable"));
  const auto counts =
      reinterpret_cast<autd3::Result<std::uint16_t> (*)(Width)>(dlsym(handle, "AUTDPulseWidthPulseWidth"));
  ASSERT_TRUE(table != nullptr && counts != nullptr);

  const autd3::Calls& call = library.call();
  const autd3::SenderOption option{autd3_duration(1e-3), autd3_duration(1e-3), autd3_duration(-1)};
  const autd3::Point origin{0, 0, 0};
  const autd3::Quaternion unturned{1, 0, 0, 0};
  autd3::Controller* controller = library.value_of(call.open(&origin, &unturned, 1, call.audit_link(), option), "open");
  std::array<Width, 256> widths{};
  table(call.link_of(controller), 0, widths.data());
  for (std::size_t t = 0; t < widths.size(); ++t) {
    const double amplitude = std::sin(std::numbers::pi * library.value_of(counts(widths[t]), "width") / 512);
    EXPECT_NEAR(amplitude, static_cast<double>(t) / 255, std::numbers::pi / 1024 + 1e-6) << "intensity " << t;
  }
  library.value_of(call.close(controller), "close");
}

TEST_F(Autd3Test, ModulationIsInEveryUnitsBuffer) {
  Autd3Link link(options("audit"));
  link.open();
  for (const double depth : {1.0, 0.3}) {
    link.set_modulation(SineModulation{.frequency = 200, .depth = depth});
    std::vector<std::uint8_t> expected;
    for (int k = 0; k < 20; ++k) {  // 4000 samples a second, 200 periods a second
      const double m = 1 - depth * (1 - std::sin(kTwoPi * k / 20)) / 2;
      expected.push_back(static_cast<std::uint8_t>(std::lround(255 * m)));
    }
    for (std::size_t u = 0; u < 6; ++u) {
      EXPECT_EQ(link.audit(u).modulation, expected) << "unit " << u;
      EXPECT_EQ(link.audit(u).modulation_divider, 10) << "40 kHz over 10 is 4 kHz";
    }
    EXPECT_EQ(link.read_back_modulation(), expected);
  }
  SampledModulation longest;
  for (std::size_t k = 0; k < link.abilities().modulation.most_samples; ++k) {
    longest.samples.push_back(static_cast<std::uint8_t>(k * k));
  }
  EXPECT_LT(seconds_of([&] { link.set_modulation(longest); }), kWait);
  EXPECT_EQ(link.read_back_modulation(), longest.samples);
  longest.samples.push_back(0);
  EXPECT_THROW(link.set_modulation(longest), InputError);
  link.set_modulation(StaticModulation{});
  EXPECT_EQ(link.read_back_modulation(), (std::vector<std::uint8_t>{255, 255}));
}

TEST_F(Autd3Test, SmoothingEndsOnWhatWasSent) {
  Autd3Link link(options("audit"));
  link.open();
  for (std::size_t u = 0; u < 6; ++u) {
    const Autd3UnitState state = link.audit(u);
    EXPECT_TRUE(state.fixed_steps);
    EXPECT_EQ(state.phase_steps, kAutd3PhaseSteps);
    EXPECT_EQ(state.intensity_steps, kAutd3IntensitySteps);
  }
  // A frame is reached before the next one, a sample before the next one.
  EXPECT_LE(kAutd3PhaseSteps / 40e3, 1 / link.abilities().most_frames_per_second);
  EXPECT_LE(kAutd3IntensitySteps / 40e3, 1 / kAutd3ModulationRate);
}

TEST_F(Autd3Test, LibraryPutsTurnedUnitsWhereTheyAre) {
  Autd3Link link(options("audit"));
  link.open();
  const ArrayLayout theirs = link.library_layout();
  ASSERT_EQ(theirs.positions.cols(), 1494);
  EXPECT_LT((theirs.positions - link.layout().positions).colwise().norm().maxCoeff(), 1e-6);
  EXPECT_LT((theirs.axes - link.layout().axes).colwise().norm().maxCoeff(), 1e-6);
  EXPECT_EQ(theirs.device, link.layout().device);
  EXPECT_EQ(theirs.channel, link.layout().channel);
}

// The library has millimetres in single precision: 100 m away they are 4e-6 m apart.
TEST_F(Autd3Test, UnitsTooFarAwayAreRefused) {
  Autd3Options far = options("audit", 1);
  far.units[0].position = {100.0001234, 0, 0};
  Autd3Link link(far);
  EXPECT_THAT(message_of<DeviceError>([&] { link.open(); }), HasSubstr("from its place"));
  EXPECT_THAT(message_of<DeviceError>([&] { link.send(quiet_frame(kPerUnit)); }), HasSubstr("not open"));
}

TEST_F(Autd3Test, WhatDoesNotFitIsRefusedAndTheLinkGoesOn) {
  Autd3Link link(options("audit"));
  EXPECT_THROW(link.send(quiet_frame(1494)), DeviceError) << "not open yet";
  link.open();
  EXPECT_THROW(link.open(), DeviceError) << "open twice";
  const DriveFrame frame =
      frame_of([](std::size_t n) { return static_cast<std::uint8_t>(n); }, [](std::size_t) { return 9; });
  link.send(frame);
  EXPECT_THROW(link.send(quiet_frame(1493)), InputError);
  EXPECT_THROW(link.send(quiet_frame(0)), InputError);
  EXPECT_THROW(link.set_modulation(SineModulation{.frequency = 3000}), InputError);
  expect_emitted(link, frame);
  link.send(frame);
}

TEST_F(Autd3Test, ABrokenLinkIsLostForGood) {
  Autd3Link link(options("audit"));
  link.open();
  const DriveFrame frame = frame_of([](std::size_t) { return 1; }, [](std::size_t) { return 1; });
  link.send(frame);
  link.break_down();
  EXPECT_LT(seconds_of([&] {
              EXPECT_THAT(message_of<DeviceError>([&] { link.send(frame); }),
                          AllOf(HasSubstr("frame 1"), HasSubstr("audit"), HasSubstr("broken")));
            }),
            kWait);
  EXPECT_THAT(message_of<DeviceError>([&] { link.send(frame); }), HasSubstr("lost before"));
  EXPECT_THAT(message_of<DeviceError>([&] { link.set_modulation(StaticModulation{}); }), HasSubstr("lost before"));
  EXPECT_THROW(link.quiet(), DeviceError);
  EXPECT_LT(seconds_of([&] { link.close(); }), kWait);
  link.open();
  link.send(frame);
  expect_emitted(link, frame);
}

TEST_F(Autd3Test, ALossIsNoticedWhileAFrameIsHeld) {
  Autd3Link link(options("audit"));
  link.open();
  const DriveFrame frame = frame_of([](std::size_t) { return 1; }, [](std::size_t) { return 1; });
  link.send(frame);
  link.check();
  expect_emitted(link, frame);
  link.break_down();
  EXPECT_THAT(message_of<DeviceError>([&] { link.check(); }), AllOf(HasSubstr("held"), HasSubstr("broken")));
  EXPECT_THAT(message_of<DeviceError>([&] { link.send(frame); }), HasSubstr("lost before"));
}

TEST_F(Autd3Test, ALinkBreaksWhereItWasToldTo) {
  Autd3Options breaking = options("audit");
  breaking.break_after = 2;
  Autd3Link link(breaking);
  link.open();
  const DriveFrame frame = frame_of([](std::size_t) { return 1; }, [](std::size_t) { return 1; });
  link.send(frame);
  link.send(frame);
  EXPECT_THROW(link.send(frame), DeviceError);
}

TEST_F(Autd3Test, NopTakesEverythingAndTellsNothing) {
  Autd3Link link(options("nop", 2));
  link.open();
  link.set_modulation(SineModulation{});
  link.send(quiet_frame(2 * kPerUnit));
  EXPECT_EQ(link.read_back(), std::nullopt);
  EXPECT_EQ(link.read_back_modulation(), std::nullopt);
  EXPECT_FALSE(link.abilities().reads_back);
  EXPECT_THROW(link.break_down(), InputError);
  link.quiet();
}

TEST_F(Autd3Test, TwincatSaysWhyItIsNotThere) {
  Autd3Link link(options("twincat"));
  EXPECT_THAT(message_of<DeviceError>([&] { link.open(); }), AllOf(HasSubstr("twincat"), HasSubstr("Windows")));
}

TEST_F(Autd3Test, FoldersThatHoldTheLibraryServeAsWell) {
  const std::string file = Autd3Library(library_).file();
  EXPECT_EQ(Autd3Library(std::filesystem::path(file).parent_path().string()).file(), file);
  const TemporaryDirectory folder;
  std::filesystem::create_directories(folder.path() / "pyautd3");
  std::filesystem::create_directory_symlink(std::filesystem::path(file).parent_path(),
                                            folder.path() / "pyautd3" / "bin");
  EXPECT_EQ(Autd3Library(folder.path().string()).firmware(), Autd3Library(library_).firmware());
}

}  // namespace touchfield::autd3_link_test
