#include "apps/commands/command_line_problem.h"

#include <algorithm>
#include <filesystem>
#include <string_view>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include "sim/scene/input.h"
#include "sim/scene/schema_info.h"

namespace touchfield {

namespace {

/// The name of a command as it is typed behind the program's.
std::string path_of_command(const CLI::App& command) {
  const CLI::App* parent = command.get_parent();
  if (parent == nullptr) {
    return "";
  }
  const std::string before = path_of_command(*parent);
  return before.empty() ? command.get_name() : before + " " + command.get_name();
}

/// The last command that the line names; the program itself if it names none.
const CLI::App& named_command(const CLI::App& app) {
  const CLI::App* command = &app;
  while (!command->get_subcommands().empty()) {
    command = command->get_subcommands().front();
  }
  return *command;
}

std::vector<std::string> shown_commands(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* command : app.get_subcommands([](const CLI::App* any) { return !any->get_group().empty(); })) {
    names.push_back(command->get_name());
  }
  return names;
}

bool is_option(const std::string& word) {
  return word.size() > 1 && word[0] == '-' && word.find_first_of("0123456789.") != 1;
}

/// A long name as the words that suggestions are made of, which end in units.
std::string as_word(std::string_view name) {
  std::string word(name.substr(std::min(name.find_first_not_of('-'), name.size())));
  std::ranges::replace(word, '-', '_');
  return word;
}

/// The name of the option that a misspelt one was probably meant to be; empty if none is near.
std::string meant_option(const CLI::App& command, const std::string& typed) {
  const std::string wanted = as_word(typed);
  std::vector<std::string> words;
  std::vector<std::string> names;
  for (const CLI::Option* option : command.get_options()) {
    for (const std::string& name : option->get_lnames()) {
      words.push_back(as_word(name));
      names.push_back("--" + name);
    }
  }
  const auto begun = [&](const std::string& word) {
    return wanted.size() > 1 &&
           (word.starts_with(wanted) || schema::without_unit(word) == schema::without_unit(wanted));
  };
  auto found = std::ranges::find_if(words, begun);
  if (found == words.end()) {
    found = std::ranges::find(words, schema::nearest_word(words, wanted));
  }
  return found == words.end() ? "" : names[static_cast<std::size_t>(found - words.begin())];
}

std::string unknown_option(const CLI::App& app, const CLI::App& command, const std::string& word) {
  const std::string typed = word.substr(0, word.find('='));
  const std::string path = path_of_command(command);
  if (&command != &app && command.get_option_no_throw(typed) != nullptr) {
    return fmt::format("{} must follow the command: touchfield {} {}", typed, path, typed);
  }
  const std::string shown = schema::quoted_for_message(typed);
  const std::string meant = meant_option(command, typed);
  return meant.empty() ? fmt::format("unknown option {}; `touchfield {}{}--help` lists all options", shown, path,
                                     path.empty() ? "" : " ")
                       : fmt::format("unknown option {}; did you mean {}?", shown, meant);
}

}  // namespace

bool is_command(const CLI::App& app, const std::string& word) {
  return !app.get_subcommands([&](const CLI::App* command) { return command->get_name() == word; }).empty();
}

std::string unknown_command(const CLI::App& app, const std::string& word) {
  struct Kind {
    std::vector<std::string_view> endings;
    std::string_view what;
    std::string_view command;
  };
  static const Kind kKinds[] = {{{".yaml", ".yml"}, "to run a scene", "run"},
                                {{".h5"}, "to describe a run", "info"},
                                {{".stl", ".obj", ".ply", ".off", ".glb"}, "to inspect a mesh", "mesh"}};
  const std::string shown = schema::quoted_for_message(word);
  const std::string path = path_of_command(app);
  const std::string ending = std::filesystem::path(word).extension().string();
  for (const Kind& kind : kKinds) {
    if (path.empty() && std::ranges::find(kind.endings, ending) != kind.endings.end()) {
      return fmt::format("unknown command '{}'; {}: touchfield {} {}", shown, kind.what, kind.command, shown);
    }
  }
  const std::vector<std::string> known = shown_commands(app);
  const std::string near = schema::nearest_word(known, word);
  return near.empty() ? fmt::format("unknown command '{}'; the commands are {}", shown, fmt::join(known, ", "))
                      : fmt::format("unknown command '{}'; did you mean {}?", shown, near);
}

std::string command_line_problem(const CLI::App& app, const CLI::ParseError& error) {
  const CLI::App& command = named_command(app);
  const std::string path = path_of_command(command);
  const std::vector<std::string> rest = app.remaining(true);
  const bool mismatch = dynamic_cast<const CLI::ArgumentMismatch*>(&error) != nullptr;
  if (const auto option = std::ranges::find_if(rest, is_option); option != rest.end() && !mismatch) {
    return unknown_option(app, command, *option);
  }
  if (!rest.empty() && !mismatch && !shown_commands(command).empty()) {
    return unknown_command(command, rest.front());
  }
  return fmt::format("{}; `touchfield {}{}--help` explains it", error.what(), path, path.empty() ? "" : " ");
}

}  // namespace touchfield
