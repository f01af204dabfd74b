#include "sim/solve/skin_scattering.h"

#include <chrono>
#include <cmath>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include "solvers/linear/blas_product.h"

namespace touchfield {

namespace {

SystemOptions system_options(const SolverSpec& spec) {
  SystemOptions options;
  options.coupling = spec.coupling;
  options.rule.split_ratio = spec.split_ratio;
  return options;
}

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace

SkinModel::SkinModel(TriangleMesh mesh, const Wave& wave, Scheme scheme, const SolverSpec& spec,
                     Eigen::Index right_hand_sides)
    : system_(std::move(mesh), wave, scheme, system_options(spec)),
      decision_(choose_solver(spec, scheme, system_.unknowns(), available_memory(), right_hand_sides)) {}

const ScatteringSolver& SkinModel::solver() {
  if (!solver_) {
    solver_ = make_solver(system_, decision_.options);
  }
  return *solver_;
}

double SkinModel::reciprocal_condition() {
  if (!reciprocal_condition_ && solver_) {
    reciprocal_condition_ = solver_->reciprocal_condition();
  }
  return reciprocal_condition_.value_or(std::numeric_limits<double>::quiet_NaN());
}

SkinScattering::SkinScattering(std::shared_ptr<SkinModel> model, TransducerArray array,
                               std::vector<SolveRecord>& records, Progress& progress)
    : model_(std::move(model)), array_(std::move(array)), records_(records), progress_(progress) {}

SkinScattering::SkinScattering(TriangleMesh mesh, const Wave& wave, Scheme scheme, const SolverSpec& spec,
                               TransducerArray array, std::vector<SolveRecord>& records, Progress& progress,
                               Eigen::Index right_hand_sides)
    : SkinScattering(std::make_shared<SkinModel>(std::move(mesh), wave, scheme, spec, right_hand_sides),
                     std::move(array), records, progress) {}

SkinScattering::SkinScattering(const SkinScattering& other, ChannelResponse response)
    : SkinScattering(other.model_, other.array_, other.records_, other.progress_) {
  array_.response = std::move(response);
}

const IncidentField& SkinScattering::unit_field() {
  if (!unit_) {
    unit_ = system().incident(array_);
  }
  return *unit_;
}

IncidentField SkinScattering::driven_field(const Eigen::MatrixXcd& drives, bool single) {
  return unit_ ? driven(*unit_, drives) : system().incident(array_, drives, single);
}

ScatteringSolver::Report SkinScattering::reporter() {
  const double target = std::log(decision().options.tolerance);
  return [this, target](int /*step*/, double worst) {
    if (worst > 0) {
      progress_.advance(std::min(0.99, std::max(0.0, std::log(worst) / target)));
    }
  };
}

void SkinScattering::record(const std::string& stage, const Eigen::MatrixXcd& b, const SolveReport& report,
                            double seconds) {
  SolveRecord record;
  record.stage = stage;
  record.scheme = to_string(system().scheme());
  record.solver = to_string(decision().options.kind);
  record.precision = precision_name(decision().options);
  record.unknowns = system().unknowns();
  record.right_hand_sides = static_cast<int>(b.cols());
  record.steps = report.steps;
  record.refinements = report.refinements;
  record.residual = report.residual;
  record.converged = report.converged;
  record.seconds = seconds;
  records_.push_back(std::move(record));
}

Eigen::MatrixXcd SkinScattering::pressure(const Eigen::MatrixXcd& drives, const std::string& stage, bool single) {
  const IncidentField field = driven_field(drives, single);
  return solved(system().right_hand_side(field), field, stage);
}

Eigen::MatrixXcd SkinScattering::spanned_pressure(const LowRank& drives, const std::string& stage) {
  IncidentField field;
  if (system().needs_incident_pressure()) {
    field.pressure = matrix_product(unit_field().pressure, drives.basis);
  }
  return solved(drives.coefficients.adjoint(), field, stage);
}

Eigen::MatrixXcd SkinScattering::solved(const Eigen::MatrixXcd& b, const IncidentField& field,
                                        const std::string& stage) {
  const auto start = std::chrono::steady_clock::now();
  const Solved solved = model_->solver().solve(b, reporter());
  Eigen::MatrixXcd p = system().pressure(solved.x, field);
  record(stage, b, solved.report, seconds_since(start));
  return p;
}

Eigen::MatrixXcd SkinScattering::transfer_rows(const std::vector<Eigen::Index>& faces, const std::string& stage) {
  const Eigen::MatrixXcd b = system().transposed_right_hand_side(faces);
  const auto start = std::chrono::steady_clock::now();
  const Solved solved = model_->solver().solve_transpose(b, reporter());
  record(stage, b, solved.report, seconds_since(start));
  return system().transfer_rows(faces, solved.x, unit_field());
}

std::string describe_decision(const SkinScattering& scattering) {
  const ScatteringSystem& system = scattering.system();
  const SolverOptions& options = scattering.decision().options;
  std::string text =
      fmt::format("  solver: {}, {}, {} unknowns", to_string(options.kind), precision_name(options), system.unknowns());
  if (system.near_pairs() > 0) {
    text += fmt::format(", {} near pairs", system.near_pairs());
  }
  if (traits(system.scheme()).interior_points) {
    text += fmt::format(", {} interior points", system.interior_points().cols());
  }
  return text + fmt::format(" ({})", scattering.decision().reason);
}

}  // namespace touchfield
