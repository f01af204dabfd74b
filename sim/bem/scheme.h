#pragma once

#include <string>
#include <vector>

namespace touchfield {

/// How the boundary integral equation is discretised. All schemes keep one pressure a face and collocate at centroids.
enum class Scheme {
  kPaper,                 // one point per face, diagonal 1/2
  kPaperCorrected,        // the same with the diagonal from the static Gauss identity
  kChief,                 // paper_corrected and points inside the body where the total field vanishes
  kBurtonMiller,          // pressure and normal derivative combined, integrals done properly
  kBurtonMillerPolished,  // burton_miller, then two fixed-point steps of paper_corrected
};

/// What a scheme is made of: a row of the table in scheme.cpp, from which everything else follows.
struct SchemeTraits {
  const char* name;      // as scenes and results spell it
  bool corrected;        // the plain diagonal is that of the static Gauss identity, else 1/2
  bool burton_miller;    // Burton and Miller's equation is solved, else the plain one
  bool interior_points;  // rows of CHIEF
  bool polished;         // fixed-point steps of the plain equation afterwards
};

/// Every scheme, the cheapest first.
const std::vector<Scheme>& all_schemes();

const SchemeTraits& traits(Scheme scheme);

/// The scheme as scenes and results spell it.
std::string to_string(Scheme scheme);

}  // namespace touchfield
