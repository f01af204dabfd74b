// Sweeps over a small scene, and the scenes of their first cases.

#include <algorithm>
#include <cctype>

#include "sim/scene/sweep_reader.h"
#include "tests/fuzz/fuzz_support.h"

using namespace touchfield;

namespace {

/// Numbers of five digits ask for long lists of cases: slow, and no fault.
bool asks_for_many(const std::string& text) {
  std::size_t digits = 0;
  return std::ranges::any_of(text, [&](unsigned char c) {
    digits = std::isdigit(c) != 0 ? digits + 1 : 0;
    return digits >= 5;
  });
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const fuzz::TimeLimit limit;
  static const std::string base =
      fuzz::file_with("base.yaml",
                      "array: {grid: {count: [4, 3]}}\n"
                      "body: {sphere: {radius_mm: 10}, edge_mm: 3, place: {landmark: bottom, at_mm: [0, 0, 60]}}\n"
                      "target: {box: {at: bottom, size_mm: [8, 8, 6]}}\n"
                      "solve: {methods: [focus]}\n");
  const std::string text = fuzz::text_of(data, size);
  if (asks_for_many(text)) {
    return -1;
  }
  const std::string path = fuzz::file_with("sweep.yaml", text);
  fuzz::accepts([&] { is_sweep_file(path); });
  SweepPlan plan;
  if (fuzz::accepts([&] { plan = read_sweep(path, {}); })) {
    fuzz::require(!plan.cases.empty(), "a sweep has a case");
    plan.cases.resize(std::min<std::size_t>(plan.cases.size(), 3));
    for (const SweepCase& item : plan.cases) {
      fuzz::accepts([&] { read_case(plan, item); });
    }
  }
  return 0;
}
