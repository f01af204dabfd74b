#pragma once

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "sim/core/errors.h"
#include "sim/scene/scene_reader.h"

namespace touchfield::testing {

/// A folder of its own for a test, gone afterwards.
class TempFolder {
 public:
  TempFolder() {
    std::string pattern = (std::filesystem::temp_directory_path() / "touchfield-scene-XXXXXX").string();
    if (mkdtemp(pattern.data()) == nullptr) throw std::runtime_error("no temporary folder");
    path_ = pattern;
  }
  TempFolder(const TempFolder&) = delete;
  TempFolder& operator=(const TempFolder&) = delete;
  ~TempFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }

  const std::filesystem::path& path() const { return path_; }

  std::string write(const std::string& name, const std::string& text) const {
    const auto file = path_ / name;
    std::ofstream(file, std::ios::binary) << text;
    return file.string();
  }

 private:
  std::filesystem::path path_;
};

inline std::string text_of(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

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

}  // namespace touchfield::testing
