#include "sim/field/skin_problems.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <stdexcept>
#include <utility>

#include "sim/acoustics/incident_field.h"
#include "solvers/linear/blas_product.h"
#include "solvers/linear/factorisations.h"

namespace touchfield {

namespace {

constexpr Eigen::Index kGramRows = 2048;  // rows of G that are weighed at a time

/// Q from its blocks, W = diag(w): bb = B_T^H W B_T (K x K), gb = G^H W B_T (N x K), gg = G^H W G (N x N).
IncidentProblem assemble(const Eigen::MatrixXcd& bb, const Eigen::MatrixXcd& gb, const Eigen::MatrixXcd& gg,
                         const Eigen::VectorXd& amplitudes) {
  const Eigen::Index k = bb.rows();
  const Eigen::Index n = gg.rows();
  Eigen::MatrixXcd q(k + n, k + n);
  const auto scale = amplitudes.asDiagonal();
  q.topLeftCorner(k, k) = scale * bb * scale;
  q.bottomLeftCorner(n, k) = -gb * scale;
  q.topRightCorner(k, n) = q.bottomLeftCorner(n, k).adjoint();
  q.bottomRightCorner(n, n) = gg;
  return {std::move(q), k};
}

constexpr double kWall = 2.0;  // |p|^2 on skin over |p_inc|^2

/// Eigenvalues of a Gram matrix that count, their number, and what the others were.
struct Spectrum {
  Eigen::VectorXd values;  // ascending, >= 0
  Eigen::Index rank;
  double dropped;  // sum
};

Spectrum spectrum_of(const HermitianEigen& eigen, double tolerance) {
  Spectrum spectrum{eigen.values.cwiseMax(0.0), 0, 0.0};
  if (spectrum.values.size() == 0) {
    return spectrum;  // of an array that is all dead
  }
  const double least = tolerance * tolerance * spectrum.values.tail(1).sum();
  const auto dropped = static_cast<Eigen::Index>(
      std::count_if(spectrum.values.begin(), spectrum.values.end(), [&](double value) { return value <= least; }));
  spectrum.rank = spectrum.values.size() - dropped;
  spectrum.dropped = spectrum.values.head(dropped).sum();
  return spectrum;
}

}  // namespace

Eigen::VectorXd row_weights(FaceWeights faces, const Eigen::VectorXd& areas, Eigen::Index rows) {
  Eigen::VectorXd weights = Eigen::VectorXd::Ones(rows);
  if (faces == FaceWeights::kArea) {
    weights.head(areas.size()) = areas / areas.mean();
  }
  return weights;
}

Eigen::MatrixXcd weighted_gram(const Eigen::MatrixXcd& g, const Eigen::VectorXd& weights) {
  if ((weights.array() == 1.0).all()) {
    return hermitian_product(g);
  }
  Eigen::MatrixXcd gram = Eigen::MatrixXcd::Zero(g.cols(), g.cols());
  const Eigen::VectorXd roots = weights.cwiseSqrt();
  for (Eigen::Index at = 0; at < g.rows(); at += kGramRows) {
    const Eigen::Index count = std::min(kGramRows, g.rows() - at);
    gram += hermitian_product(roots.segment(at, count).asDiagonal() * g.middleRows(at, count));
  }
  return gram;
}

IncidentProblem scattered_problem(const Eigen::MatrixXcd& columns, const Eigen::MatrixXcd& g,
                                  const Eigen::MatrixXcd& gram_g, const Eigen::VectorXd& amplitudes,
                                  const Eigen::VectorXd& weights) {
  return assemble(weighted_gram(columns, weights), adjoint_product(g, weights.asDiagonal() * columns), gram_g,
                  amplitudes);
}

IncidentProblem unscattered_problem(const std::vector<Eigen::Index>& faces, const Eigen::MatrixXcd& g,
                                    const Eigen::MatrixXcd& gram_g, const Eigen::VectorXd& amplitudes,
                                    const Eigen::VectorXd& weights) {
  const Eigen::MatrixXcd own = weights(faces).cast<std::complex<double>>().asDiagonal();
  return assemble(own, g(faces, Eigen::all).adjoint() * own, gram_g, amplitudes);
}

Eigen::VectorXd OutsideSkin::face_weights(const Eigen::VectorXd& areas, const Target& target,
                                          double outside_weight) const {
  Eigen::VectorXd weights = outside_weight * areas;
  if (faces.size() > 0) {
    weights.array() *= faces.array();
  }
  for (Eigen::Index i = 0; i < target.size(); ++i) {
    weights(target.faces[static_cast<std::size_t>(i)]) *= 1.0 - target.shares(i);
  }
  return weights;
}

Eigen::VectorXd OutsideSkin::beyond_weights(double outside_weight) const {
  return kWall * outside_weight * beyond.areas;
}

Eigen::MatrixXcf OutsideSkin::beyond_pressure_single(const Wave& wave) const {
  return incident_matrix_single(array, wave, beyond.centres());
}

Eigen::MatrixXcd OutsideSkin::beyond_rows(const Wave& wave, double outside_weight) const {
  return beyond_weights(outside_weight).cwiseSqrt().asDiagonal() * incident_matrix(array, wave, beyond.centres());
}

Eigen::VectorXd OutsideSkin::misfit_weights(FaceWeights weights, const Eigen::VectorXd& areas,
                                            Eigen::Index rows) const {
  Eigen::VectorXd all = row_weights(weights, areas, rows);
  if (faces.size() > 0) {
    all.head(faces.size()).array() *= faces.array();
  }
  return all;
}

Eigen::MatrixXcd OutsideSkin::beyond_gram(FaceWeights weights, const Wave& wave, double mean_area) const {
  if (beyond.empty()) {
    return {};
  }
  return weighted_gram(incident_matrix(array, wave, beyond.centres()),
                       weights == FaceWeights::kArea ? Eigen::VectorXd(beyond.areas / mean_area) : beyond.faces);
}

SkinReduction reduced_skin_problem(const Eigen::MatrixXcd& pressures, const Eigen::MatrixXcd& drives,
                                   const Eigen::VectorXd& areas, const Target& target, const Eigen::VectorXd& outside,
                                   double tolerance) {
  if (pressures.cols() != drives.cols() || pressures.rows() != areas.size() ||
      target.amplitudes.size() != target.size() || target.shares.size() != target.size() ||
      (outside.size() > 0 && outside.size() != areas.size())) {
    throw std::invalid_argument("reduced_skin_problem: the sizes do not fit");
  }
  const Eigen::MatrixXcd rows = pressures(target.faces, Eigen::all);
  SkinReduction reduction;
  SkinProblem& problem = reduction.problem;
  problem.target = adjoint_product(rows.adjoint(), drives.adjoint());
  problem.amplitudes = target.amplitudes;
  problem.weights = target.areas(areas);
  problem.shares = target.shares;
  problem.outside.resize(0, drives.rows());
  if (outside.size() == 0) {
    return reduction;
  }
  const Eigen::MatrixXcd weighted = outside.cwiseSqrt().asDiagonal() * pressures;
  const HermitianEigen eigen = hermitian_eigen(hermitian_product(weighted));
  const Spectrum spectrum = spectrum_of(eigen, tolerance);
  const Eigen::MatrixXcd scaled =
      (eigen.vectors.rightCols(spectrum.rank) * spectrum.values.tail(spectrum.rank).cwiseSqrt().asDiagonal())
          .rowwise()
          .reverse();  // strongest first
  problem.outside = adjoint_product(scaled, drives.adjoint());
  const double total = spectrum.values.sum();
  reduction.left_out = total > 0 ? std::sqrt(spectrum.dropped / total) : 0.0;
  return reduction;
}

void add_outside_rows(const Eigen::MatrixXcd& rows, double tolerance, SkinReduction& reduction) {
  Eigen::MatrixXcd& outside = reduction.problem.outside;
  const double before = outside.squaredNorm();
  // Of the rows before, before = (1 - left_out^2) of all.
  const double left = before * std::pow(reduction.left_out, 2) / (1.0 - std::pow(reduction.left_out, 2));
  Eigen::MatrixXcd all(outside.rows() + rows.rows(), rows.cols());
  all << outside, rows;
  const bool tall = all.rows() > all.cols();
  const HermitianEigen eigen = hermitian_eigen(hermitian_product(tall ? all : Eigen::MatrixXcd(all.adjoint())));
  const Spectrum spectrum = spectrum_of(eigen, tolerance);
  const Eigen::MatrixXcd strongest = eigen.vectors.rightCols(spectrum.rank).rowwise().reverse();
  outside = tall ? Eigen::MatrixXcd(spectrum.values.tail(spectrum.rank).reverse().cwiseSqrt().asDiagonal() *
                                    strongest.adjoint())
                 : adjoint_product(strongest, all);
  const double total = spectrum.values.sum() + left;
  reduction.left_out = total > 0 ? std::sqrt((spectrum.dropped + left) / total) : 0.0;
}

double expected_drives(const Points& centroids, const Points& normals, const Eigen::VectorXd& areas,
                       const TransducerArray& array, double wavelength) {
  if (array.kind != TransducerArray::Kind::kTransducers) {
    return 1.0;
  }
  constexpr Eigen::Index kStride = 7;  // some hundred channels tell as much as all
  const Neighbours neighbours = nearest_neighbours(array.positions);
  double pitches = 0.0;
  double etendue = 0.0;
  Eigen::Index sampled = 0;
  for (Eigen::Index n = 0; n < array.size(); n += kStride) {
    const Vector3 x = array.positions.col(n);
    const Vector3 axis = array.axes.col(n);
    double sum = 0.0;
    for (Eigen::Index j = 0; j < areas.size(); ++j) {
      const Vector3 way = centroids.col(j) - x;
      const double seen = axis.dot(way) * -way.dot(normals.col(j));
      const double square = way.squaredNorm();
      sum += seen > 0 && axis.dot(way) > 0 ? areas(j) * seen / (square * square) : 0.0;
    }
    pitches += array.size() > 1 ? neighbours.squared(n) : 0.0;
    etendue += sum;
    ++sampled;
  }
  const auto channels = static_cast<double>(array.size());
  const double modes = pitches / static_cast<double>(sampled) * etendue / static_cast<double>(sampled) * channels /
                       std::pow(wavelength, 2);
  return std::clamp(25.0 * std::sqrt(modes) + 0.65 * modes, 1.0, channels);
}

}  // namespace touchfield
