#pragma once

#include <filesystem>
#include <sstream>
#include <string>
#include <vector>

#include "sim/core/errors.h"
#include "sim/scene/scene_reader.h"
#include "tests/support/files.h"

namespace touchfield {
inline namespace testing {

using TempFolder = TemporaryDirectory;

inline std::string text_of(const std::string& file) { return read_bytes(file); }

inline std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

/// What read_scene says about a faulty scene, a line a problem; empty if it reads.
inline std::vector<std::string> problems_of(const std::string& file, const std::vector<std::string>& overrides = {}) {
  try {
    read_scene(file, overrides);
  } catch (const InputError& error) {
    return lines_of(error.what());
  }
  return {};
}

inline Scene scene_from(const std::string& text, const std::vector<std::string>& overrides = {}) {
  const TempFolder folder;
  return read_scene(folder.write("scene.yaml", text), overrides);
}

inline std::filesystem::path source_folder() { return TOUCHFIELD_SOURCE_DIR; }

/// The least a scene must have.
inline const std::string kSmallScene =
    "name: small\n"
    "array: {grid: {}}\n"
    "body: {sphere: {radius_mm: 8}, edge_mm: 2}\n"
    "solve: {methods: [{fixed: {phases_rad: 0}}]}\n";

}  // namespace testing
}  // namespace touchfield
