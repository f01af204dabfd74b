#pragma once

#include <string>
#include <vector>

namespace touchfield {

/// How this program is started as the watchdog of a link's guard.
std::vector<std::string> watchdog_command();

}  // namespace touchfield
