#include "sim/store/scene_text.h"

#include <algorithm>
#include <functional>
#include <sstream>

namespace touchfield {

namespace {

/// A resolved scene has a key a line; `change` makes another text of the indent of one and what follows it.
std::string by_lines(const std::string& scene,
                     const std::function<std::string(const std::string& indent, const std::string& said)>& change) {
  std::istringstream lines(scene);
  std::string result;
  for (std::string line; std::getline(lines, line);) {
    const std::size_t begin = std::min(line.find_first_not_of(' '), line.size());
    result += change(line.substr(0, begin), line.substr(begin)) + '\n';
  }
  return result;
}

}  // namespace

std::string with_sides_exchanged(const std::string& scene) {
  const std::string right = "side: right";  // nothing but a hand has a side
  const std::string left = "side: left";
  return by_lines(scene, [&](const std::string& indent, const std::string& said) {
    return indent + (said == right ? left : said == left ? right : said);
  });
}

std::string with_nothing_beyond(const std::string& scene) {
  return by_lines(scene, [](const std::string& indent, const std::string& said) {
    return indent + said + (said.starts_with("keep_within_mm: ") ? '\n' + indent + "beyond: nothing" : "");
  });
}

}  // namespace touchfield
