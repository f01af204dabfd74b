#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <random>
#include <stdexcept>
#include <vector>

#include "solvers/linear/blas_product.h"
#include "solvers/linear/hermitian_eigen.h"
#include "solvers/linear/random_share.h"
#include "solvers/phase/skin_field.h"
#include "solvers/phase/surface.h"

namespace touchfield {

namespace {

constexpr double kDriveTolerance = 0.01;    // on ln(epsilon): the start need not be better
constexpr double kLeastDrivePrice = 1e-10;  // epsilon over the largest eigenvalue of A A^H: above its rounding error
constexpr double kFittedPrice = 1e-6;       // the same of fitted_start
constexpr int kFittedRounds = 30;

/// The rows that matter to a drive, A = [diag(sqrt w) H_T over the faces that want sound; R], and what they want.
struct Rows {
  Eigen::MatrixXcd matrix;
  Eigen::VectorXd wanted;  // b = sqrt(w) p'
};

Rows wanting_rows(const SkinProblem& problem) {
  std::vector<Eigen::Index> faces;
  for (Eigen::Index j = 0; j < problem.target_count(); ++j) {
    if (problem.amplitudes(j) > 0) {
      faces.push_back(j);
    }
  }
  const auto count = static_cast<Eigen::Index>(faces.size());
  Rows rows{Eigen::MatrixXcd(count + problem.outside.rows(), problem.channel_count()), Eigen::VectorXd(count)};
  for (Eigen::Index i = 0; i < count; ++i) {
    const Eigen::Index j = faces[static_cast<std::size_t>(i)];
    const double root_weight = std::sqrt(problem.weights(j));
    rows.matrix.row(i) = root_weight * problem.target.row(j);
    rows.wanted(i) = root_weight * problem.amplitudes(j);
  }
  rows.matrix.bottomRows(problem.outside.rows()) = problem.outside;
  return rows;
}

/// The relaxed problem's answer where a unit of drive energy costs epsilon.
class PricedDrive {
 public:
  explicit PricedDrive(const Rows& rows)
      : rows_(rows), eigen_(hermitian_eigen(hermitian_product(rows.matrix.adjoint()))) {
    weighted_ = rows.wanted.asDiagonal() * eigen_.vectors.topRows(rows.wanted.size());
  }

  double largest_eigenvalue() const { return eigen_.values.tail(1)(0); }

  /// Eliminating q leaves  y^H diag(b) epsilon (A A^H + epsilon)^-1 diag(b) y; y is the eigenvector of its smallest
  /// eigenvalue, |y|^2 = K. Returns |q|^2.
  double solve(double epsilon) {
    const Eigen::VectorXd priced = (eigen_.values.array().max(0.0) + epsilon).inverse();
    const Eigen::MatrixXcd scaled = weighted_ * (epsilon * priced).cwiseSqrt().asDiagonal();
    const Eigen::VectorXcd y = hermitian_eigen(hermitian_product(scaled.adjoint())).vectors.col(0) *
                               std::sqrt(static_cast<double>(weighted_.rows()));
    coefficients_ = priced.asDiagonal() * (weighted_.adjoint() * y);
    return energy();
  }

  /// The same for phases y that are those of the pressures that they lead to, from y = 1. Returns |q|^2.
  double fit(double epsilon) {
    const Eigen::VectorXd values = eigen_.values.array().max(0.0);
    Eigen::VectorXcd y = Eigen::VectorXcd::Ones(weighted_.rows());
    for (int round = 0; round < kFittedRounds; ++round) {
      coefficients_ = (values.array() + epsilon).inverse().matrix().asDiagonal() * (weighted_.adjoint() * y);
      y = phasors_of(weighted_ * values.cwiseProduct(coefficients_));
    }
    return energy();
  }

  Eigen::VectorXcd drives() const { return rows_.matrix.adjoint() * (eigen_.vectors * coefficients_); }

 private:
  double energy() const { return (eigen_.values.array().max(0.0) * coefficients_.array().abs2()).sum(); }

  const Rows& rows_;
  HermitianEigen eigen_;           // of A A^H
  Eigen::MatrixXcd weighted_;      // diag(b) V_T
  Eigen::VectorXcd coefficients_;  // of (A A^H + epsilon)^-1 [b y; 0] in the eigenvectors
};

}  // namespace

Eigen::VectorXcd adjoint_start(const SkinProblem& problem) {
  require_valid(problem, "adjoint_start");
  const SkinField wanted{(problem.weights.array() * problem.amplitudes.array()).cast<std::complex<double>>(),
                         Eigen::VectorXcd::Zero(problem.outside.rows())};
  Eigen::VectorXcd drives;
  send_back(problem, wanted, drives);
  return phasors_of(drives);
}

Eigen::VectorXcd spectral_start(const SkinProblem& problem) {
  require_valid(problem, "spectral_start");
  const Rows rows = wanting_rows(problem);
  const auto channels = static_cast<double>(problem.channel_count());
  if (rows.wanted.size() == 0 || rows.matrix.isZero(0.0)) {
    return Eigen::VectorXcd::Ones(problem.channel_count());
  }
  PricedDrive priced(rows);
  double low = std::log(kLeastDrivePrice * priced.largest_eigenvalue());
  if (priced.solve(std::exp(low)) > channels) {
    // |q| <= |b y| / (2 sqrt(epsilon)): beyond this price it is below sqrt(N) for sure.
    const double energy = rows.wanted.cwiseAbs2().maxCoeff() * static_cast<double>(rows.wanted.size());
    double high = std::max(low, std::log(energy / channels));
    while (high - low > kDriveTolerance) {
      const double middle = 0.5 * (low + high);
      (priced.solve(std::exp(middle)) > channels ? low : high) = middle;
    }
    priced.solve(std::exp(high));
  }
  return phasors_of(priced.drives());
}

Eigen::VectorXcd fitted_start(const SkinProblem& problem) {
  require_valid(problem, "fitted_start");
  const Rows rows = wanting_rows(problem);
  if (rows.wanted.size() == 0 || rows.matrix.isZero(0.0)) {
    return Eigen::VectorXcd::Zero(problem.channel_count());
  }
  PricedDrive priced(rows);
  double price = kFittedPrice;
  while (priced.fit(price * priced.largest_eigenvalue()) > static_cast<double>(problem.channel_count()) && price < 1) {
    price *= 10;
  }
  const Eigen::VectorXcd drives = priced.drives();
  return drives.array() / drives.array().abs().max(1.0);
}

Eigen::VectorXcd random_start(Eigen::Index channels, unsigned seed) {
  if (channels < 0) {
    throw std::invalid_argument("random_start: the number of channels is negative");
  }
  std::mt19937_64 generator(seed);
  Eigen::VectorXcd drives(channels);
  for (std::complex<double>& drive : drives) {
    drive = std::polar(1.0, 2.0 * std::numbers::pi * random_share(generator));
  }
  return drives;
}

}  // namespace touchfield
