#include "solvers/linear/instruction_level.h"

#include <array>
#include <cstdlib>
#include <stdexcept>

namespace touchfield {

namespace {

constexpr std::array kNames = {"generic", "v2", "v3", "v4"};

InstructionLevel wanted_level() {
  const char* wanted = std::getenv("TOUCHFIELD_LEVEL");
  if (wanted == nullptr || *wanted == '\0') {
    return processor_level();
  }
  std::string names;
  for (const InstructionLevel level : processor_levels()) {
    if (to_string(level) == wanted) {
      return level;
    }
    names += (names.empty() ? "" : ", ") + to_string(level);
  }
  throw std::invalid_argument("TOUCHFIELD_LEVEL = '" + std::string(wanted) +
                              "' must be a level that this processor supports: " + names);
}

}  // namespace

std::string to_string(InstructionLevel level) { return kNames.at(static_cast<std::size_t>(level)); }

InstructionLevel processor_level() {
#ifdef __x86_64__
  __builtin_cpu_init();
  const auto all = [](auto... has) { return (... && (has != 0)); };
  if (!all(__builtin_cpu_supports("ssse3"), __builtin_cpu_supports("sse4.2"), __builtin_cpu_supports("popcnt"))) {
    return InstructionLevel::kGeneric;
  }
  if (!all(__builtin_cpu_supports("avx2"), __builtin_cpu_supports("fma"), __builtin_cpu_supports("bmi"),
           __builtin_cpu_supports("bmi2"))) {
    return InstructionLevel::kV2;
  }
  return all(__builtin_cpu_supports("avx512f"), __builtin_cpu_supports("avx512bw"), __builtin_cpu_supports("avx512cd"),
             __builtin_cpu_supports("avx512dq"), __builtin_cpu_supports("avx512vl"))
             ? InstructionLevel::kV4
             : InstructionLevel::kV3;
#else
  return InstructionLevel::kGeneric;
#endif
}

std::vector<InstructionLevel> processor_levels() {
  std::vector<InstructionLevel> levels;
  for (std::size_t level = 0; level <= static_cast<std::size_t>(processor_level()); ++level) {
    levels.push_back(static_cast<InstructionLevel>(level));
  }
  return levels;
}

InstructionLevel instruction_level() {
  static const InstructionLevel level = wanted_level();
  return level;
}

}  // namespace touchfield
