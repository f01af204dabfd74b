#pragma once

#include <complex>

#include <Eigen/Core>

#include "solvers/linear/blas_product.h"
#include "solvers/phase/phase_descent.h"
#include "solvers/phase/phase_device.h"

namespace touchfield {

/// [F; R] in single precision, or the device that has it, as a descent multiplies with it.
class SkinRows {
 public:
  /// device   outlives this; null: the processor multiplies
  SkinRows(const Eigen::MatrixXcd& rows, const Eigen::MatrixXcd& outside, SkinDevice* device = nullptr)
      : device_(device), rows_(rows.rows() + outside.rows()), cols_(rows.cols()) {
    if (device_ != nullptr) {
      device_->scale_single(Eigen::VectorXd::Ones(rows_).eval().data());
      return;
    }
    all_.resize(rows_, cols_);
    all_ << rows.cast<std::complex<float>>(), outside.cast<std::complex<float>>();
  }

  /// Refers to this.
  SkinMap map() const {
    return {[this](const Eigen::VectorXcf& q) {
              Eigen::VectorXcf p(rows_);
              if (device_ != nullptr) {
                device_->send_single(1, q.data(), p.data());
              } else {
                multiply(Op::kPlain, all_, q, 0.0F, p);
              }
              return p;
            },
            [this](const Eigen::VectorXcf& v) {
              Eigen::VectorXcf x(cols_);
              if (device_ != nullptr) {
                device_->send_back_single(1, v.data(), x.data());
              } else {
                multiply(Op::kAdjoint, all_, v, 0.0F, x);
              }
              return x;
            }};
  }

 private:
  SkinDevice* device_;
  Eigen::Index rows_;
  Eigen::Index cols_;
  Eigen::MatrixXcf all_;  // empty where a device has it
};

}  // namespace touchfield
