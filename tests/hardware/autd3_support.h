#pragma once

// What the tests of the AUTD3 link share. The vendor's library is the one that TOUCHFIELD_AUTD3_LIBRARY names, or else
// the one that scripts/setup_autd3 fetched into the source folder; without it the tests that need it are skipped.

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "hardware/links/autd3_link.h"
#include "tests/support/files.h"
#include "tests/support/random_support.h"
#include "tests/support/testing.h"

namespace touchfield {

inline constexpr std::size_t kPerUnit = 249;
// A call must be back after kLinkPatience; the rest is for a busy machine [s].
inline constexpr double kWait = kLinkPatience + 0.2;

inline double seconds_of(const std::function<void()>& action) {
  const auto start = std::chrono::steady_clock::now();
  action();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// Six units, each turned and moved at random within a cube of 2 m.
inline std::vector<UnitPlacement> random_units(std::mt19937& random) {
  std::vector<UnitPlacement> units(6);
  for (UnitPlacement& unit : units) {
    unit.position = point_in_cube(random);
    unit.rotation = some_rotation(random);
  }
  return units;
}

class Autd3Test : public ::testing::Test {
 protected:
  void SetUp() override {
    const char* named = std::getenv("TOUCHFIELD_AUTD3_LIBRARY");
    library_ = named != nullptr ? named : TOUCHFIELD_SOURCE_DIR "/build/autd3/libautd3capi.so";
    if (!std::filesystem::exists(library_)) {
      GTEST_SKIP() << "there is no AUTD3 library at '" << library_ << "': scripts/setup_autd3 fetches the vendor's";
    }
  }

  Autd3Options options(const std::string& mode, std::size_t units = 6) const {
    Autd3Options made;
    made.library = library_;
    made.mode = mode;
    std::mt19937 random(2);
    made.units = random_units(random);
    made.units.resize(units);
    return made;
  }

  std::string library_;
};

}  // namespace touchfield
