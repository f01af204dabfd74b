#include <numbers>

#include "hardware/drive_frame.h"
#include "tests/support/testing.h"

namespace touchfield::modulation_test {

const ModulationAbility kBuffer{4000, 32768, {}};
const ModulationAbility kNone{};
const ModulationAbility kOwn{0, 0, {250, 208, 125}};

// 200 Hz at 4 kHz: 20 samples, from the middle up to full, down to nothing.
TEST(Modulation, TwoHundredHertz) {
  const auto bytes = modulation_samples(SineModulation{200, 1}, kBuffer);
  ASSERT_EQ(bytes.size(), 20U);
  for (std::size_t k = 0; k < bytes.size(); ++k) {
    const double m = 0.5 + 0.5 * std::sin(2 * std::numbers::pi * static_cast<double>(k) / 20);
    EXPECT_NEAR(bytes[k], 255 * m, 0.5 + 1e-9) << k;
  }
  EXPECT_EQ(bytes[5], 255);
  EXPECT_EQ(bytes[15], 0);
}

// Whole periods in the fewest samples: 150 Hz: 80 samples for 3 periods; 30 Hz: 400 for 3.
TEST(Modulation, FewestSamplesOfWholePeriods) {
  EXPECT_EQ(modulation_samples(SineModulation{150, 1}, kBuffer).size(), 80U);
  EXPECT_EQ(modulation_samples(SineModulation{30, 1}, kBuffer).size(), 400U);
  EXPECT_EQ(modulation_samples(SineModulation{1000, 1}, kBuffer).size(), 4U);
  EXPECT_EQ(modulation_samples(SineModulation{0.2, 1}, kBuffer).size(), 20000U);
  const auto bytes = modulation_samples(SineModulation{150, 1}, kBuffer);
  for (std::size_t k = 0; k < bytes.size(); ++k) {
    const double m = 0.5 + 0.5 * std::sin(2 * std::numbers::pi * 150 * static_cast<double>(k) / 4000);
    EXPECT_NEAR(bytes[k], 255 * m, 0.5 + 1e-9) << k;
  }
}

TEST(Modulation, RefusesWhatABufferCannotHold) {
  const auto refused = [](const Modulation& modulation, const ModulationAbility& ability, const char* says) {
    EXPECT_THAT([&] { modulation_samples(modulation, ability); }, ThrowsMessage<InputError>(HasSubstr(says)));
    EXPECT_THROW(require_ability(modulation, ability, "device"), InputError);
  };
  refused(SineModulation{2000, 1}, kBuffer, "below half");
  refused(SineModulation{0.1, 1}, kBuffer, "no whole periods");  // 40,000 samples
  refused(SineModulation{std::numbers::pi, 1}, kBuffer, "no whole periods");
  refused(SineModulation{0, 1}, kBuffer, "frequency = 0");
  refused(SineModulation{std::nan(""), 1}, kBuffer, "frequency");
  refused(SineModulation{200, 0}, kBuffer, "depth = 0");
  refused(SineModulation{200, 1.5}, kBuffer, "depth = 1.5");
  refused(SampledModulation{{}, 4000}, kBuffer, "no sample");
  refused(SampledModulation{{1}, 8000}, kBuffer, "8000");
  refused(SampledModulation{std::vector<std::uint8_t>(40000, 1), 4000}, kBuffer, "40000 samples");
}

TEST(Modulation, ADeviceDoesWhatItCan) {
  EXPECT_NO_THROW(require_ability(StaticModulation{}, kNone, "board"));
  EXPECT_NO_THROW(require_ability(SineModulation{200, 1}, kBuffer, "board"));
  EXPECT_THAT(
      [] {
        require_ability(SineModulation{200, 1}, kNone, "board");
      },
      ThrowsMessage<InputError>(HasSubstr("board: it cannot modulate: 200 Hz sine")));
  EXPECT_THROW(require_ability(SampledModulation{{1}, 4000}, kNone, "board"), InputError);
}

TEST(Modulation, OneThatAlwaysModulatesRefusesNotTo) {
  EXPECT_NO_THROW(require_ability(SineModulation{200, 1}, kOwn, "board"));
  EXPECT_EQ(own_frequency({200, 1}, kOwn, "board"), 1U);
  EXPECT_EQ(own_frequency({130, 1}, kOwn, "board"), 2U);
  EXPECT_THAT(describe(SineModulation{200, 1}, kOwn), HasSubstr("208 Hz"));
  EXPECT_THAT([] { require_ability(StaticModulation{}, kOwn, "board"); },
              ThrowsMessage<InputError>(HasSubstr("modulates on its own")));
  EXPECT_THROW(require_ability(SampledModulation{{1}, 4000}, kOwn, "board"), InputError);
  EXPECT_THROW(require_ability(SineModulation{200, 0.5}, kOwn, "board"), InputError);
  EXPECT_THAT([] { own_frequency({160, 1}, kOwn, "board"); }, ThrowsMessage<InputError>(HasSubstr("nearest 125 Hz")));
}

}  // namespace touchfield::modulation_test
