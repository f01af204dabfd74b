#pragma once

#include <string>
#include <utility>
#include <vector>

#include "sim/solve/model.h"

namespace touchfield::python {

/// Names of methods of one's own and their phases, N [rad].
using OwnMethods = std::vector<std::pair<std::string, Eigen::VectorXd>>;

/// A model whose scene has these methods too, as ones of given phases.
/// throws   InputError on a name that is taken or cannot be one, or phases that do not fit the channels
Model with_own(const Model& model, const OwnMethods& own);

}  // namespace touchfield::python
