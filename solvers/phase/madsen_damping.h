#pragma once

#include <algorithm>
#include <cmath>

namespace touchfield {

/// Madsen's damping of Levenberg-Marquardt: an accepted step multiplies mu by max(1/3, 1 - (2 gain - 1)^3) and sets
/// nu = 2; a rejected one multiplies mu by nu and doubles nu.
///
/// source   Madsen, Nielsen, Tingleff, Methods for Non-Linear Least Squares Problems, 2004, ch. 3.2
class MadsenDamping {
 public:
  /// first   mu_0; 1 in its place where it is not > 0
  explicit MadsenDamping(double first) : mu_(first > 0 ? first : 1.0), largest_(1e30 * mu_) {}

  double value() const { return mu_; }

  /// gain   fall of the cost over the fall that the linear model predicted, > 0
  void accept(double gain) {
    mu_ *= std::max(1.0 / 3.0, 1.0 - std::pow(2.0 * gain - 1.0, 3));
    nu_ = 2.0;
  }

  void reject() {
    mu_ *= nu_;
    nu_ *= 2.0;
  }

  /// Beyond 1e30 times the first value: no step helps.
  bool exhausted() const { return !(mu_ < largest_); }

 private:
  double mu_;
  double largest_;
  double nu_ = 2.0;
};

}  // namespace touchfield
