#pragma once

#include <string>
#include <utility>
#include <vector>

namespace touchfield {

/// The libraries whose versions change results, files or speed: name and version, as loaded where the library says it,
/// else as compiled against.
std::vector<std::pair<std::string, std::string>> library_versions();

}  // namespace touchfield
