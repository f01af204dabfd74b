#pragma once

#include <string>
#include <vector>

#include "python/src/arrays.h"
#include "sim/model/model.h"

namespace touchfield::python {

/// A method of one's own: what it found.
struct OwnMethod {
  std::string name;
  Eigen::VectorXd phases;  // N [rad]
};
using OwnMethods = std::vector<OwnMethod>;

/// Of phases [rad], or of a complex drive vector at full drive.
/// throws   InputError on an amplitude that is not 1, but for rounding
OwnMethod own_method(const std::string& name, nb::handle drives, const std::string& what);

/// A model whose scene has these methods too, as ones of given phases.
/// throws   InputError on a name that is taken or cannot be one, or phases that do not fit the channels
Model with_own(const Model& model, const OwnMethods& own);

}  // namespace touchfield::python
