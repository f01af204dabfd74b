// What the text after --to names.

#include "hardware/link_address.h"
#include "tests/fuzz/fuzz_support.h"

using namespace touchfield;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const fuzz::TimeLimit limit;
  LinkAddress address;
  if (fuzz::accepts([&] { address = parse_link_address(fuzz::text_of(data, size)); })) {
    fuzz::require(address.levels >= 2 && address.levels <= 256, "levels are 2 to 256");
    if (address.kind == LinkAddress::Kind::kSonicsurface) {
      fuzz::require(!address.path.empty(), "a board has a port");
    }
    if (address.kind == LinkAddress::Kind::kAutd3Udp && address.port != 0) {
      fuzz::require(!address.host.empty(), "a port has a host");
      fuzz::require(address.port >= 1 && address.port <= 65535, "a port is 1 to 65535");
    }
  }
  return 0;
}
