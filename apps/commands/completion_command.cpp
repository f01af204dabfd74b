#include <algorithm>
#include <memory>
#include <string_view>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "apps/commands/command_line.h"
#include "apps/commands/commands.h"
#include "apps/commands/standard_streams.h"

namespace touchfield {

namespace {

struct FileKind {
  std::string_view type;
  std::vector<std::string> endings;  // all files if there is none
};

const std::vector<FileKind>& file_kinds() {
  static const std::vector<FileKind> kinds = {{kYamlFile, {"yaml", "yml"}},
                                              {kH5File, {"h5"}},
                                              {kMeshFile, {"stl", "obj", "ply", "off", "vtp"}},
                                              {kAnyFile, {}}};
  return kinds;
}

std::vector<std::string> split(std::string_view text, char at) {
  std::vector<std::string> parts;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find(at), text.size());
    parts.emplace_back(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return parts;
}

/// The values that an option takes where they are few: those of a check, `{a, b}` or `{a->1,b->2}`, or those of a type
/// `a|b:NAME`, each up to what the user fills in.
std::vector<std::string> words_of(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  const std::size_t open = type.find('{');
  std::vector<std::string> words;
  if (open != std::string::npos) {
    for (std::string word : split(std::string_view(type).substr(open + 1, type.find('}', open) - open - 1), ',')) {
      word.erase(0, word.find_first_not_of(' '));
      words.push_back(word.substr(0, word.find("->")));
    }
  } else if (type.find('|') != std::string::npos) {
    for (const std::string& word : split(type, '|')) {
      words.push_back(word.substr(0, word.find_first_of("ABCDEFGHIJKLMNOPQRSTUVWXYZ")));
    }
  }
  return words;
}

std::vector<std::string> names_of(const CLI::Option& option) {
  std::vector<std::string> names;
  for (const std::string& name : option.get_snames()) {
    names.push_back("-" + name);
  }
  for (const std::string& name : option.get_lnames()) {
    names.push_back("--" + name);
  }
  return names;
}

std::vector<const CLI::App*> commands_below(const CLI::App& app) {
  return app.get_subcommands([](const CLI::App* command) { return !command->get_group().empty(); });
}

/// The options with names, or the one that goes by its place.
std::vector<const CLI::Option*> options_of(const CLI::App& app, bool by_place) {
  return app.get_options([&](const CLI::Option* option) { return option->get_positional() == by_place; });
}

/// `parent` and the command's name; empty of the program itself.
std::string path_of(const std::string& parent, const CLI::App& app) {
  return app.get_parent() == nullptr ? "" : parent + (parent.empty() ? "" : " ") + app.get_name();
}

std::string bash_want(const CLI::Option& option) {
  if (const std::vector<std::string> words = words_of(option); !words.empty()) {
    return fmt::format("'words:{}'", fmt::join(words, " "));
  }
  const std::string type = option.get_type_name();
  const auto kind = std::ranges::find(file_kinds(), type, &FileKind::type);
  return type == kFolder              ? "folders:"
         : kind == file_kinds().end() ? ""
                                      : fmt::format("'files:{}'", fmt::join(kind->endings, " "));
}

struct BashTables {
  std::string commands;
  std::string values;
};

void add_to(BashTables& tables, const CLI::App& app, const std::string& parent) {
  const std::string path = path_of(parent, app);
  std::vector<std::string> below;
  for (const CLI::App* command : commands_below(app)) {
    below.push_back(command->get_name());
  }
  std::vector<std::string> options;
  for (const CLI::Option* option : options_of(app, false)) {
    const std::vector<std::string> names = names_of(*option);
    options.insert(options.end(), names.begin(), names.end());
    if (option->get_items_expected_max() == 0) {
      continue;
    }
    std::vector<std::string> keys(names.size());
    std::ranges::transform(names, keys.begin(),
                           [&](const std::string& name) { return fmt::format("'{} {}'", path, name); });
    tables.values += fmt::format("    {}) left={} want={} ;;\n", fmt::join(keys, " | "),
                                 option->get_items_expected_max(), bash_want(*option));
  }
  const std::vector<const CLI::Option*> places = options_of(app, true);
  tables.commands += fmt::format("    '{}') below='{}' options='{}' place={} ;;\n", path, fmt::join(below, " "),
                                 fmt::join(options, " "), places.empty() ? "" : bash_want(*places[0]));
  for (const CLI::App* command : commands_below(app)) {
    add_to(tables, *command, path);
  }
}

constexpr std::string_view kBashTop = R"(# Completion for bash, as `touchfield completion bash` prints it.

# COMMAND: its commands and options, and what stands in its own places
_touchfield_command() {
  case $1 in
)";

constexpr std::string_view kBashValues = R"(  esac
}

# COMMAND OPTION: how many values it takes at most, and which
_touchfield_value() {
  left=0 want=
  case "$1 $2" in
)";

constexpr std::string_view kBashRest = R"(  esac
}

_touchfield() {
  local word words=() typed mark name='' command='' left=0 want='' below='' options='' place='' i
  COMPREPLY=()
  # bash takes words apart at : and = as well
  for ((i = 1; i <= COMP_CWORD; i++)); do
    word=${COMP_WORDS[i]}
    if ((${#words[@]} > 0)) && [[ $word == [:=]* || ${words[-1]} == *[:=] ]]; then
      words[-1]+=$word
    else
      words+=("$word")
    fi
  done
  typed=${words[-1]}
  unset 'words[-1]'
  _touchfield_command ''
  for word in "${words[@]}"; do
    if ((left > 0)) && [[ $word != -[[:alpha:]-]* ]]; then
      ((left--, 1))
    elif [[ $word == -* ]]; then
      _touchfield_value "$command" "$word"
    elif [[ " $below " == *" $word "* ]]; then
      command+=${command:+ }$word
      _touchfield_command "$command"
    fi
  done
  if [[ $typed == --*=* ]]; then
    name=${typed%%=*}
    typed=${typed#*=}
    _touchfield_value "$command" "$name"
  elif [[ $typed == -[[:alpha:]-]* || ($typed == - && $left == 0) ]]; then
    want=words:$options
  elif ((left == 0)); then
    want=$place
    [[ -z $below ]] || want=words:$below
  fi
  case $want in
    words:*) mapfile -t COMPREPLY < <(compgen -W "${want#*:}" -- "$typed") ;;
    folders:) mapfile -t COMPREPLY < <(compgen -d -- "$typed") ;;
    files:) mapfile -t COMPREPLY < <(compgen -f -- "$typed") ;;
    files:*)
      mapfile -t COMPREPLY < <(
        compgen -d -- "$typed"
        for word in ${want#*:}; do compgen -f -X "!*.$word" -- "$typed"; done
      )
      ;;
  esac
  [[ $want == words:* ]] || compopt -o filenames 2>/dev/null
  if ((${#COMPREPLY[@]} == 1)) && [[ ${COMPREPLY[0]} == *: ]]; then
    compopt -o nospace 2>/dev/null
  fi
  for mark in : =; do
    if [[ $typed == *$mark* && $COMP_WORDBREAKS == *$mark* ]]; then
      COMPREPLY=("${COMPREPLY[@]#"${typed%"$mark"*}$mark"}")
    fi
  done
  [[ -z $name || $COMP_WORDBREAKS == *=* ]] || COMPREPLY=("${COMPREPLY[@]/#/$name=}")
}
complete -F _touchfield touchfield
)";

std::string bash_completion(const CLI::App& app) {
  BashTables tables;
  add_to(tables, app, "");
  return fmt::format("{}{}{}{}{}", kBashTop, tables.commands, kBashValues, tables.values, kBashRest);
}

/// With a backslash before each of `marks`, and quotes as within single quotes.
std::string escaped(std::string_view text, std::string_view marks) {
  std::string result;
  for (const char c : text) {
    result += c == '\''                                 ? "'\\''"
              : marks.find(c) == std::string_view::npos ? std::string(1, c)
                                                        : fmt::format("\\{}", c);
  }
  return result;
}

/// The message and action of a value in an _arguments specification: `:what:action`.
std::string zsh_value(const CLI::Option& option) {
  std::vector<std::string> words = words_of(option);
  const std::string type = option.get_type_name();
  const auto kind = std::ranges::find(file_kinds(), type, &FileKind::type);
  std::string action = " ";
  if (!words.empty()) {
    for (std::string& word : words) {
      word = escaped(word, ":");
    }
    action = fmt::format("({})", fmt::join(words, " "));
  } else if (type == kFolder) {
    action = "_files -/";
  } else if (kind != file_kinds().end()) {
    // One ending in parentheses would be what zsh calls a qualifier.
    const std::string endings = fmt::format("{}", fmt::join(kind->endings, "|"));
    action = endings.empty()             ? "_files"
             : kind->endings.size() == 1 ? "_files -g \"*." + endings + "\""
                                         : "_files -g \"*.(" + endings + ")\"";
  }
  const std::string what = option.get_positional() ? option.get_name() : names_of(option).back();
  return fmt::format(":{}:{}", escaped(what.substr(what.find_first_not_of('-')), ":"), action);
}

std::string zsh_option(const CLI::Option& option) {
  const int most = option.get_items_expected_max();
  const bool again = option.get_multi_option_policy() == CLI::MultiOptionPolicy::TakeAll;
  constexpr int kSeveral = 10;  // more are a list without end
  const std::string value = most == 0 ? "" : zsh_value(option);
  std::string values = most > kSeveral ? ":*-*" + value : "";
  for (int i = 0; most <= kSeveral && i < most; ++i) {
    values += value;
  }
  const std::vector<std::string> names = names_of(option);
  std::string text;
  for (const std::string& name : names) {
    const std::string ending = most == 0 ? "" : name.starts_with("--") ? "=" : "+";
    const std::string others = again || names.size() == 1 ? "" : fmt::format("({})", fmt::join(names, " "));
    text += fmt::format(" \\\n    '{}{}{}[{}]{}'", again ? "*" : others, name, most == 1 ? ending : "",
                        escaped(option.get_description(), "[]\\"), values);
  }
  return text;
}

std::string zsh_functions(const CLI::App& app, const std::string& parent) {
  const std::string path = path_of(parent, app);
  std::string name = "_touchfield " + path;
  name.erase(name.find_last_not_of(' ') + 1);
  std::ranges::replace(name, ' ', '_');
  const std::vector<const CLI::App*> below = commands_below(app);
  std::string text;
  std::string list;
  std::string cases;
  for (const CLI::App* command : below) {
    text += zsh_functions(*command, path);
    list += fmt::format("\n    '{}:{}'", command->get_name(), escaped(command->get_description(), ":\\"));
    cases += fmt::format("      {}) {}_{} ;;\n", command->get_name(), name, command->get_name());
  }
  text += name + "() {\n";
  if (!below.empty()) {
    text += fmt::format("  local curcontext=$curcontext state line\n  local -a commands=({}\n  )\n", list);
  }
  text += below.empty() ? "  _arguments -s" : "  _arguments -C -s";
  for (const CLI::Option* option : options_of(app, false)) {
    text += zsh_option(*option);
  }
  for (const CLI::Option* place : options_of(app, true)) {
    text += fmt::format(" \\\n    '{}{}'", place->get_items_expected_max() > 1 ? "*" : ":", zsh_value(*place));
  }
  if (!below.empty()) {
    text += fmt::format(
        " \\\n    '1: :->command' '*:: :->rest'\n  case $state in\n    command) _describe command commands ;;\n"
        "    rest) case $line[1] in\n{}    esac ;;\n  esac",
        cases);
  }
  return text + "\n}\n\n";
}

std::string zsh_completion(const CLI::App& app) {
  return "#compdef touchfield\n# Completion for zsh, as `touchfield completion zsh` prints it.\n\n" +
         zsh_functions(app, "") +
         "if [[ $funcstack[1] == _touchfield ]]; then\n  _touchfield \"$@\"\nelse\n  compdef _touchfield "
         "touchfield\nfi\n";
}

}  // namespace

void add_completion_command(CLI::App& app, Invocation& invocation) {
  const auto shell = std::make_shared<std::string>();
  CLI::App* command = app.add_subcommand("completion", "Print what completes command lines in a shell");
  command->add_option("SHELL", *shell, "bash or zsh")->required()->check(one_of({"bash", "zsh"}));
  command->callback([shell, &app, &invocation] {
    invocation.action = [shell, &app] {
      put(*shell == "bash" ? bash_completion(app) : zsh_completion(app));
      return 0;
    };
  });
}

}  // namespace touchfield
