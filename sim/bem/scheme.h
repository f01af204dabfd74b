#pragma once

#include <string>
#include <vector>

namespace touchfield {

/// How the boundary integral equation is discretised. All schemes keep one pressure a face and collocate at centroids.
enum class Scheme {
  kPaper,                 // one point a face, diagonal 1/2
  kPaperCorrected,        // the same with the diagonal from the static Gauss identity
  kChief,                 // paper_corrected and points inside the body where the total field vanishes
  kBurtonMiller,          // pressure and normal derivative combined, integrals done properly
  kBurtonMillerPolished,  // burton_miller, then two fixed-point steps of paper_corrected
};

/// Every scheme, the cheapest first.
const std::vector<Scheme>& all_schemes();

/// Whether the scheme solves Burton and Miller's equation; the others solve the plain one.
bool is_burton_miller(Scheme scheme);

/// The scheme as scenes and results spell it.
std::string to_string(Scheme scheme);

}  // namespace touchfield
