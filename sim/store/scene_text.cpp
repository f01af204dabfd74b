#include "sim/store/scene_text.h"

#include <algorithm>
#include <sstream>
#include <string_view>

namespace touchfield {

// A resolved scene has a key a line, and nothing but a hand has a side.
std::string with_sides_exchanged(const std::string& scene) {
  constexpr std::string_view kRight = "side: right";
  constexpr std::string_view kLeft = "side: left";
  std::istringstream lines(scene);
  std::string result;
  for (std::string line; std::getline(lines, line); result += line + '\n') {
    const std::size_t begin = std::min(line.find_first_not_of(' '), line.size());
    const std::string_view said = std::string_view(line).substr(begin);
    if (said == kRight || said == kLeft) {
      line.replace(begin, said.size(), said == kRight ? kLeft : kRight);
    }
  }
  return result;
}

}  // namespace touchfield
