#include "sim/mesh/io/file_text.h"

#include <cmath>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/text.h"

namespace touchfield {

namespace {

constexpr std::string_view kSpace = " \t\r\n\v\f";

template <class Number>
bool convert(std::string_view word, Number& value) {
  if (word.size() > 1 && word[0] == '+' && word[1] != '-') {
    word.remove_prefix(1);
  }
  const auto number = number_of<Number>(word);
  value = number.value_or(value);
  return number.has_value();
}

}  // namespace

std::string_view take_word(std::string_view& line) {
  line.remove_prefix(std::min(line.find_first_not_of(kSpace), line.size()));
  const std::string_view word = line.substr(0, line.find_first_of(kSpace));
  line.remove_prefix(word.size());
  return word;
}

bool to_number(std::string_view word, double& value) { return convert(word, value); }
bool to_integer(std::string_view word, std::int64_t& value) { return convert(word, value); }

bool TextCursor::next_line(std::string_view& line) {
  if (at_ >= text_.size()) {
    return false;
  }
  last_ = at_;
  const std::size_t end = std::min(text_.find_first_of("\r\n", at_), text_.size());
  line = std::string_view(text_).substr(at_, end - at_);
  at_ = std::min(end + (text_.compare(end, 2, "\r\n") == 0 ? 2 : 1), text_.size());
  return true;
}

std::string_view TextCursor::next_word() {
  std::string_view rest = std::string_view(text_).substr(at_);
  const std::string_view word = take_word(rest);
  at_ = text_.size() - rest.size();
  last_ = at_ - word.size();
  return word;
}

double TextCursor::number(const char* what) {
  const std::string_view word = next_word();
  double value = 0;
  if (word.empty()) {
    fail(fmt::format("the file ends where {} is expected", what));
  }
  if (!to_number(word, value)) {
    fail(fmt::format("{} is '{}', which is not a number", what, word.substr(0, 40)));
  }
  return value;
}

void TextCursor::fail(const std::string& message) const {
  const std::string_view before = std::string_view(text_).substr(0, last_);
  std::ptrdiff_t line = 1 + std::count(before.begin(), before.end(), '\n');
  for (std::size_t at = before.find('\r'); at != std::string_view::npos; at = before.find('\r', at + 1)) {
    line += text_.compare(at, 2, "\r\n") != 0 ? 1 : 0;
  }
  throw InputError(fmt::format("{}:{}: {}", name_, line, message));
}

Vector3 take_point(TextCursor& cursor, std::string_view line) {
  Vector3 vertex;
  for (double& coordinate : vertex) {
    const std::string_view word = take_word(line);
    if (word.empty()) {
      cursor.fail("a vertex must have three coordinates");
    }
    if (!to_number(word, coordinate)) {
      cursor.fail(fmt::format("a coordinate is '{}', which is not a number", word.substr(0, 40)));
    }
    if (!std::isfinite(coordinate)) {
      cursor.fail(fmt::format("a coordinate is {}, it must be a finite number", coordinate));
    }
  }
  return vertex;
}

}  // namespace touchfield
