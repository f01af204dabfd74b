#include "solvers/phase/skin_jacobian.h"

#include <algorithm>
#include <complex>

namespace touchfield {

namespace {

using Complex = std::complex<double>;

Complex tangent(Complex phasor) { return {-phasor.imag(), phasor.real()}; }

/// column = scale [Re(conj(directions) .* (move target)); the parts of move quiet]
template <typename Real>
void fill_column(const Eigen::VectorXcd& directions, const Complex* target, const Complex* quiet, Eigen::Index rank,
                 Complex move, Real* column) {
  const Eigen::Index faces = directions.size();
  const Complex* along = directions.data();
  for (Eigen::Index j = 0; j < faces; ++j) {
    const Complex moved = move * target[j];
    column[j] = static_cast<Real>(along[j].real() * moved.real() + along[j].imag() * moved.imag());
  }
  for (Eigen::Index i = 0; i < rank; ++i) {
    const Complex moved = move * quiet[i];
    column[faces + 2 * i] = static_cast<Real>(moved.real());
    column[faces + 2 * i + 1] = static_cast<Real>(moved.imag());
  }
}

}  // namespace

SkinJacobian::SkinJacobian(const SkinProblem& problem)
    : problem_(problem), reach_(target_reach(problem)), root_weights_(problem.weights.cwiseSqrt()) {
  residual_.resize(problem.target_count() + 2 * problem.quiet.rows());
  field_.target.resize(problem.target_count());
  field_.quiet.resize(problem.quiet.rows());
}

void SkinJacobian::set(const SkinField& field, const Eigen::VectorXcd& phasors) {
  phasors_ = phasors;
  pressure_directions(problem_, reach_, field, phasors, directions_);
  const Eigen::Index faces = problem_.target_count();
  residual_.head(faces) = root_weights_.array() * (field.target.array().abs() - problem_.amplitudes.array());
  directions_.array() *= root_weights_.array();
  for (Eigen::Index i = 0; i < field.quiet.size(); ++i) {
    residual_(faces + 2 * i) = field.quiet(i).real();
    residual_(faces + 2 * i + 1) = field.quiet(i).imag();
  }
  field_.target = residual_.head(faces).array() * directions_.array();
  field_.quiet = field.quiet;
  send_back(problem_, field_, drive_gradient_);
}

void SkinJacobian::set_radial(const std::vector<Eigen::Index>& radial) { radial_ = radial; }

void SkinJacobian::apply(const Eigen::VectorXd& x, Eigen::VectorXd& y) const {
  const Eigen::Index channels = phasors_.size();
  drives_.resize(channels);
  for (Eigen::Index n = 0; n < channels; ++n) {
    drives_(n) = x(n) * tangent(phasors_(n));
  }
  for (std::size_t i = 0; i < radial_.size(); ++i) {
    drives_(radial_[i]) += x(channels + static_cast<Eigen::Index>(i)) * phasors_(radial_[i]);
  }
  send(problem_, drives_, field_);
  const Eigen::Index faces = problem_.target_count();
  y.resize(rows());
  y.head(faces) = (directions_.array().conjugate() * field_.target.array()).real();
  for (Eigen::Index i = 0; i < field_.quiet.size(); ++i) {
    y(faces + 2 * i) = field_.quiet(i).real();
    y(faces + 2 * i + 1) = field_.quiet(i).imag();
  }
}

void SkinJacobian::apply_transpose(const Eigen::VectorXd& y, Eigen::VectorXd& x) const {
  const Eigen::Index faces = problem_.target_count();
  field_.target = directions_.array() * y.head(faces).array();
  for (Eigen::Index i = 0; i < field_.quiet.size(); ++i) {
    field_.quiet(i) = {y(faces + 2 * i), y(faces + 2 * i + 1)};
  }
  send_back(problem_, field_, drives_);
  project(drives_, x);
}

void SkinJacobian::project(const Eigen::VectorXcd& x, Eigen::VectorXd& moves) const {
  const Eigen::Index channels = phasors_.size();
  moves.resize(columns());
  for (Eigen::Index n = 0; n < channels; ++n) {
    moves(n) = (std::conj(tangent(phasors_(n))) * x(n)).real();
  }
  for (std::size_t i = 0; i < radial_.size(); ++i) {
    moves(channels + static_cast<Eigen::Index>(i)) = (std::conj(phasors_(radial_[i])) * x(radial_[i])).real();
  }
}

std::pair<Eigen::Index, Complex> SkinJacobian::move_of(Eigen::Index column) const {
  if (column < phasors_.size()) {
    return {column, tangent(phasors_(column))};
  }
  const Eigen::Index n = radial_[static_cast<std::size_t>(column - phasors_.size())];
  return {n, phasors_(n)};
}

double SkinJacobian::largest_row() const {
  Eigen::VectorXd squares = Eigen::VectorXd::Zero(rows());
  Eigen::VectorXd column(rows());
  const Eigen::Index rank = problem_.quiet.rows();
  for (Eigen::Index c = 0; c < columns(); ++c) {
    const auto [n, move] = move_of(c);
    fill_column(directions_, problem_.target.col(n).data(), problem_.quiet.data() + n * rank, rank, move,
                column.data());
    squares += column.cwiseAbs2();
  }
  return squares.maxCoeff();
}

template <typename Real>
void SkinJacobian::fill(const Eigen::VectorXd& scale, Real* matrix) const {
  const Eigen::Index rank = problem_.quiet.rows();
#pragma omp parallel for schedule(static)
  for (Eigen::Index c = 0; c < columns(); ++c) {
    const auto [n, move] = move_of(c);
    fill_column(directions_, problem_.target.col(n).data(), problem_.quiet.data() + n * rank, rank, scale(c) * move,
                matrix + c * rows());
  }
}

template void SkinJacobian::fill(const Eigen::VectorXd&, float*) const;
template void SkinJacobian::fill(const Eigen::VectorXd&, double*) const;

}  // namespace touchfield
