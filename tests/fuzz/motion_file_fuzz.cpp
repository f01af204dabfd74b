// motion.h5: the input is the file without its last line, as for run.h5.

#include "sim/store/checksum.h"
#include "sim/store/motion_file.h"
#include "sim/store/motion_text.h"
#include "tests/fuzz/fuzz_support.h"

using namespace touchfield;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const fuzz::TimeLimit limit;
  const std::string bytes = fuzz::text_of(data, size);
  const std::string path = fuzz::file_with("motion.h5", bytes + checksum_line(bytes));
  fuzz::accepts<Error>([&] { describe_motion(read_motion_file(path)); });
  return 0;
}
