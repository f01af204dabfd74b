#pragma once

#include <string>
#include <string_view>

namespace touchfield {

/// Bytes as text for a library of JSON that takes UTF-8 alone, and back. A byte that is not part of a character becomes
/// one of the last 128 characters of Unicode, U+10FF80 to U+10FFFF, which nobody uses. Where a text does use them, each
/// of their bytes is replaced in this way.
std::string bytes_in_characters(const std::string& bytes);
std::string characters_in_bytes(const std::string& text);

/// The same in the text of JSON: the stand-ins as Python writes such bytes (surrogateescape, PEP 383), ff as \udcff;
/// and back.
std::string with_escaped_bytes(const std::string& json);
/// throws   InputError on more than 64 levels
std::string with_stand_ins(std::string_view json);

/// A JSON value with each text and key changed.
template <class Json, class Change>
Json with_changed_texts(const Json& json, const Change& change) {
  if (json.is_string()) {
    return change(json.template get_ref<const std::string&>());
  }
  if (!json.is_structured()) {
    return json;
  }
  Json result = json.is_object() ? Json::object() : Json::array();
  for (const auto& [key, value] : json.items()) {
    if (json.is_object()) {
      result[change(key)] = with_changed_texts(value, change);
    } else {
      result.push_back(with_changed_texts(value, change));
    }
  }
  return result;
}

/// The text of a JSON value whose texts and keys may be of any bytes, as paths and command lines are.
///
/// Json     of nlohmann's library
/// indent   -1: in one line
template <class Json>
std::string json_text(const Json& json, int indent = -1) {
  return with_escaped_bytes(with_changed_texts(json, bytes_in_characters).dump(indent));
}

/// Reads it back, byte for byte.
/// throws   Json::exception on what is no JSON, InputError on more than 64 levels
template <class Json>
Json json_from_text(std::string_view text) {
  return with_changed_texts(Json::parse(with_stand_ins(text)), characters_in_bytes);
}

}  // namespace touchfield
