// Files of numbers that a scene names: positions, phases; TOUCHFIELD_FUZZ_POSITIONS says which.

#include "sim/scene/number_files.h"
#include "tests/fuzz/fuzz_support.h"

using namespace touchfield;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const fuzz::TimeLimit limit;
  const std::string path = fuzz::file_with("numbers", fuzz::text_of(data, size));
  schema::Reading reading("scene.yaml", {});
  const schema::Node named = schema::scalar(path);
  const schema::Input input(named, "file", reading);
#if TOUCHFIELD_FUZZ_POSITIONS
  const auto file = schema::read_positions(input, path);
  if (file) {
    fuzz::require(file->points.cols() > 0 && file->points.allFinite(), "positions are finite");
    fuzz::require(!file->axes || (file->axes->cols() == file->points.cols() && file->axes->allFinite()),
                  "an axis a position");
  }
#else
  const auto file = schema::read_phases(input, path);
  if (file) {
    fuzz::require(!file->empty(), "a file holds a phase");
    for (const double phase : *file) {
      fuzz::require(phase - phase == 0, "phases are finite");
    }
  }
#endif
  fuzz::require(file.has_value() != reading.failed(), "a file is read or refused");
  return 0;
}
