#pragma once

#include <memory>

#include <Eigen/Core>
#include <Eigen/SparseCore>

#include "solvers/phase/phase_descent.h"
#include "solvers/phase/phase_device.h"
#include "solvers/phase/phase_solution.h"
#include "solvers/phase/surface.h"

namespace touchfield {

/// D: slopes of a pressure along the skin. Rows 2j and 2j + 1 are those of face j along two directions at right angles
/// [1/m].
using SkinSlopes = Eigen::SparseMatrix<float, Eigen::RowMajor>;

/// What pressures p, M' of them, press on M faces of sound-hard skin, and what is wanted there:
///
///   P_j = a |p_j|^2 - b (|(D p)_2j|^2 + |(D p)_2j+1|^2),   a = 1 / (4 rho c^2), b = 1 / (4 rho omega^2)
///   cost = sum_j w_j (P_j - P'_j)^2 + sum_i e_i |p_i|^2 + constant
///
/// p_j of the faces come first. The rest are neighbours, which D needs, and skin that counts by its energy alone.
///
/// Channels whose response deviates (with_tolerances) add to what is expected, at the amplitude a of all drives:
///
///   E P_j = P_j + a^2 k_j,   E sum_i e_i |p_i|^2 = sum_i e_i |p_i|^2 + a^2 E_0
struct RadiationSkin {
  std::shared_ptr<const SkinSlopes> slopes{};  // D, 2 M x S: of the first S pressures, those of faces and neighbours
  double press = 0.0;                          // a [1/Pa]
  double flow = 0.0;                           // b [m2/Pa]
  Eigen::VectorXd wanted{};                    // P', M [Pa]
  Eigen::VectorXd weights{};                   // w, M, >= 0 [1/Pa2]
  Eigen::VectorXd energies{};                  // e, M', >= 0 [1/Pa2]
  double constant = 0.0;
  Eigen::VectorXd deviations{};   // k, M [Pa]; empty: 0
  double deviation_energy = 0.0;  // E_0

  Eigen::Index face_count() const { return wanted.size(); }
};

/// Skin whose pressures are p = [F; R] q: F are rows of the transfer matrix H, R stands for the skin outside.
struct RadiationProblem {
  Eigen::MatrixXcd rows{};     // F, M'' x N [Pa]: the faces, then their neighbours
  Eigen::MatrixXcd outside{};  // R, r x N, r may be 0; its energies are the last r of the skin's
  RadiationSkin skin{};
  std::shared_ptr<SkinDevice> device{};  // that holds both too and multiplies in their place; null: none

  Eigen::Index channel_count() const { return rows.cols(); }
};

/// throws   std::invalid_argument on sizes that do not fit, no face or channel, a value that is not finite, or a
///          negative weight or energy; `who` begins the message
void require_valid(const RadiationProblem& problem, const char* who);

/// Brings the matrices to a device, which the methods then use.
void move_to(PhaseDevice& device, RadiationProblem& problem);

/// P of pressures (M' or more), M [Pa]. In double precision.
Eigen::VectorXd radiation_of(const RadiationSkin& skin, const Eigen::VectorXcd& pressure);

/// The cost at drives q (N), in double precision. A problem with tolerances takes q for drives of one amplitude.
double radiation_cost(const RadiationProblem& problem, const Eigen::VectorXcd& q);

/// dC/d Re q + i dC/d Im q of C = radiation_cost at drives q, N, in double precision.
///
/// throws   std::invalid_argument if the problem has tolerances
Eigen::VectorXcd radiation_gradient(const RadiationProblem& problem, const Eigen::VectorXcd& q);

/// The level a in 0..1/max|q| at which that of a q is least.
double best_level(const RadiationProblem& problem, const Eigen::VectorXcd& q);

/// The cost of no sound at all.
double silent_cost(const RadiationSkin& skin);

/// The problem of the expected pressures, for channels that are not quite as designed. With mean m and variance v of
/// their responses (channel_moments) the rows are m times as strong, and
///
///   k_j = v (a sum_n |h_jn|^2 - b sum_n (|(D h)_2j,n|^2 + |(D h)_2j+1,n|^2)),   E_0 = v sum_i e_i sum_n |h_in|^2
///
/// for drives of one amplitude. The scatter of P_j about its mean is left out: it is 2 v sum_n |h_jn|^2 / |p_j|^2 of
/// P_j^2, which is below a percent on a focus of some hundred channels.
RadiationProblem with_tolerances(RadiationProblem problem, const ChannelTolerances& tolerances);

/// The cost of phases, which PhaseDescent lowers, by products in single precision.
///
/// Free level: at each point all drives have the amplitude a <= 1 at which the cost is least. It is a parabola in a^2.
/// a stays so large that the loudest face presses a hundredth of the largest P', so that silence is left.
/// Free amplitudes: drive n is cos(psi_n) e^{i phi_n}; the angles are [phi; psi].
class RadiationMisfit {
 public:
  /// map, skin   outlive this
  RadiationMisfit(const SkinMap& map, const RadiationSkin& skin, bool free_level, bool free_amplitudes = false)
      : map_(map), skin_(skin), free_level_(free_level), free_amplitudes_(free_amplitudes) {}

  struct Point {
    Eigen::VectorXd phases;     // N, or 2 N
    Eigen::VectorXcf drives;    // at level 1, N
    Eigen::VectorXcf pressure;  // likewise, M'
    Eigen::VectorXcf slopes;    // D p, 2 M
    Eigen::VectorXd radiation;  // likewise, with the deviations, M [Pa]
    double level = 1.0;         // a^2
    double cost = 0.0;
  };

  Point at(Eigen::VectorXd phases) const;
  Eigen::VectorXd gradient(const Point& point) const;
  PhaseSolution solution(const Point& point, PhaseSolution solution) const;

 private:
  const SkinMap& map_;
  const RadiationSkin& skin_;
  bool free_level_;
  bool free_amplitudes_;
};

/// Steps of method radiation where nothing else is said: it ends before where the cost stands still.
inline constexpr int kUsualDescents = 1000;

struct RadiationOptions {
  int iterations = kUsualDescents;  // steps from the start that continues; >= 1
  int trial = 15;                   // of them, from each start where there are several; >= 1
  bool free_amplitudes = false;     // bounded 0..1 beside the phases; else all the same
  bool free_level = false;          // one amplitude of all drives, up to 1
  double standstill = 1e-4;         // converged if six steps together lower the cost by less than this share; >= 0
};

/// Minimises radiation_cost over phases by PhaseDescent. From several starts `trial` steps each are taken, and the path
/// that is lowest then continues. Where amplitudes are free, the phases come to rest first.
///
/// starts   drives, N per column; their phases count
/// throws   std::invalid_argument as require_valid, on no start or one of another size or not finite, options out of
///          range; std::domain_error if a pressure overflows
PhaseSolution solve_radiation(const RadiationProblem& problem, const Eigen::MatrixXcd& starts,
                              const RadiationOptions& options = {}, const IterationCallback& callback = {});

/// Drives to start from, N x 3: the field of sqrt(P') on the faces sent back, and two random ones. From any start the
/// cost ends within about four percent of the least that is known (docs/radiation.md).
Eigen::MatrixXcd radiation_starts(const RadiationProblem& problem);

}  // namespace touchfield
