#pragma once

#include <complex>

#include <Eigen/Core>

namespace touchfield {

using Complex = std::complex<double>;
using Vector3 = Eigen::Vector3d;
/// n points or directions as columns, 3 x n.
using Points = Eigen::Matrix3Xd;

}  // namespace touchfield
