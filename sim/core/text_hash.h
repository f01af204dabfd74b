#pragma once

#include <string>
#include <string_view>

namespace touchfield {

/// FNV-1a, 64 bit, as "fnv1a64:" and 16 hexadecimal digits: tells texts apart, guards against nothing.
std::string text_hash(std::string_view text);

}  // namespace touchfield
