#include "solvers/phase/skin_jacobian.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <type_traits>

#include <cblas.h>
#include <omp.h>

#include "solvers/linear/blas_product.h"
#include "solvers/linear/factorisations.h"
#include "solvers/phase/phase_solution.h"

namespace touchfield {

namespace {

using Complex = std::complex<double>;

constexpr Eigen::Index kBlock = 16;  // columns: a block of 500 rows stays in a core's cache for its second use

constexpr double kLeastLoudness = 0.25;  // of what is wanted

Complex tangent(Complex phasor) { return {-phasor.imag(), phasor.real()}; }

/// Complex numbers as their parts, one after another: Re t_1, Im t_1, Re t_2, ...
Eigen::Map<const Eigen::VectorXd> parts(const Eigen::VectorXcd& t) {
  return {reinterpret_cast<const double*>(t.data()), 2 * t.size()};
}
Eigen::Map<Eigen::VectorXd> parts(Eigen::VectorXcd& t) { return {reinterpret_cast<double*>(t.data()), 2 * t.size()}; }

/// column = scale [Re(conj(directions) .* (move target_n)); the first rank parts of move outside_n]
template <typename Real>
void fill_column(const Eigen::VectorXcd& directions, const SkinProblem& problem, Eigen::Index n, Eigen::Index rank,
                 Complex move, Real* column) {
  const Eigen::Index faces = directions.size();
  const Complex* target = problem.target.data() + n * faces;
  const Complex* outside = problem.outside.data() + n * problem.outside.rows();
  const Complex* along = directions.data();
  for (Eigen::Index j = 0; j < faces; ++j) {
    const Complex moved = move * target[j];
    column[j] = static_cast<Real>(along[j].real() * moved.real() + along[j].imag() * moved.imag());
  }
  for (Eigen::Index i = 0; i < rank; ++i) {
    const Complex moved = move * outside[i];
    column[faces + 2 * i] = static_cast<Real>(moved.real());
    column[faces + 2 * i + 1] = static_cast<Real>(moved.imag());
  }
}

/// Whether R R^H = diag(strengths) with each row as its own unit, by one product of either side with a vector whose
/// entries have length one and angles without a pattern: off the diagonal nothing can hide from all of it by chance.
bool has_orthogonal_rows(const SkinProblem& problem, const Eigen::VectorXd& strengths) {
  constexpr double kRounding = 1e-6;            // of rows down to 1e-5 of the strongest
  constexpr double kAngle = 2.399963229728653;  // the golden one
  if (strengths.size() == 0 || !(strengths.minCoeff() > 0)) {
    return false;
  }
  Eigen::VectorXcd x(strengths.size());
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    const auto place = static_cast<double>(i);
    x(i) = std::polar(1.0, kAngle * place * place);
  }
  const Eigen::VectorXd lengths = strengths.cwiseSqrt();
  Eigen::VectorXcd sent;
  send_back_last(problem, x.cwiseQuotient(lengths.cast<Complex>()), sent);
  SkinField back;
  send(problem, sent, back);
  return (back.outside.cwiseQuotient(lengths.cast<Complex>()) - x).norm() < kRounding * x.norm();
}

constexpr double kAccuracy = 1e-8;  // what the number of threads changes in single precision stays below it
constexpr double kSlowest = 0.2;    // a correction that leaves more of the residual is not worth its two products
constexpr int kCorrections = 12;    // at that rate these reach 4e-9

constexpr auto rank_update(float /*precision*/) { return cblas_ssyrk; }
constexpr auto rank_update(double /*precision*/) { return cblas_dsyrk; }

/// Grows but never shrinks, so that a changing number of columns allocates only at its peak.
template <typename Real>
void reserve(std::vector<Real>& buffer, Eigen::Index size) {
  buffer.resize(std::max(buffer.size(), static_cast<std::size_t>(size)));
}

}  // namespace

SkinJacobian::SkinJacobian(const SkinProblem& problem)
    : problem_(problem),
      strengths_(outside_strengths(problem)),
      orthogonal_(has_orthogonal_rows(problem, strengths_)),
      kept_(problem.outside.rows()),
      reach_(target_reach(problem)),
      root_weights_(problem.weights.cwiseSqrt()) {
  residual_.resize(problem.target_count() + 2 * problem.outside.rows());
  field_.target.resize(problem.target_count());
  field_.outside.resize(problem.outside.rows());
}

void SkinJacobian::set(const SkinField& field, const Eigen::VectorXcd& phasors) {
  phasors_ = phasors;
  radial_column_.resize(static_cast<std::size_t>(phasors.size()), -1);
  pressure_directions(problem_, reach_, field, phasors, directions_);
  const Eigen::Index faces = problem_.target_count();
  residual_.head(faces) = root_weights_.array() * (field.target.array().abs() - problem_.amplitudes.array());
  directions_.array() *= root_weights_.array();
  residual_.tail(2 * field.outside.size()) = parts(field.outside);
  field_.target = residual_.head(faces).array() * directions_.array();
  field_.outside = field.outside;
  send_back(problem_, field_, drive_gradient_);
}

Eigen::VectorXcd skin_gradient(const SkinProblem& problem, const Eigen::VectorXcd& q) {
  SkinField field;
  send(problem, q, field);
  Eigen::VectorXcd directions;
  pressure_directions(problem, target_reach(problem), field, phasors_of(q), directions);
  field.target =
      2.0 * problem.weights.array() * (field.target.array().abs() - problem.amplitudes.array()) * directions.array();
  field.outside *= 2.0;
  Eigen::VectorXcd gradient;
  send_back(problem, field, gradient);
  return gradient;
}

void SkinJacobian::leave_out_up_to(double most) {
  kept_ = strengths_.size();
  double lacking = 0.0;
  while (kept_ > 0) {
    const double strength = strengths_(kept_ - 1);
    lacking = orthogonal_ ? std::max(lacking, strength) : lacking + strength;
    if (!(lacking < most)) {
      break;
    }
    --kept_;
  }
}

void SkinJacobian::set_radial(const std::vector<Eigen::Index>& radial) {
  radial_ = radial;
  radial_column_.assign(static_cast<std::size_t>(phasors_.size()), -1);
  for (std::size_t i = 0; i < radial_.size(); ++i) {
    radial_column_[static_cast<std::size_t>(radial_[i])] = phasors_.size() + static_cast<Eigen::Index>(i);
  }
}

/// The rows of a field.
void SkinJacobian::gather(const SkinField& field, Eigen::VectorXd& y) const {
  const Eigen::Index faces = problem_.target_count();
  y.resize(rows());
  y.head(faces) = (directions_.array().conjugate() * field.target.array()).real();
  y.tail(2 * field.outside.size()) = parts(field.outside);
}

/// Its adjoint.
void SkinJacobian::spread(const Eigen::VectorXd& y, SkinField& field) const {
  const Eigen::Index faces = problem_.target_count();
  field.outside.resize(kept_);
  field.target = directions_.array() * y.head(faces).array();
  parts(field.outside) = y.tail(2 * kept_);
}

void SkinJacobian::apply(const Eigen::VectorXd& x, Eigen::VectorXd& y) const {
  const Eigen::Index channels = phasors_.size();
  drives_.resize(channels);
  for (Eigen::Index n = 0; n < channels; ++n) {
    drives_(n) = x(n) * tangent(phasors_(n));
  }
  for (std::size_t i = 0; i < radial_.size(); ++i) {
    drives_(radial_[i]) += x(channels + static_cast<Eigen::Index>(i)) * phasors_(radial_[i]);
  }
  send(problem_, drives_, kept_, field_);
  gather(field_, y);
}

void SkinJacobian::second_derivative(const Eigen::VectorXd& amplitudes, const Eigen::VectorXd& turns,
                                     Eigen::VectorXd& y) const {
  const Eigen::Index faces = problem_.target_count();
  drives_ = amplitudes.array() * turns.array() * phasors_.array() * Complex(0.0, 1.0);
  send(problem_, drives_, 0, field_);
  const Eigen::VectorXd across = (directions_.array().conjugate() * field_.target.array()).imag();
  drives_ = drives_.array() * turns.array() * Complex(0.0, 1.0);
  send(problem_, drives_, kept_, field_);
  gather(field_, y);
  for (Eigen::Index j = 0; j < faces; ++j) {
    const double wanted = root_weights_(j) * problem_.amplitudes(j);
    const double loudness = std::max(residual_(j) + wanted, kLeastLoudness * wanted);
    y(j) += loudness > 0 ? across(j) * across(j) / loudness : 0.0;
  }
}

void SkinJacobian::apply_transpose(const Eigen::VectorXd& y, Eigen::VectorXd& x) const {
  spread(y, field_);
  send_back(problem_, field_, drives_);
  project(drives_, x);
}

void SkinJacobian::apply_gram(const Eigen::VectorXd& scale, const Eigen::VectorXd& y, Eigen::VectorXd& inner,
                              Eigen::VectorXd& outer) const {
  const Eigen::Index channels = phasors_.size();
  inner.resize(columns());
  drives_.resize(channels);
  spread(y, field_);
  shares_.resize(static_cast<std::size_t>(omp_get_max_threads()));
  for (SkinField& share : shares_) {
    share.target.setZero(field_.target.size());
    share.outside.setZero(kept_);
  }
#pragma omp parallel
  {
    SkinField& share = shares_[static_cast<std::size_t>(omp_get_thread_num())];
#pragma omp for schedule(static)
    for (Eigen::Index at = 0; at < channels; at += kBlock) {
      const Eigen::Index width = std::min(kBlock, channels - at);
      const auto target = problem_.target.middleCols(at, width);
      const auto outside = problem_.outside.block(0, at, kept_, width);
      auto block = drives_.segment(at, width);
      multiply(Op::kAdjoint, target, field_.target, 0.0, block);
      if (kept_ > 0) {
        multiply(Op::kAdjoint, outside, field_.outside, 1.0, block);
      }
      for (Eigen::Index n = at; n < at + width; ++n) {
        const Complex pull = std::conj(phasors_(n)) * drives_(n);  // in the channel's frame
        inner(n) = scale(n) * pull.imag();
        Complex move(0.0, scale(n) * inner(n));
        if (const Eigen::Index radial = radial_column_[static_cast<std::size_t>(n)]; radial >= 0) {
          inner(radial) = scale(radial) * pull.real();
          move += scale(radial) * inner(radial);
        }
        drives_(n) = move * phasors_(n);
      }
      multiply(Op::kPlain, target, block, 1.0, share.target);
      if (kept_ > 0) {
        multiply(Op::kPlain, outside, block, 1.0, share.outside);
      }
    }
  }
  for (std::size_t i = 1; i < shares_.size(); ++i) {
    shares_.front().target += shares_[i].target;
    shares_.front().outside += shares_[i].outside;
  }
  gather(shares_.front(), outer);
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

bool SkinJacobian::gradient_left_out(Eigen::VectorXd& gradient) const {
  const Eigen::Index weak = problem_.outside.rows() - kept_;
  if (weak == 0) {
    return false;
  }
  Eigen::VectorXcd left(weak);
  parts(left) = residual_.tail(2 * weak);
  send_back_last(problem_, left, drives_);
  project(drives_, gradient);
  return true;
}

SkinMoves SkinJacobian::moves() const {
  return {directions_.data(), phasors_.data(), radial_.data(), static_cast<int>(radial_.size()),
          static_cast<int>(kept_)};
}

double SkinJacobian::largest_row() const {
  if (device() != nullptr) {
    return device()->largest_row(moves());
  }
  const Eigen::Index rank = problem_.outside.rows();
  Eigen::VectorXd squares = Eigen::VectorXd::Zero(residual_.size());
  Eigen::VectorXd column(residual_.size());
  for (Eigen::Index c = 0; c < columns(); ++c) {
    const auto [n, move] = move_of(c);
    fill_column(directions_, problem_, n, rank, move, column.data());
    squares += column.cwiseAbs2();
  }
  return squares.maxCoeff();
}

template <typename Real>
void SkinJacobian::fill(const Eigen::VectorXd& scale, Real* matrix) const {
#pragma omp parallel for schedule(static)
  for (Eigen::Index c = 0; c < columns(); ++c) {
    const auto [n, move] = move_of(c);
    fill_column(directions_, problem_, n, kept_, scale(c) * move, matrix + c * rows());
  }
}

template void SkinJacobian::fill(const Eigen::VectorXd&, float*) const;
template void SkinJacobian::fill(const Eigen::VectorXd&, double*) const;

bool DampedStep::solve(const SkinJacobian& jacobian, const Eigen::VectorXd& d, Eigen::VectorXd& h) {
  scale_ = d.array().rsqrt();
  prepare(jacobian);
  in_double_ = false;
  if (factorise(jacobian, single_) && refine(jacobian, single_, h)) {
    return true;
  }
  ++double_count_;
  in_double_ = true;
  return factorise(jacobian, double_) && refine(jacobian, double_, h);
}

bool DampedStep::solve_again(const SkinJacobian& jacobian, const Eigen::VectorXd& y, Eigen::VectorXd& h) {
  apart_.resize(0);
  if (by_rows_) {
    right_ = y;
  } else {
    jacobian.apply_transpose(y, right_);
    right_.array() *= scale_.array();
  }
  return in_double_ ? refine(jacobian, double_, h) : refine(jacobian, single_, h);
}

/// Chooses the side and sets the right-hand side.
void DampedStep::prepare(const SkinJacobian& jacobian) {
  by_rows_ = jacobian.device() != nullptr || jacobian.rows() <= jacobian.columns();
  apart_.resize(0);
  if (!by_rows_) {
    jacobian.gradient(right_);
    right_.array() *= scale_.array();
    return;
  }
  right_ = jacobian.residual();
  if (jacobian.gradient_left_out(apart_)) {
    apart_.array() *= scale_.array().square();
    jacobian.apply(apart_, outer_);
    right_ -= outer_;
  }
}

template <typename Real>
bool DampedStep::factorise(const SkinJacobian& jacobian, Factor<Real>& factor) {
  if (jacobian.device() != nullptr) {
    return jacobian.device()->factorise(jacobian.moves(), scale_.data(), std::is_same_v<Real, double>);
  }
  const int rows = static_cast<int>(jacobian.rows());
  const int columns = static_cast<int>(jacobian.columns());
  const int size = std::min(rows, columns);
  reserve(factor.scaled, jacobian.rows() * jacobian.columns());
  reserve(factor.matrix, Eigen::Index{size} * size);
  reserve(factor.right, size);
  jacobian.fill(scale_, factor.scaled.data());
  const Real one = 1;
  const Real zero = 0;
  rank_update(Real{})(CblasColMajor, CblasLower, by_rows_ ? CblasNoTrans : CblasTrans, size, std::max(rows, columns),
                      one, factor.scaled.data(), rows, zero, factor.matrix.data(), size);
  for (std::size_t i = 0; i < static_cast<std::size_t>(size); ++i) {
    factor.matrix[i * static_cast<std::size_t>(size + 1)] += one;
  }
  return cholesky_factorise(size, factor.matrix.data());
}

template <typename Real>
bool DampedStep::refine(const SkinJacobian& jacobian, Factor<Real>& factor, Eigen::VectorXd& h) {
  SkinDevice* device = jacobian.device();
  double before = right_.norm();
  const double target = kAccuracy * before;
  if (device == nullptr) {
    remainder_ = right_;
    solution_ = Eigen::VectorXd::Zero(right_.size());
  }
  inner_.resize(jacobian.columns());
  for (int correction = 0; correction < kCorrections; ++correction) {
    // Normalised, so that single precision holds a right-hand side of any unit.
    const double unit = before > 0 ? before : 1.0;
    const double after = device != nullptr
                             ? device->correct(correction == 0 ? right_.data() : nullptr, unit, inner_.data())
                             : correct(jacobian, factor, unit);
    if (after <= target) {
      h = -scale_.array() * (by_rows_ ? inner_ : solution_).array();
      if (by_rows_ && apart_.size() > 0) {
        h -= apart_;
      }
      return true;
    }
    if (!(after <= kSlowest * before)) {
      return false;
    }
    before = after;
  }
  return false;
}

/// As SkinDevice::correct says.
template <typename Real>
double DampedStep::correct(const SkinJacobian& jacobian, Factor<Real>& factor, double unit) {
  const int size = static_cast<int>(right_.size());
  for (int i = 0; i < size; ++i) {
    factor.right[static_cast<std::size_t>(i)] = static_cast<Real>(remainder_(i) / unit);
  }
  cholesky_solve(size, factor.matrix.data(), factor.right.data());
  for (int i = 0; i < size; ++i) {
    solution_(i) += unit * static_cast<double>(factor.right[static_cast<std::size_t>(i)]);
  }
  apply(jacobian, solution_);
  remainder_ = right_ - solution_ - outer_;
  return remainder_.norm();
}

/// inner = S J^T y and outer = J S inner by rows; inner = J S y and outer = S J^T inner by columns.
void DampedStep::apply(const SkinJacobian& jacobian, const Eigen::VectorXd& y) {
  if (by_rows_) {
    jacobian.apply_gram(scale_, y, inner_, outer_);
  } else {
    scaled_ = scale_.array() * y.array();
    jacobian.apply(scaled_, inner_);
    jacobian.apply_transpose(inner_, outer_);
    outer_.array() *= scale_.array();
  }
}

}  // namespace touchfield
