#include "solvers/linear/instruction_level.h"

#include <cstdlib>
#include <stdexcept>
#include <string>

#include "solvers/linear/system_limits.h"

namespace touchfield {

namespace {

InstructionLevel wanted_level() {
  const InstructionLevel highest = processor_level();
  const char* wanted = std::getenv("TOUCHFIELD_LEVEL");
  if (wanted == nullptr || *wanted == '\0') {
    return highest;
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

InstructionLevel instruction_level() {
  static const InstructionLevel level = (require_sound_variables(), wanted_level());
  return level;
}

}  // namespace touchfield
