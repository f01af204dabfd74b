#include "solvers/linear/environment.h"

#include <cstdlib>

namespace touchfield {

std::string environment_value(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? "" : value;
}

}  // namespace touchfield
