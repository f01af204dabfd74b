#include "solvers/linear/processor_level.h"

#include <stdexcept>
#include <utility>

namespace touchfield {

namespace {

constexpr std::pair<InstructionLevel, const char*> kNames[] = {{InstructionLevel::kGeneric, "generic"},
                                                               {InstructionLevel::kV2, "v2"},
                                                               {InstructionLevel::kV3, "v3"},
                                                               {InstructionLevel::kV4, "v4"}};

}  // namespace

std::string to_string(InstructionLevel level) {
  for (const auto& [value, name] : kNames) {
    if (value == level) {
      return name;
    }
  }
  throw std::invalid_argument("InstructionLevel: no such value");
}

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
  if (!all(__builtin_cpu_supports("avx512f"), __builtin_cpu_supports("avx512bw"), __builtin_cpu_supports("avx512cd"),
           __builtin_cpu_supports("avx512dq"), __builtin_cpu_supports("avx512vl"))) {
    return InstructionLevel::kV3;
  }
  return InstructionLevel::kV4;
#else
  return InstructionLevel::kGeneric;
#endif
}

std::vector<InstructionLevel> processor_levels() {
  std::vector<InstructionLevel> levels;
  for (const auto& [level, name] : kNames) {
    if (level <= processor_level()) {
      levels.push_back(level);
    }
  }
  return levels;
}

}  // namespace touchfield
