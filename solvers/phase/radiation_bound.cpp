#include "solvers/phase/radiation_bound.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <stdexcept>
#include <utility>

#include "solvers/linear/blas_product.h"
#include "solvers/phase/dual_proof.h"
#include "solvers/phase/phase_descent.h"
#include "solvers/phase/relaxation.h"

namespace touchfield {

namespace {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::VectorXcd;
using Eigen::VectorXd;

constexpr double kLeastScale = 1e-4;  // of the cost of silence: the tolerance is a share of no less
constexpr double kFirstShare = 0.1;   // of what may be missing, lost by the first shift

/// Numbers of faces for both slopes of each.
VectorXd of_slopes(const VectorXd& faces) {
  VectorXd both(2 * faces.size());
  for (Index j = 0; j < faces.size(); ++j) {
    both.segment(2 * j, 2).setConstant(faces(j));
  }
  return both;
}

/// f = 2 w r, what the cost gains per P.
VectorXd force_of(const RadiationSkin& skin, const VectorXd& residual) {
  return 2.0 * skin.weights.cwiseProduct(residual);
}

/// What the dual matrix C is made of: B and D in double precision, and the skin.
struct DualSkin {
  MatrixXcd rows;                                       // B, M' x N
  Eigen::SparseMatrix<double, Eigen::RowMajor> slopes;  // D
  const RadiationSkin& skin;

  explicit DualSkin(const RadiationProblem& problem)
      : rows(problem.rows.rows() + problem.outside.rows(), problem.channel_count()),
        slopes(problem.skin.slopes->cast<double>()),
        skin(problem.skin) {
    rows << problem.rows, problem.outside;
  }

  /// diag(e + a f) x - D^T diag(b f) D x, f = 2 w r: C = B^H times that of B.
  MatrixXcd weighed(const VectorXd& force, const Eigen::Ref<const MatrixXcd>& x) const {
    VectorXd weights = skin.energies;
    weights.head(force.size()) += skin.press * force;
    const MatrixXcd flow = (-skin.flow * of_slopes(force)).asDiagonal() * (slopes * x.topRows(slopes.cols()));
    MatrixXcd result = weights.asDiagonal() * x;
    result.topRows(slopes.cols()) += slopes.transpose() * flow;
    return result;
  }

  MatrixXcd c(const VectorXd& force) const {
    constexpr Index kStrip = 128;  // columns whose slopes are held
    MatrixXcd all(rows.rows(), rows.cols());
    for (Index at = 0; at < all.cols(); at += kStrip) {
      const Index width = std::min(kStrip, all.cols() - at);
      all.middleCols(at, width) = weighed(force, rows.middleCols(at, width));
    }
    return adjoint_product(rows, all);
  }

  /// At least the trace of C with every product in it taken by its absolute value.
  double magnitude(const VectorXd& force) const {
    const VectorXd lengths = rows.rowwise().norm();
    const VectorXd spread = slopes.cwiseAbs() * lengths.head(slopes.cols());
    VectorXd weights = skin.energies;
    weights.head(force.size()) += skin.press * force.cwiseAbs();
    return weights.dot(lengths.cwiseAbs2()) + skin.flow * of_slopes(force.cwiseAbs()).dot(spread.cwiseAbs2());
  }
};

/// The cost over X = Y Y^H as PhaseDescent steps on it. Y^T has the slack below, (l + 1) x N, columns of length one.
struct RelaxedRadiation {
  const DualSkin& dual;

  struct Point {
    VectorXd phases;     // real and imaginary parts of Y^T and slack, columns of any length
    MatrixXcd y;         // Y^T and slack
    MatrixXcd pressure;  // B Y, M' x l
    VectorXd residual;   // P + k - P', M
    double cost = 0.0;
  };

  Point at(VectorXd entries) const;
  VectorXd gradient(const Point& point) const;

 private:
  MatrixXcd columns_of(const VectorXd& entries) const {
    const Index channels = dual.rows.cols();
    return Eigen::Map<const MatrixXcd>(reinterpret_cast<const std::complex<double>*>(entries.data()),
                                       entries.size() / (2 * channels), channels);
  }
};

VectorXd entries_of(const MatrixXcd& columns) {
  return Eigen::Map<const VectorXd>(reinterpret_cast<const double*>(columns.data()), 2 * columns.size());
}

RelaxedRadiation::Point RelaxedRadiation::at(VectorXd entries) const {
  const RadiationSkin& skin = dual.skin;
  Point point;
  point.phases = std::move(entries);
  point.y = columns_of(point.phases).colwise().normalized();
  const Index width = point.y.rows() - 1;
  point.pressure.resize(dual.rows.rows(), width);
  multiply(Op::kPlain, dual.rows, Op::kTransposed, point.y.topRows(width), point.pressure);
  const VectorXd loudness = point.pressure.rowwise().squaredNorm();
  const VectorXd flows = (dual.slopes * point.pressure.topRows(dual.slopes.cols())).eval().rowwise().squaredNorm();
  point.residual = skin.press * loudness.head(skin.face_count()) - skin.wanted;
  for (Index j = 0; j < point.residual.size(); ++j) {
    point.residual(j) -= skin.flow * (flows(2 * j) + flows(2 * j + 1));
  }
  if (skin.deviations.size() > 0) {
    point.residual += skin.deviations;
  }
  point.cost = skin.weights.dot(point.residual.cwiseAbs2()) + skin.energies.dot(loudness) + skin.deviation_energy +
               skin.constant;
  return point;
}

VectorXd RelaxedRadiation::gradient(const Point& point) const {
  const MatrixXcd weighed = dual.weighed(force_of(dual.skin, point.residual), point.pressure);
  MatrixXcd back(dual.rows.cols(), weighed.cols());
  multiply(Op::kAdjoint, dual.rows, Op::kPlain, weighed, back);
  MatrixXcd along = MatrixXcd::Zero(point.y.rows(), point.y.cols());
  along.topRows(back.cols()) = 2.0 * back.transpose();
  along -= point.y * real_column_dots(point.y, along).asDiagonal();
  const VectorXd lengths = columns_of(point.phases).colwise().norm();
  return entries_of(along * lengths.cwiseInverse().asDiagonal());
}

/// Where the descent of the relaxation ends, and after how many steps.
RelaxedRadiation::Point relaxed_radiation(const DualSkin& dual, const VectorXcd& start,
                                          const OptimalityBoundOptions& options, int& iterations) {
  const RelaxedRadiation relaxation{dual};
  RelaxedRadiation::Point point = relaxation.at(entries_of(relaxed_start(start, options.width, options.seed)));
  VectorXd gradient = relaxation.gradient(point);
  PhaseDescent descent;
  auto taken = PhaseDescent::Step::kTaken;
  for (iterations = 0; iterations < options.max_iterations && taken != PhaseDescent::Step::kNone; ++iterations) {
    taken = descent.step(relaxation, point, gradient);
  }
  return point;
}

/// The bound that residuals r and rows Y^T prove, whatever they are.
///
/// missing   about what it may lack of the cost of the relaxation
double proved_bound(const DualSkin& dual, const VectorXd& residual, const MatrixXcd& y, double missing) {
  const RadiationSkin& skin = dual.skin;
  const VectorXd force = force_of(skin, residual);
  const MatrixXcd c = dual.c(force);
  MatrixXcd gradient(y.rows(), y.cols());
  multiply(Op::kPlain, y, Op::kTransposed, c, gradient);
  const VectorXd d = real_column_dots(y, gradient).cwiseMin(0.0);
  const double squares = 0.5 * force.dot(residual);
  const VectorXd levels = force.cwiseProduct(skin.wanted);
  const VectorXd deviations = skin.deviations.size() > 0 ? force.cwiseProduct(skin.deviations).eval() : VectorXd();
  const double silent = skin.constant - squares - levels.sum();
  const double full = d.sum() + deviations.sum() + skin.deviation_energy;
  const auto n = static_cast<double>(y.cols());
  const double shift = least_shift([&](double s) { return is_definite(c, s - d.array()); }, kFirstShare * missing / n);
  const double products = dual.magnitude(force) + d.cwiseAbs().sum() + n * shift;
  const Index depth = 2 * dual.rows.rows() + dual.slopes.rows();  // of the sums in C, one within the other
  const double deficit = shift + rounding_of_eigenvalue(y.cols(), depth, products);
  const double magnitude = std::abs(skin.constant) + squares + levels.cwiseAbs().sum() + d.cwiseAbs().sum() +
                           deviations.cwiseAbs().sum() + skin.deviation_energy;
  const double terms = n + 3.0 * static_cast<double>(skin.face_count());
  return silent + std::min(0.0, full - n * deficit) - rounding_of_sum(terms, magnitude);
}

}  // namespace

OptimalityBound prove_radiation_bound(const RadiationProblem& problem, const VectorXcd& start,
                                      const OptimalityBoundOptions& options) {
  require_valid(problem, "prove_radiation_bound");
  require_valid(options, "prove_radiation_bound");
  if (start.size() != problem.channel_count() || !start.allFinite()) {
    throw std::invalid_argument("prove_radiation_bound: the start must hold one finite drive for each channel");
  }
  const RadiationSkin& skin = problem.skin;
  const double silence = silent_cost(skin);
  OptimalityBound found;
  if (!(silence > skin.constant)) {  // nothing is wanted
    return {.bound = silence, .relaxed = silence, .converged = true};
  }
  const DualSkin dual(problem);
  const RelaxedRadiation::Point point = relaxed_radiation(dual, start, options, found.iterations);
  require_finite_value(point.cost);
  const double missing = options.tolerance * std::max(point.cost, kLeastScale * silence);
  const double bound = proved_bound(dual, point.residual, point.y.topRows(point.y.rows() - 1), missing);
  found.relaxed = point.cost;
  found.bound = std::max(skin.constant, bound);  // which every cost is above
  found.converged = found.relaxed - found.bound <= missing;
  return found;
}

}  // namespace touchfield
