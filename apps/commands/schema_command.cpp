#include <fmt/format.h>

#include "apps/commands/commands.h"
#include "apps/commands/standard_streams.h"
#include "sim/scene/scene_reader.h"

namespace touchfield {

int schema_command(const std::string& format) {
  put(format == "json" ? schema_json() : format == "template" ? template_scene() : schema_markdown());
  return 0;
}

}  // namespace touchfield
