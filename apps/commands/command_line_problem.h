#pragma once

#include <string>

namespace CLI {
class App;
class ParseError;
}  // namespace CLI

namespace touchfield {

/// Whether `app` has a command of this name, shown by --help or not.
bool is_command(const CLI::App& app, const std::string& word);

/// What to say of a word that stands where a command of `app` should and is none.
std::string unknown_command(const CLI::App& app, const std::string& word);

/// The error of a command line that could not be parsed, in the parser's words. An unknown command or option is named
/// with the known one that was probably meant.
std::string command_line_problem(const CLI::App& app, const CLI::ParseError& error);

}  // namespace touchfield
