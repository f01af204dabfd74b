#include "sim/bem/scheme.h"

#include <algorithm>
#include <stdexcept>

namespace touchfield {

namespace {

struct Row {
  Scheme scheme;
  SchemeTraits traits;
};

constexpr Row kTable[] = {
    {Scheme::kPaper, {"paper", false, false, false, false}},
    {Scheme::kPaperCorrected, {"paper_corrected", true, false, false, false}},
    {Scheme::kChief, {"chief", true, false, true, false}},
    {Scheme::kBurtonMiller, {"burton_miller", false, true, false, false}},
    {Scheme::kBurtonMillerPolished, {"burton_miller_polished", true, true, false, true}},
};

}  // namespace

const std::vector<Scheme>& all_schemes() {
  static const std::vector<Scheme> kAll = [] {
    std::vector<Scheme> schemes;
    for (const Row& row : kTable) {
      schemes.push_back(row.scheme);
    }
    return schemes;
  }();
  return kAll;
}

const SchemeTraits& traits(Scheme scheme) {
  const auto* const row = std::ranges::find(kTable, scheme, &Row::scheme);
  if (row == std::end(kTable)) {
    throw std::logic_error("a scheme without a row in its table");
  }
  return row->traits;
}

std::string to_string(Scheme scheme) { return traits(scheme).name; }

}  // namespace touchfield
