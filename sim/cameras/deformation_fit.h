#pragma once

#include <vector>

#include <Eigen/SparseCholesky>

#include "sim/cameras/deformation_graph.h"

namespace touchfield {

/// Planes that points of a skin should come to.
struct SkinTargets {
  SkinBinding skin;        // which points
  Points at;               // 3 x P, where the undeformed skin has them [m]
  Points target;           // 3 x P, a point of the plane [m]
  Points normal;           // 3 x P, unit
  Eigen::VectorXd weight;  // P, >= 0
};

/// What holds a deformation where nothing is seen, and against noise. Each is the weight of a term as if it were so
/// many targets of weight 1.
struct DeformationPriors {
  double rigid = 1.0;    // each edge of the graph turns with its nodes
  double rest = 0.02;    // each node stays on the undeformed skin
  double before = 0.05;  // each node moves as it did before
};

/// Deforms a skin towards what was seen, by Gauss-Newton steps on
///
///   E = sum_p w_p (n_p . (x'_p - q_p))^2 + a sum_i sum_j |g_j + t_j - g_i - t_i - R_i (g_j - g_i)|^2
///       + b sum_i |t_i|^2 + c sum_i |t_i - s_i|^2
///
/// x'_p, g, t, R and the neighbours j of i are as in DeformationGraph. a, b, c are the priors, s the shifts of before.
/// The unknowns of a step are the shifts. The turns of the second term are eliminated from it exactly. Those within x'
/// are taken from before the step. All steps of a call use the matrix of the first.
///
/// accuracy   some calls on targets that moved rigidly reach them to rounding, also where nothing is seen, if b = c =
///            0. A bump of 2 mm (12 mm to its slope), nodes 14 mm apart, three cameras with 0.36 mm of noise: within
///            0.25 mm rms where it is, of 0.94 mm. Two steps on 2,400 targets take 1.4 ms at 150 nodes, 3.0 ms at 255,
///            on one core
/// source     Sumner, Schmid and Pauly 2007; Sorkine and Alexa 2007
class DeformationFit {
 public:
  explicit DeformationFit(DeformationGraph graph);

  const DeformationGraph& graph() const { return graph_; }

  /// E at some motions, and what a step would solve: matrix d = -gradient.
  struct System {
    double energy;                       // [m2]
    Eigen::SparseMatrix<double> matrix;  // 3N x 3N, the lower half; half of the second derivative
    Eigen::VectorXd gradient;            // 3N; half of dE / dt with the turns held
  };

  /// before   shifts in the frames of the nodes (3 x N [m]); empty for none
  /// throws   InputError on sizes that do not match
  const System& linearise(const SkinTargets& targets, const DeformationPriors& priors, const Points& before,
                          const NodeMotions& motions);

  /// Improves the motions.
  ///
  /// returns  rms of n . (x' - q) by weight, before the last step [m]; 0 without targets
  /// throws   InputError as linearise does, NumericalError if the priors leave a node free
  double fit(const SkinTargets& targets, const DeformationPriors& priors, const Points& before, int steps,
             NodeMotions& motions);

 private:
  void find_pattern();
  void add_targets(const SkinTargets& targets, const NodeMotions& motions);
  void add_edges(double weight, const NodeMotions& motions);
  void add_priors(const DeformationPriors& priors, const Points& before, const NodeMotions& motions);

  DeformationGraph graph_;
  System system_;
  double residual_ = 0;  // of the targets: sum of squares by weight [m2]
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver_;
  // Half of the second derivative in blocks of 3 x 3, by column and then row.
  std::vector<std::size_t> columns_;  // blocks of column j: columns_[j] <= b < columns_[j + 1]
  std::vector<int> rows_;             // of each block
  Eigen::Matrix<double, 9, Eigen::Dynamic> blocks_;
  // The blocks of all pairs k >= l of some nodes, (0, 0), (1, 0), (1, 1), (2, 0) ...
  struct Pairs {
    std::vector<int> blocks;
    std::vector<std::size_t> starts;
  };
  Pairs of_faces_;  // nodes_of a face
  Pairs of_stars_;  // a node and its neighbours
  std::vector<int> stars_;
  std::vector<std::size_t> star_starts_;
};

}  // namespace touchfield
