#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace touchfield {

/// Length of the UTF-8 character that begins at a place of a text [bytes]; 0 if none does. Overlong forms and
/// surrogates are not characters.
std::size_t character_length(std::string_view text, std::size_t place);

/// A text as a terminal may show it. Control characters other than tab and end of line are written as in JSON, \u001b.
/// Marks that turn the direction of writing are written in the same way. So JSON stays the same JSON, and no text moves
/// the cursor.
std::string visible_text(std::string_view text);

/// The same of what is part of a line: tabs and ends of lines too.
std::string one_line(std::string_view text);

}  // namespace touchfield
