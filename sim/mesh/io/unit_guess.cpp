#include "sim/mesh/io/unit_guess.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/require.h"

namespace touchfield {

namespace {

// Longest extents [m]. A fist is some 0.12 m with its wrist; the longest hands are 0.22 m, with a forearm 0.56 m.
constexpr double kShortestHand = 0.12;
constexpr double kLongestHand = 0.56;
constexpr double kFingertip = 0.01;
constexpr double kArm = 1.0;
constexpr double kLeastMeshed = 1e-3;  // below, no mesh at ultrasound's wavelengths is of use
constexpr double kInch = 25.4e-3;

bool is_hand(double metres) { return metres >= kShortestHand && metres <= kLongestHand; }
bool is_body(double metres) { return metres >= kFingertip && metres <= kArm; }

/// By what factor a size is too small or too large for a hand, as a logarithm. Parts of hands are more common than more
/// than a forearm: what is longer counts from a hand without one.
double misfit(double metres) {
  constexpr double kAlone = 0.26;
  return is_hand(metres) ? 0.0 : std::max(std::log(kShortestHand / metres), std::log(metres / kAlone));
}

std::string sizes_text(double size) {
  const std::string inches =
      is_hand(size * kInch) ? fmt::format(", {} if in inches (scale it by 25.4)", length_text(size * kInch)) : "";
  return fmt::format("{:.3g} units across: {} if in mm, {} if in cm, {} if in m{}; a hand is {:.0f} to {:.0f} mm", size,
                     length_text(size * 1e-3), length_text(size * 1e-2), length_text(size), inches, kShortestHand * 1e3,
                     kLongestHand * 1e3);
}

}  // namespace

std::string unit_in_words(const LengthUnit& unit) {
  return unit.power == 0 ? "metres" : unit.power == -2 ? "centimetres" : "millimetres";
}

std::string length_text(double metres) {
  return metres < 1.0 ? fmt::format("{:.3g} mm", metres * 1e3) : fmt::format("{:.3g} m", metres);
}

const LengthUnit& file_unit(const std::string& name) {
  const auto found =
      std::find_if(kFileUnits.begin(), kFileUnits.end(), [&](const LengthUnit& unit) { return name == unit.name; });
  require(found != kFileUnits.end(), "unit '{}' must be mm, cm or m", name);
  return *found;
}

double surface_size(const FileSurface& surface) {
  std::vector<bool> named(surface.points.size(), false);
  for (const auto& triangle : surface.triangles) {
    for (const std::int64_t v : triangle) {
      named[static_cast<std::size_t>(v)] = true;
    }
  }
  Vector3 mean = Vector3::Zero();
  double count = 0;
  for (std::size_t v = 0; v < named.size(); ++v) {
    if (named[v]) {
      count += 1;
      mean += (surface.points[v] - mean) / count;
    }
  }
  const auto farthest_from = [&](const Vector3& x) {
    Vector3 farthest = x;
    for (std::size_t v = 0; v < named.size(); ++v) {
      if (named[v] && (surface.points[v] - x).squaredNorm() > (farthest - x).squaredNorm()) {
        farthest = surface.points[v];
      }
    }
    return farthest;
  };
  const Vector3 end = farthest_from(mean);
  return (farthest_from(end) - end).norm();
}

void require_body_size(double size, const std::string& name) {
  if (!(size >= kLeastBody && size <= kMostBody)) {
    throw InputError(fmt::format("{}: the body is {:.3g} mm across, it must be {:.2g} to {:.0f} mm; is the unit right?",
                                 name, size * 1e3, kLeastBody * 1e3, kMostBody * 1e3));
  }
}

UnitGuess guess_unit(double size) {
  require(size > 0 && std::isfinite(size), "mesh: all its points lie within {} units of each other, it has no size",
          size);
  const LengthUnit* best = kFileUnits.data();
  int bodies = 0;
  const bool in_millimetres = is_body(size * best->metres);
  for (const LengthUnit& unit : kFileUnits) {
    bodies += is_body(size * unit.metres) ? 1 : 0;
    if (!in_millimetres && misfit(size * unit.metres) < misfit(size * best->metres)) {
      best = &unit;
    }
  }
  const double metres = size * best->metres;
  UnitGuess guess{*best, UnitCertainty::kUnclear, sizes_text(size)};
  if (is_hand(metres) && bodies == 1) {
    guess.certainty = UnitCertainty::kSure;
  } else if (!is_body(metres)) {
    guess.certainty = UnitCertainty::kNone;
  }
  return guess;
}

std::optional<UnitDoubt> unit_doubt(double size, const std::optional<std::string>& stated) {
  const UnitGuess guess = guess_unit(size);
  if (stated) {
    const double metres = size * file_unit(*stated).metres;
    if (is_body(metres)) {
      return std::nullopt;
    }
    const bool slip = is_body(size * guess.unit.metres) &&
                      (metres < kLeastMeshed || metres > kMostBody || guess.certainty == UnitCertainty::kSure);
    const std::string better = guess.certainty == UnitCertainty::kNone
                                   ? "no unit makes it one"
                                   : fmt::format("it looks like {}", guess.unit.name);
    return UnitDoubt{slip, fmt::format("unit {} makes the body {} across; {} ({})", *stated, length_text(metres),
                                       better, guess.reason)};
  }
  switch (guess.certainty) {
    case UnitCertainty::kSure:
      if (guess.unit.name == std::string("mm")) {
        return std::nullopt;
      }
      return UnitDoubt{
          true, fmt::format("the unit is missing, and the file looks like {} ({})", guess.unit.name, guess.reason)};
    case UnitCertainty::kUnclear:
      return UnitDoubt{true, fmt::format("the unit is missing, and the size does not tell it ({})", guess.reason)};
    case UnitCertainty::kNone:
      break;
  }
  return UnitDoubt{
      true,
      fmt::format("the unit is missing, and with no unit the body is a hand, a finger or an arm ({})", guess.reason)};
}

}  // namespace touchfield
