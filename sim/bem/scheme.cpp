#include "sim/bem/scheme.h"

namespace touchfield {

const std::vector<Scheme>& all_schemes() {
  static const std::vector<Scheme> kAll = {Scheme::kPaper, Scheme::kPaperCorrected, Scheme::kChief,
                                           Scheme::kBurtonMiller, Scheme::kBurtonMillerPolished};
  return kAll;
}

bool is_burton_miller(Scheme scheme) {
  return scheme == Scheme::kBurtonMiller || scheme == Scheme::kBurtonMillerPolished;
}

std::string to_string(Scheme scheme) {
  switch (scheme) {
    case Scheme::kPaper:
      return "paper";
    case Scheme::kPaperCorrected:
      return "paper_corrected";
    case Scheme::kChief:
      return "chief";
    case Scheme::kBurtonMiller:
      return "burton_miller";
    case Scheme::kBurtonMillerPolished:
      return "burton_miller_polished";
  }
  return {};
}

}  // namespace touchfield
