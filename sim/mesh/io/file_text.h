#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>

#include "sim/core/types.h"

namespace touchfield {

/// Where a text begins: behind its byte order mark of UTF-8, if it has one.
inline std::size_t after_mark(std::string_view text) { return text.starts_with("\xEF\xBB\xBF") ? 3 : 0; }

/// Goes through a text word by word; its errors name file, line and what was found. Lines end with a line feed, a
/// carriage return or both; a byte order mark before the first is passed over.
class TextCursor {
 public:
  /// text   outlives this
  TextCursor(const std::string& text, std::string name, std::size_t start = 0)
      : text_(text), name_(std::move(name)), at_(start == 0 ? after_mark(text) : start) {}
  TextCursor(const std::string&&, std::string, std::size_t = 0) = delete;

  /// The next line without its end; false at the end of the text.
  bool next_line(std::string_view& line);
  /// The next word, empty at the end of the text.
  std::string_view next_word();
  /// The next word as a number. `what` is how an error calls it.
  double number(const char* what);

  std::size_t position() const { return at_; }

  /// throws   InputError "name:line: message"; the line is that of the last word or line read
  [[noreturn]] void fail(const std::string& message) const;

 private:
  const std::string& text_;
  std::string name_;
  std::size_t at_;
  std::size_t last_ = 0;  // where the last word or line began
};

/// The first word of a line, which is shortened by it; empty at its end.
std::string_view take_word(std::string_view& line);

/// Whether a word is a number as a whole; it may be infinite or NaN.
bool to_number(std::string_view word, double& value);
bool to_integer(std::string_view word, std::int64_t& value);

/// The three finite coordinates that a line begins with.
/// throws   InputError by the cursor
Vector3 take_point(TextCursor& cursor, std::string_view line);

static_assert(std::endian::native == std::endian::little,
              "binary files are read and written as the numbers lie in memory");

/// Appends a number, or a vector's components as such numbers, as little-endian bytes.
template <class Number>
void append_bytes(std::string& bytes, Number value) {
  const auto* first = reinterpret_cast<const char*>(&value);
  bytes.append(first, sizeof value);
}

template <class Number>
void append_bytes(std::string& bytes, const Vector3& vector) {
  for (const double component : vector) {
    append_bytes(bytes, static_cast<Number>(component));
  }
}

/// The number whose bytes begin at a place.
template <class Number>
Number number_at(const char* at, bool big_endian) {
  std::array<char, sizeof(Number)> bytes;
  std::copy_n(at, bytes.size(), bytes.begin());
  if (big_endian) {
    std::reverse(bytes.begin(), bytes.end());
  }
  return std::bit_cast<Number>(bytes);
}

}  // namespace touchfield
