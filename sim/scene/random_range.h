#pragma once

#include <cstdint>
#include <optional>
#include <random>
#include <string>

#include "sim/scene/input.h"

namespace touchfield::schema {

/// The finite number that a scalar is; nothing if it is none, or quoted.
std::optional<double> number_in(const Node& node);

/// Uniform numbers in [0, 1), the same everywhere: the standard library's distributions differ from one to another.
class Uniform {
 public:
  explicit Uniform(std::uint64_t seed) : engine_(seed) {}
  double operator()() { return static_cast<double>(engine_() >> 11U) * 0x1p-53; }

 private:
  std::mt19937_64 engine_;
};

/// What a random value of a sweep is drawn from.
///
///   uniform   first .. second
///   integer   first, first + 1, ..., second
///   log       first .. second, its logarithm uniform
///   normal    mean first, standard deviation second
struct RandomRange {
  enum class Kind { kUniform, kInteger, kLog, kNormal };
  Kind kind = Kind::kUniform;
  double first = 0;
  double second = 1;

  /// A value as a scene spells it. Every kind takes two numbers, so that a draw does not depend on the others' kinds.
  std::string draw(Uniform& uniform) const;
};

/// Reads [low, high], {integer: [low, high]}, {log: [low, high]} or {normal: [mean, sigma]}. Adds a problem and returns
/// nothing if the value has another form or its numbers do not make a range.
std::optional<RandomRange> read_range(const Entry& entry, Reading& reading);

}  // namespace touchfield::schema
