#pragma once

#include <cstdint>
#include <string>

namespace touchfield {

/// "1 face", "2 faces".
inline std::string counted(std::int64_t count, const std::string& one, const std::string& many) {
  return std::to_string(count) + " " + (count == 1 ? one : many);
}

}  // namespace touchfield
