// run.h5: the input is the file without its last line, which is added, or every changed byte would be refused by it.

#include "sim/store/checksum.h"
#include "sim/store/run_file.h"
#include "tests/fuzz/fuzz_support.h"

using namespace touchfield;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const fuzz::TimeLimit limit;
  const std::string bytes = fuzz::text_of(data, size);
  const std::string path = fuzz::file_with("run.h5", bytes + checksum_line(bytes));
  fuzz::accepts<Error>([&] { describe_run(read_run_file(path)); });
  return 0;
}
