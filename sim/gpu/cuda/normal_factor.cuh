#pragma once

#include "sim/gpu/cuda/context.cuh"

namespace touchfield::cuda {

/// Solves F y = right, F = P + mu I, for many right-hand sides one after another: by a Cholesky factor F = L L^T in
/// single or double precision and corrections by the remainder in double. With L^-1 beside L a correction is products
/// alone, where substitution would wait for each entry.
class NormalFactor {
 public:
  explicit NormalFactor(Context& context) : context_(context) {}

  /// Makes room for the next P = J J^T, given by J (rows x columns), or P itself (rows x rows) where columns is 0. What
  /// is given is to be written to exact() and, unless in_double, rounded to rounded().
  void resize(int rows, int columns, bool in_double);
  double* exact() { return exact_.data(); }
  /// Null in double.
  float* rounded();

  /// returns   false where a pivot is not positive or not finite
  bool factorise(double mu);
  /// y += F^-1 (right - F y), where only F^-1 takes the factor, to which the remainder is handed in units of `unit`.
  ///
  /// right     rows, of the host, to begin with at y = 0; null to go on
  /// found     gets y (rows) or, where P is given by J, J^T y (columns), of the host
  /// returns   the norm of the remainder that is left
  double correct(const double* right, double unit, double* found);

 private:
  template <typename Real>
  bool factorise(double mu, const Real* given);
  template <typename Real>
  void invert();
  template <typename Real>
  void add_solution(double unit, bool first);

  Context& context_;
  int rows_ = 0;
  int columns_ = 0;
  bool in_double_ = false;
  double mu_ = 0;
  Array<double> exact_{context_};
  Array<float> rounded_{context_};
  // Of float or double, as the factor is.
  Array<double> factor_{context_};   // F, then L, in the lower triangle
  Array<double> inverse_{context_};  // L^-1, zeros above
  Array<double> between_{context_}, work_{context_}, scaled_{context_}, half_{context_};
  Array<int> info_{context_, 1};
  Array<double> right_{context_}, remainder_{context_};
  Array<double> product_{context_};  // P y
  Array<double> y_{context_};        // with room for the norm behind it, as in the next
  Array<double> inner_{context_};    // J^T y
};

}  // namespace touchfield::cuda
