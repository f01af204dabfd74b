#pragma once

#include <algorithm>
#include <memory>

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include "solvers/phase/phase_device.h"

namespace touchfield {

/// What stands behind the seam of phase_device.h by its definitions, with dense matrices of the processor: to test the
/// seam, and cards against.
class FakeSkinDevice final : public SkinDevice {
 public:
  FakeSkinDevice(const Complex* target, int faces, const Complex* outside, int rank, int channels)
      : faces_(faces), rows_(faces + rank, channels) {
    rows_.topRows(faces) = Eigen::Map<const Eigen::MatrixXcd>(target, faces, channels);
    rows_.bottomRows(rank) = Eigen::Map<const Eigen::MatrixXcd>(outside, rank, channels);
    reach_ = rows_.cwiseAbs().rowwise().sum();
    strengths_ = rows_.rowwise().squaredNorm();
  }

  const double* reach() const override { return reach_.data(); }
  const double* strengths() const override { return strengths_.data(); }

  void send(const Complex* q, int rows, Complex* sent_to) override {
    ++sent;
    Eigen::Map<Eigen::VectorXcd>(sent_to, rows) =
        rows_.topRows(rows) * Eigen::Map<const Eigen::VectorXcd>(q, rows_.cols());
  }
  void send_back(const Complex* v, int first, int rows, Complex* x) override {
    ++sent_back;
    Eigen::Map<Eigen::VectorXcd>(x, rows_.cols()) =
        rows_.middleRows(first, rows).adjoint() * Eigen::Map<const Eigen::VectorXcd>(v, rows);
  }

  double largest_row(const SkinMoves& moves) override {
    SkinMoves all = moves;
    all.outside_rows = static_cast<int>(rows_.rows()) - faces_;
    return jacobian(all).rowwise().squaredNorm().maxCoeff();
  }

  bool factorise(const SkinMoves& moves, const double* scale, bool as_double) override {
    scaled_ = jacobian(moves);
    scaled_ *= Eigen::Map<const Eigen::VectorXd>(scale, scaled_.cols()).asDiagonal();
    matrix_ = scaled_ * scaled_.transpose();
    matrix_.diagonal().array() += 1.0;
    rounded_ = !as_double;
    (as_double ? in_double : in_single) += 1;
    factor_.compute(rounded_ ? matrix_.cast<float>().cast<double>() : matrix_);
    return factor_.info() == Eigen::Success && matrix_.allFinite();
  }
  double correct(const double* right, double unit, double* inner) override {
    if (right != nullptr) {
      right_ = Eigen::Map<const Eigen::VectorXd>(right, matrix_.rows());
      y_ = Eigen::VectorXd::Zero(matrix_.rows());
    }
    const Eigen::VectorXd remainder = (right_ - matrix_ * y_) / unit;
    const Eigen::VectorXd change = factor_.solve(remainder);
    y_ += unit * (rounded_ ? change.cast<float>().cast<double>() : change);
    Eigen::Map<Eigen::VectorXd>(inner, scaled_.cols()) = scaled_.transpose() * y_;
    return (right_ - matrix_ * y_).norm();
  }

  void scale_single(const double* scale) override {
    single_ = (Eigen::Map<const Eigen::VectorXd>(scale, rows_.rows()).asDiagonal() * rows_).cast<std::complex<float>>();
  }
  void send_single(int width, const std::complex<float>* y, std::complex<float>* sent_to) override {
    Eigen::Map<Eigen::MatrixXcf>(sent_to, rows_.rows(), width) =
        single_ * Eigen::Map<const Eigen::MatrixXcf>(y, rows_.cols(), width);
  }
  void send_back_single(int width, const std::complex<float>* v, std::complex<float>* back) override {
    Eigen::Map<Eigen::MatrixXcf>(back, rows_.cols(), width) =
        single_.adjoint() * Eigen::Map<const Eigen::MatrixXcf>(v, rows_.rows(), width);
  }

  /// J as SkinJacobian says.
  Eigen::MatrixXd jacobian(const SkinMoves& moves) const {
    const Eigen::Index channels = rows_.cols();
    Eigen::MatrixXd j(faces_ + 2 * moves.outside_rows, channels + moves.radial_count);
    for (Eigen::Index c = 0; c < j.cols(); ++c) {
      const bool turns = c < channels;
      const Eigen::Index n = turns ? c : moves.radial[c - channels];
      const Eigen::VectorXcd moved = rows_.col(n) * (moves.phasors[n] * (turns ? Complex(0, 1) : Complex(1)));
      for (int i = 0; i < faces_; ++i) {
        j(i, c) = (std::conj(moves.directions[i]) * moved(i)).real();
      }
      for (int i = 0; i < moves.outside_rows; ++i) {
        j(faces_ + 2 * i, c) = moved(faces_ + i).real();
        j(faces_ + 2 * i + 1, c) = moved(faces_ + i).imag();
      }
    }
    return j;
  }

  int sent = 0;
  int sent_back = 0;
  int in_single = 0;
  int in_double = 0;

 private:
  int faces_;
  Eigen::MatrixXcd rows_;
  Eigen::VectorXd reach_;
  Eigen::VectorXd strengths_;
  Eigen::MatrixXcf single_;
  Eigen::MatrixXd scaled_;
  Eigen::MatrixXd matrix_;
  Eigen::LLT<Eigen::MatrixXd> factor_;
  Eigen::VectorXd right_;
  Eigen::VectorXd y_;
  bool rounded_ = false;
};

class FakeGramDevice final : public GramDevice {
 public:
  FakeGramDevice(const Complex* q, int size) : q_(Eigen::Map<const Eigen::MatrixXcd>(q, size, size)) {}

  int size() const override { return static_cast<int>(q_.rows()); }
  bool finite() const override { return q_.allFinite(); }
  double largest_diagonal() const override { return q_.diagonal().real().maxCoeff(); }

  void multiply(const Complex* z, Complex* product) override {
    Eigen::Map<Eigen::VectorXcd>(product, q_.rows()) = q_ * Eigen::Map<const Eigen::VectorXcd>(z, q_.rows());
  }
  bool factorise(const Complex* z, double mu, bool in_double) override {
    const Eigen::Map<const Eigen::VectorXcd> turn(z, q_.rows());
    matrix_ = (turn.conjugate().asDiagonal() * q_ * turn.asDiagonal()).real();
    matrix_.diagonal().array() += mu;
    rounded_ = !in_double;
    factor_.compute(rounded_ ? matrix_.cast<float>().cast<double>() : matrix_);
    return factor_.info() == Eigen::Success;
  }
  double correct(const double* right, double unit, double* h) override {
    if (right != nullptr) {
      right_ = Eigen::Map<const Eigen::VectorXd>(right, q_.rows());
      h_ = Eigen::VectorXd::Zero(q_.rows());
    }
    const Eigen::VectorXd change = factor_.solve((right_ - matrix_ * h_) / unit);
    h_ += unit * (rounded_ ? change.cast<float>().cast<double>() : change);
    Eigen::Map<Eigen::VectorXd>(h, q_.rows()) = h_;
    return (right_ - matrix_ * h_).norm();
  }

 private:
  Eigen::MatrixXcd q_;
  Eigen::MatrixXd matrix_;
  Eigen::LLT<Eigen::MatrixXd> factor_;
  Eigen::VectorXd right_;
  Eigen::VectorXd h_;
  bool rounded_ = false;
};

class FakePhaseDevice final : public PhaseDevice {
 public:
  std::unique_ptr<SkinDevice> skin(const std::complex<double>* target, int faces, const std::complex<double>* outside,
                                   int rank, int channels) override {
    return std::make_unique<FakeSkinDevice>(target, faces, outside, rank, channels);
  }
};

}  // namespace touchfield
