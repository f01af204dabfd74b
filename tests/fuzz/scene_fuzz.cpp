// Scenes: what is read can be written out and read back to the same.

#include <filesystem>

#include "sim/scene/scene_reader.h"
#include "tests/fuzz/fuzz_support.h"

using namespace touchfield;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const fuzz::TimeLimit limit;
  static const std::string folder = [] {
    fuzz::file_with("phases.txt", "0 1.5\n");
    return std::filesystem::path(fuzz::file_with("positions.csv", "0,0,0\n10,0,0\n")).parent_path().string();
  }();
  std::string resolved;
  if (fuzz::accepts(
          [&] { resolved = resolved_yaml(read_scene_text(fuzz::text_of(data, size), "scene.yaml", folder)); })) {
    const std::string again = resolved_yaml(read_scene_text(resolved, "resolved.yaml", folder));
    fuzz::require(again == resolved, "a resolved scene reads as itself");
  }
  return 0;
}
