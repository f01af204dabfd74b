#pragma once

#include <string>
#include <string_view>

#include <nlohmann/json_fwd.hpp>

namespace touchfield {

/// What a program says: results as JSON (json_text), as text for people (text_table.h) and as objects in Python. Keys
/// stay in the order in which they were added. Source files that touch the contents include <nlohmann/json.hpp>.
using Json = nlohmann::ordered_json;

/// The text of a JSON value of nlohmann's library. Bytes of a path that are not UTF-8 become U+FFFD.
///
/// indent   -1: in one line
template <class Json>
std::string json_text(const Json& json, int indent = -1) {
  return json.dump(indent, ' ', false, Json::error_handler_t::replace);
}

/// throws   Json::exception on text that is not JSON
template <class Json>
Json json_from_text(std::string_view text) {
  return Json::parse(text);
}

}  // namespace touchfield
