#include <memory>

#include <fmt/format.h>

#include "apps/commands/command_line.h"
#include "apps/commands/commands.h"
#include "apps/commands/standard_streams.h"
#include "sim/scene/scene_reader.h"

namespace touchfield {

namespace {

int schema_command(const std::string& format) {
  put(format == "json" ? schema_json() : schema_markdown());
  return 0;
}

}  // namespace

void add_schema_command(CLI::App& app, Invocation& invocation) {
  const auto format = std::make_shared<std::string>("markdown");
  CLI::App* command = app.add_subcommand("schema", "Print the schema of scene files");
  command->add_option("--format", *format, "Format: markdown, or json for editors")
      ->check(one_of({"markdown", "json"}))
      ->capture_default_str();
  command->callback([format, &invocation] { invocation.action = [format] { return schema_command(*format); }; });
}

}  // namespace touchfield
