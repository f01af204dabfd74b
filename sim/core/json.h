#pragma once

#include <nlohmann/json_fwd.hpp>

namespace touchfield {

/// What a program says: results as JSON (json_text.h), as text for people (text_table.h) and as objects in Python. Keys
/// stay in the order in which they were added. Source files that touch the contents include <nlohmann/json.hpp>.
using Json = nlohmann::ordered_json;

}  // namespace touchfield
