#include "sim/run/transfer.h"

#include <cmath>
#include <complex>
#include <utility>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "solvers/linear/blas_product.h"
#include "solvers/linear/low_rank.h"

namespace touchfield {

namespace {

constexpr double kDriveTolerance = 1e-4;    // on b: the scheme's own error is some fifty times as large
constexpr double kOutsideTolerance = 1e-4;  // on pressures: an eigenvalue is their square

/// Drives that span what all channels do to the body, r of them: b^H compressed. b itself, as large as the field of
/// every channel, is gone before the solver takes its memory.
LowRank spanning_drives(SkinScattering& scattering) {
  return compressed(scattering.system().right_hand_side(scattering.unit_field()).adjoint(), kDriveTolerance);
}

/// The target's faces and then others.
std::vector<Eigen::Index> joined(const std::vector<Eigen::Index>& target, const std::vector<Eigen::Index>& more) {
  std::vector<Eigen::Index> faces = target;
  faces.insert(faces.end(), more.begin(), more.end());
  return faces;
}

/// Rows of `joined` faces.
void split(Eigen::MatrixXcd rows, Eigen::Index target, Transfer& transfer) {
  transfer.rows = rows.bottomRows(rows.rows() - target);
  rows.conservativeResize(target, Eigen::NoChange);
  transfer.reduction.problem.target = std::move(rows);
}

/// The rows of skin beyond, reduced with the others or, of a frame, in single precision behind them; and nothing of
/// dead channels: what they do is 0, not what rounding leaves of it.
void finish(const SkinScattering& scattering, const OutsideSkin& outside, bool reduce, Transfer& transfer) {
  if (transfer.outside_weight > 0 && !outside.beyond.empty()) {
    const Wave& wave = scattering.system().wave();
    if (reduce) {
      add_outside_rows(outside.beyond_rows(wave, transfer.outside_weight), kOutsideTolerance, transfer.reduction);
    } else {
      Eigen::MatrixXcd& rows = transfer.reduction.problem.outside;
      const Eigen::VectorXd scale = outside.beyond_weights(transfer.outside_weight).cwiseSqrt();
      Eigen::MatrixXcd all(rows.rows() + scale.size(), rows.cols());
      all << rows, scale.asDiagonal() * outside.beyond_pressure_single(wave).cast<std::complex<double>>();
      rows = std::move(all);
    }
  }
  const ChannelResponse& response = scattering.array().response;
  SkinProblem& problem = transfer.reduction.problem;
  for (Eigen::Index n = 0; n < response.gain.size(); ++n) {
    if (response.gain(n) == 0) {
      problem.target.col(n).setZero();
      problem.outside.col(n).setZero();
      if (transfer.rows.size() > 0) {
        transfer.rows.col(n).setZero();
      }
    }
  }
}

}  // namespace

std::optional<Transfer> make_transfer_on_card(SkinScattering& scattering,
                                              const std::shared_ptr<const Eigen::MatrixXcd>& drives,
                                              const Target& target, const OutsideSkin& outside, double outside_weight,
                                              const std::vector<Eigen::Index>& more) {
  if (scattering.gpu() == nullptr) {
    return std::nullopt;
  }
  const Eigen::VectorXd& areas = scattering.system().mesh().areas();
  const Eigen::VectorXd weights = outside.face_weights(areas, target, outside_weight);
  const std::vector<Eigen::Index> faces = joined(target.faces, more);
  auto spanned = scattering.spanned_on_card(
      drives, kDriveTolerance,
      {faces, outside_weight > 0 ? &weights : nullptr, drives != nullptr ? 0.0 : kOutsideTolerance}, "transfer");
  if (!spanned) {
    return std::nullopt;
  }
  Transfer transfer;
  transfer.outside_weight = outside_weight;
  transfer.solves = spanned->drives;
  transfer.channels_left_out = spanned->left_out;
  transfer.reduction.left_out = spanned->outside_left_out;
  SkinProblem& problem = transfer.reduction.problem;
  split(std::move(spanned->target), target.size(), transfer);
  problem.outside = std::move(spanned->outside);
  problem.amplitudes = target.amplitudes;
  problem.weights = target.areas(areas);
  problem.shares = target.shares;
  finish(scattering, outside, drives == nullptr, transfer);
  return transfer;
}

Transfer make_transfer(SkinScattering& scattering, const Target& target, const OutsideSkin& outside,
                       double outside_weight, const std::vector<Eigen::Index>& more) {
  const Eigen::VectorXd& areas = scattering.system().mesh().areas();
  const std::vector<Eigen::Index> faces = joined(target.faces, more);
  const auto count = static_cast<Eigen::Index>(faces.size());
  const auto by_reciprocity = [&] {
    Transfer transfer;
    transfer.outside_weight = outside_weight;
    transfer.by_reciprocity = true;
    transfer.solves = count;
    split(scattering.transfer_rows(faces, "transfer"), target.size(), transfer);
    transfer.reduction.problem.amplitudes = target.amplitudes;
    transfer.reduction.problem.weights = target.areas(areas);
    transfer.reduction.problem.shares = target.shares;
    transfer.reduction.problem.outside.resize(0, scattering.array().size());
    finish(scattering, outside, true, transfer);
    return transfer;
  };
  if (scattering.gpu() != nullptr) {
    const ScatteringSystem& system = scattering.system();
    if (!(outside_weight > 0) &&
        static_cast<double>(count) < expected_drives(system.mesh(), scattering.array(), system.wave().wavelength())) {
      return by_reciprocity();
    }
    if (auto transfer = make_transfer_on_card(scattering, nullptr, target, outside, outside_weight, more)) {
      return *transfer;
    }
  }
  const LowRank drives = spanning_drives(scattering);
  if (!(outside_weight > 0) && count < drives.rank()) {
    return by_reciprocity();
  }
  return make_transfer({drives.basis, scattering.spanned_pressure(drives, "transfer"), drives.left_out}, scattering,
                       target, outside, outside_weight, true, more);
}

SpannedPressure spanned_pressure(SkinScattering& scattering, const Eigen::MatrixXcd& drives) {
  const bool single = scattering.decision().options.precision == Precision::kSingle;
  return {drives, scattering.pressure(drives, "transfer", single), 0.0};
}

Transfer make_transfer(const SpannedPressure& spanned, const SkinScattering& scattering, const Target& target,
                       const OutsideSkin& outside, double outside_weight, bool reduce,
                       const std::vector<Eigen::Index>& more) {
  Transfer transfer;
  transfer.outside_weight = outside_weight;
  transfer.solves = spanned.drives.cols();
  transfer.channels_left_out = spanned.left_out;
  const Eigen::VectorXd& areas = scattering.system().mesh().areas();
  const Eigen::VectorXd weights =
      outside_weight > 0 ? outside.face_weights(areas, target, outside_weight) : Eigen::VectorXd();
  transfer.reduction =
      reduced_skin_problem(spanned.pressure, spanned.drives, areas, target, weights, kOutsideTolerance);
  if (!more.empty()) {
    multiply_by_adjoint(spanned.pressure(more, Eigen::all), spanned.drives, transfer.rows);
  }
  finish(scattering, outside, reduce, transfer);
  return transfer;
}

Eigen::MatrixXcd transfer_matrix(const TriangleMesh& mesh, const Wave& wave, const TransducerArray& array,
                                 Scheme scheme, const SolverSpec& spec) {
  Progress silent;
  return transfer_matrix(mesh, wave, array, scheme, spec, silent);
}

Eigen::MatrixXcd transfer_matrix(const TriangleMesh& mesh, const Wave& wave, const TransducerArray& array,
                                 Scheme scheme, const SolverSpec& spec, Progress& progress) {
  std::vector<SolveRecord> records;
  const auto block = static_cast<Eigen::Index>(std::ceil(expected_drives(mesh, array, wave.wavelength())));
  SkinScattering scattering(mesh, wave, scheme, spec, array, records, progress, block);
  const LowRank drives = spanning_drives(scattering);
  Eigen::MatrixXcd h;
  multiply_by_adjoint(scattering.spanned_pressure(drives, "transfer"), drives.basis, h);
  require_finite("transfer matrix", h);
  for (const SolveRecord& record : records) {
    if (!record.converged) {
      throw NumericalError(fmt::format("transfer matrix: the residual of {:.1e} is above the tolerance of {:.1e}",
                                       record.residual, spec.tolerance));
    }
  }
  return h;
}

std::string describe_transfer(const Transfer& transfer, Eigen::Index channels) {
  if (transfer.by_reciprocity) {
    return fmt::format("  transfer: {} target rows of {} channels by reciprocity", transfer.solves, channels);
  }
  return fmt::format(
      "  transfer: {} channels by a reduced basis of {}, error {:.1e}; skin outside the target by {} rows, error "
      "{:.1e}",
      channels, transfer.solves, transfer.channels_left_out, transfer.reduction.problem.outside.rows(),
      transfer.reduction.left_out);
}

}  // namespace touchfield
