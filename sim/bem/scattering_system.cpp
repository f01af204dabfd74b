#include "sim/bem/scattering_system.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include "sim/acoustics/incident_field.h"
#include "sim/bem/operators.h"
#include "sim/core/errors.h"
#include "solvers/linear/dense_lu.h"

namespace touchfield {

namespace {

class DenseLuSolver : public ScatteringSolver {
 public:
  explicit DenseLuSolver(Eigen::MatrixXcd matrix) : lu_(std::move(matrix)) {}

  Eigen::MatrixXcd solve(const Eigen::MatrixXcd& b) const override { return lu_.solve(b); }
  Eigen::MatrixXcd solve_transpose(const Eigen::MatrixXcd& b) const override { return lu_.solve_transpose(b); }
  double reciprocal_condition() const override { return lu_.reciprocal_condition(); }
  std::string description() const override { return "LU, double"; }

 private:
  DenseLu lu_;
};

}  // namespace

ScatteringSystem::ScatteringSystem(TriangleMesh mesh, const Wave& wave, Scheme scheme)
    : mesh_(std::move(mesh)), wave_(wave), scheme_(scheme), reference_(std::make_unique<PaperOperator>(mesh_, wave_)) {}

Eigen::MatrixXcd ScatteringSystem::right_hand_sides(const TransducerArray& array) const {
  return incident_matrix(array, wave_, mesh_.centroids());
}

Eigen::MatrixXcd ScatteringSystem::matrix() const { return paper_matrix(mesh_, wave_); }

Eigen::MatrixXcd ScatteringSystem::columns(const std::vector<Eigen::Index>& faces) const {
  return paper_columns(mesh_, wave_, faces);
}

std::unique_ptr<ScatteringSolver> factorise_dense(const ScatteringSystem& system) {
  try {
    return std::make_unique<DenseLuSolver>(system.matrix());
  } catch (const std::domain_error& error) {
    throw NumericalError(
        fmt::format("scattering by {} faces, scheme {}: {}", system.size(), to_string(system.scheme()), error.what()));
  }
}

double relative_residual(const ScatteringSystem& system, const Eigen::MatrixXcd& p, const Eigen::MatrixXcd& b) {
  const Eigen::MatrixXcd residual = system.reference_operator().apply(p) - b;
  double worst = 0.0;
  for (Eigen::Index s = 0; s < b.cols(); ++s) {
    worst = std::max(worst, residual.col(s).norm() / b.col(s).norm());
  }
  return worst;
}

}  // namespace touchfield
