#include "sim/run/transfer.h"

#include <utility>

#include <fmt/format.h>

#include "solvers/linear/low_rank.h"

namespace touchfield {

namespace {

constexpr double kDriveTolerance = 1e-5;  // on b: the scheme's own error is some hundred times as large
constexpr double kQuietTolerance = 1e-4;  // on pressures: an eigenvalue is their square

}  // namespace

Transfer make_transfer(SkinScattering& scattering, const Target& target, double quiet_weight) {
  const ScatteringSystem& system = scattering.system();
  const Eigen::VectorXd& areas = system.mesh().areas();
  const Eigen::MatrixXcd b = system.right_hand_side(scattering.unit_field());
  LowRank drives = compressed(b.adjoint(), kDriveTolerance);
  Transfer transfer;
  if (!(quiet_weight > 0) && target.size() < drives.rank()) {
    transfer.by_reciprocity = true;
    transfer.solves = target.size();
    transfer.reduction.problem.target = scattering.transfer_rows(target.faces, "transfer");
    transfer.reduction.problem.amplitudes = target.amplitudes;
    transfer.reduction.problem.weights = areas(target.faces);
    transfer.reduction.problem.quiet.resize(0, b.cols());
    return transfer;
  }
  transfer.solves = drives.rank();
  transfer.channels_left_out = drives.left_out;
  const Eigen::MatrixXcd pressures = scattering.pressure(drives.basis, "transfer");
  transfer.reduction = reduced_skin_problem(pressures, drives.basis, areas, target, quiet_weight, kQuietTolerance);
  return transfer;
}

std::string describe_transfer(const Transfer& transfer, Eigen::Index channels) {
  if (transfer.by_reciprocity) {
    return fmt::format("  transfer: {} target rows of {} channels by reciprocity", transfer.solves, channels);
  }
  return fmt::format(
      "  transfer: {} channels by {} drives, which leave out {:.1e}; quiet skin by {} rows, which leave out {:.1e}",
      channels, transfer.solves, transfer.channels_left_out, transfer.reduction.problem.quiet.rows(),
      transfer.reduction.left_out);
}

}  // namespace touchfield
