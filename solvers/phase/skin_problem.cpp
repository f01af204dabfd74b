#include "solvers/phase/skin_problem.h"

#include <limits>
#include <stdexcept>
#include <string>

namespace touchfield {

namespace {

void require(bool holds, const char* who, const char* rule) {
  if (!holds) {
    throw std::invalid_argument(std::string(who) + ": " + rule);
  }
}

}  // namespace

void require_valid(const SkinProblem& problem, const char* who) {
  const Eigen::Index faces = problem.target_count();
  const Eigen::Index channels = problem.channel_count();
  require(faces > 0 && channels > 0, who, "the problem needs at least one target face and one channel");
  require(problem.amplitudes.size() == faces && problem.weights.size() == faces, who,
          "amplitudes and weights must hold one value for each row of target");
  require(problem.outside.rows() == 0 || problem.outside.cols() == channels, who,
          "outside must have as many columns as target");
  // LAPACK counts in int; the small system has K + 2 r rows.
  require(faces + 2 * problem.outside.rows() <= std::numeric_limits<int>::max() &&
              channels <= std::numeric_limits<int>::max() / 2,
          who, "the problem has too many rows or channels");
  const bool finite =
      problem.device
          ? Eigen::Map<const Eigen::VectorXd>(problem.device->reach(), faces + problem.outside.rows()).allFinite()
          : problem.target.allFinite() && problem.outside.allFinite();
  require(finite, who, "target or outside holds a value that is not finite");
  require(problem.amplitudes.allFinite() && (problem.amplitudes.array() >= 0).all(), who,
          "amplitudes must be finite and >= 0");
  require(problem.weights.allFinite() && (problem.weights.array() > 0).all(), who, "weights must be finite and > 0");
}

void move_to(PhaseDevice& device, SkinProblem& problem) {
  problem.device = device.skin(problem.target.data(), static_cast<int>(problem.target.rows()), problem.outside.data(),
                               static_cast<int>(problem.outside.rows()), static_cast<int>(problem.channel_count()));
}

}  // namespace touchfield
