// Mesh files of the format TOUCHFIELD_FUZZ_FORMAT.

#include "sim/mesh/io/mesh_files.h"
#include "tests/fuzz/fuzz_support.h"

using namespace touchfield;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const fuzz::TimeLimit limit;
  const std::string path = fuzz::file_with("input." TOUCHFIELD_FUZZ_FORMAT, fuzz::text_of(data, size));
  FileSurface surface;
  if (fuzz::accepts([&] { surface = read_surface(path); })) {
    const auto count = static_cast<std::int64_t>(surface.points.size());
    for (const auto& triangle : surface.triangles) {
      for (const std::int64_t corner : triangle) {
        fuzz::require(corner >= 0 && corner < count, "a corner is a point");
      }
    }
    for (const Vector3& point : surface.points) {
      fuzz::require(point.allFinite(), "a coordinate is finite");
    }
    fuzz::accepts([&] { read_mesh(path, 1e-3); });
  }
  return 0;
}
