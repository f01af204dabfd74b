#pragma once

#include <string>

namespace touchfield {

/// How the boundary integral equation is discretised.
enum class Scheme {
  kPaper,  // pressure and grad g constant on each flat face, collocation at centroids
};

/// The scheme as scenes and results spell it.
std::string to_string(Scheme scheme);

}  // namespace touchfield
