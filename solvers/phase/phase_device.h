#pragma once

#include <complex>
#include <cstddef>
#include <memory>

namespace touchfield {

/// The seam to a device, a graphics card, that multiplies and factorises for the phase methods what has as many entries
/// as the problem's matrices. The methods themselves, and all vectors, stay with the processor. Matrices lie column by
/// column without gaps. An object is for one thread at a time. What a device cannot do it says by an exception of its
/// own; nothing then counts but the destructor.

/// Where a SkinProblem is linearised, see SkinJacobian.
struct SkinMoves {
  const std::complex<double>* directions;  // sqrt(w_j) u_j / |u_j|, K
  const std::complex<double>* phasors;     // N
  const std::ptrdiff_t* radial;            // the channels whose amplitude may move, each once
  int radial_count;
  int outside_rows;  // of R, from the first on, that are rows of J
};

/// H_T (K x N) and R (r x N) of a SkinProblem.
class SkinDevice {
 public:
  using Complex = std::complex<double>;

  SkinDevice() = default;
  SkinDevice(const SkinDevice&) = delete;
  SkinDevice& operator=(const SkinDevice&) = delete;
  virtual ~SkinDevice() = default;

  /// sum_n |a_in|, finite only if all of the row is, and sum_n |a_in|^2 of the rows of [H_T; R], K + r.
  virtual const double* reach() const = 0;
  virtual const double* strengths() const = 0;

  /// sent = the first `rows` rows of [H_T; R] q.
  virtual void send(const Complex* q, int rows, Complex* sent) = 0;
  /// x = A'^H v (N), A' the rows of [H_T; R] from `first` on, `rows` > 0 of them.
  virtual void send_back(const Complex* v, int first, int rows, Complex* x) = 0;

  /// The greatest diagonal entry of J J^T, from all rows.
  virtual double largest_row(const SkinMoves& moves) = 0;

  /// The Cholesky factor of L L^T + I with L = J diag(scale), also where J has more rows than columns.
  ///
  /// scale       a value for each column of J
  /// in_double   else in single precision
  /// returns     false where a pivot is not positive
  virtual bool factorise(const SkinMoves& moves, const double* scale, bool in_double) = 0;
  /// A correction by the last factor F of a y that begins at 0: y += F^-1 (right - (L L^T + I) y). The remainder is
  /// formed in double by L itself. Only its solution is by the factor, to which it is handed in units of `unit`.
  /// Between factorise and the last of its corrections only send and send_back may be called.
  ///
  /// right     a value for each row of J to begin with; null to continue
  /// inner     gets L^T y, a value for each column of J
  /// returns   the norm of the remainder that is left
  virtual double correct(const double* right, double unit, double* inner) = 0;

  /// Keeps A = diag(scale) [H_T; R] in single precision for the next two, until it is called again.
  virtual void scale_single(const double* scale) = 0;
  /// sent = A Y, Y N x width.
  virtual void send_single(int width, const std::complex<float>* y, std::complex<float>* sent) = 0;
  /// back = A^H V, V (K + r) x width.
  virtual void send_back_single(int width, const std::complex<float>* v, std::complex<float>* back) = 0;
};

/// The Gram matrix Q (n x n, Hermitian, n >= 1) of an IncidentProblem.
class GramDevice {
 public:
  using Complex = std::complex<double>;

  GramDevice() = default;
  GramDevice(const GramDevice&) = delete;
  GramDevice& operator=(const GramDevice&) = delete;
  virtual ~GramDevice() = default;

  virtual int size() const = 0;
  virtual bool finite() const = 0;
  virtual double largest_diagonal() const = 0;

  /// product = Q z, sums in double.
  virtual void multiply(const Complex* z, Complex* product) = 0;

  /// The Cholesky factor of M = Re(diag(conj z) Q diag(z)) + mu I.
  ///
  /// returns   false where a pivot is not positive
  virtual bool factorise(const Complex* z, double mu, bool in_double) = 0;
  /// h += F^-1 (right - M h) by the last factor F, from h = 0; the remainder in double, handed to the factor in units
  /// of `unit`.
  ///
  /// right     to begin with; null to continue
  /// returns   the norm of the remainder that is left
  virtual double correct(const double* right, double unit, double* h) = 0;
};

/// Brings matrices to a device.
class PhaseDevice {
 public:
  PhaseDevice() = default;
  PhaseDevice(const PhaseDevice&) = delete;
  PhaseDevice& operator=(const PhaseDevice&) = delete;
  virtual ~PhaseDevice() = default;

  virtual std::unique_ptr<SkinDevice> skin(const std::complex<double>* target, int faces,
                                           const std::complex<double>* outside, int rank, int channels) = 0;
};

}  // namespace touchfield
