#pragma once

#include <functional>

#include <Eigen/Core>

namespace touchfield {

/// What a solver asks of a linear map: A X for an n x S block X of any number of columns S >= 1.
using Product = std::function<Eigen::MatrixXcd(const Eigen::MatrixXcd&)>;

}  // namespace touchfield
