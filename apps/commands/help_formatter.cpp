#include "apps/commands/help_formatter.h"

#include <algorithm>
#include <sstream>

#include <fmt/format.h>

namespace touchfield {

namespace {

constexpr std::size_t kColumns = 80;
constexpr std::size_t kNames = 28;  // columns of names

/// Words in lines that begin at a column; the first one is already there.
std::string wrapped(const std::string& text, std::size_t column) {
  std::istringstream words(text);
  std::string lines;
  std::size_t at = column;
  for (std::string word; words >> word;) {
    if (at > column && at + 1 + word.size() > kColumns) {
      lines += '\n' + std::string(column, ' ');
      at = column;
    }
    lines += (at > column ? " " : "") + word;
    at += word.size() + (at > column ? 1 : 0);
  }
  return lines;
}

std::string row(const std::string& name, const std::string& text) {
  std::string line = "  " + name;
  line += line.size() + 2 > kNames ? '\n' + std::string(kNames, ' ') : std::string(kNames - line.size(), ' ');
  return line + wrapped(text, kNames) + '\n';
}

/// "ENUM:{pdf, png}" as "pdf|png".
std::string value_text(std::string type) {
  if (const std::size_t open = type.find('{'); open != std::string::npos && type.back() == '}') {
    type = type.substr(open + 1, type.size() - open - 2);
    for (std::size_t comma = 0; (comma = type.find(',')) != std::string::npos;) {
      type.replace(comma, type.find_first_not_of(", ", comma) - comma, "|");
    }
  }
  return type;
}

}  // namespace

std::string HelpFormatter::make_option(const CLI::Option* option, bool is_positional) const {
  std::string name = make_option_name(option, is_positional);
  if (!is_positional && !option->get_type_name().empty()) {
    name += ' ' + value_text(option->get_type_name());
    name += option->get_expected_min() > 1 ? fmt::format(" x {}", option->get_expected_min()) : "";
  }
  const std::string preset = option->get_default_str();
  return row(name, option->get_description() + (preset.empty() ? "" : "; default: " + preset));
}

std::string HelpFormatter::make_subcommand(const CLI::App* command) const {
  return row(command->get_name(), command->get_description());
}

std::string HelpFormatter::make_description(const CLI::App* app) const {
  std::istringstream lines(app->get_description());
  std::string text;
  for (std::string line; std::getline(lines, line);) {
    text += wrapped(line, 0) + '\n';
  }
  return text;
}

}  // namespace touchfield
