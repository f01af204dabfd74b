#pragma once

#include <cstddef>
#include <string_view>

namespace touchfield {

/// The bytes before the first one that is not text [bytes]; the size of the text if there is none. Text is UTF-8
/// without control characters other than tab and ends of lines, which are a line feed or a carriage return before one.
std::size_t length_of_text(std::string_view bytes);

/// name     what messages call the text
/// throws   InputError "name:line:column: byte 0xff is not UTF-8 text, ..."; the column counts bytes from 1
void require_text(std::string_view bytes, std::string_view name);

}  // namespace touchfield
