#include "solvers/phase/incident_problem.h"

#include <cmath>
#include <stdexcept>

#include <Eigen/Cholesky>

#include "solvers/phase/levenberg_marquardt.h"

namespace touchfield {

namespace {

Eigen::VectorXcd unit_phasors(const Eigen::VectorXd& x) {
  Eigen::VectorXcd z(x.size());
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    z(i) = std::polar(1.0, x(i));
  }
  return z;
}

/// Re(conj(i z) .* v)
Eigen::VectorXd tangential_part(const Eigen::VectorXcd& z, const Eigen::VectorXcd& v) {
  return (z.conjugate().array() * v.array()).imag();
}

void require_valid(const IncidentProblem& problem, const Eigen::VectorXd& start,
                   const LevenbergMarquardtOptions& options) {
  if (problem.gram.rows() != problem.gram.cols() || problem.target_count < 0 ||
      problem.target_count > problem.gram.rows()) {
    throw std::invalid_argument("solve_incident: the gram matrix is not square or has fewer rows than targets");
  }
  if (start.size() != problem.gram.rows()) {
    throw std::invalid_argument("solve_incident: the start has another size than the problem");
  }
  if (!problem.gram.allFinite() || !start.allFinite()) {
    throw std::invalid_argument("solve_incident: the gram matrix or the start holds a value that is not finite");
  }
  if (options.iterations < 1 || !(options.initial_damping > 0) || !(options.gradient_tolerance >= 0) ||
      !(options.step_tolerance >= 0)) {
    throw std::invalid_argument("solve_incident: an option is out of range");
  }
}

}  // namespace

double incident_cost(const IncidentProblem& problem, const Eigen::VectorXd& x) {
  const Eigen::VectorXcd z = unit_phasors(x);
  return z.dot(problem.gram * z).real();
}

Eigen::VectorXd incident_half_gradient(const IncidentProblem& problem, const Eigen::VectorXd& x) {
  const Eigen::VectorXcd z = unit_phasors(x);
  return tangential_part(z, problem.gram * z);
}

Eigen::MatrixXd incident_normal_matrix(const IncidentProblem& problem, const Eigen::VectorXd& x) {
  const Eigen::VectorXcd z = unit_phasors(x);
  Eigen::MatrixXd normal(x.size(), x.size());
  for (Eigen::Index j = 0; j < x.size(); ++j) {
    normal.col(j) = (z.conjugate().array() * problem.gram.col(j).array() * z(j)).real();
  }
  return normal;
}

PhaseSolution solve_incident(const IncidentProblem& problem, const Eigen::VectorXd& start,
                             const LevenbergMarquardtOptions& options, const IterationCallback& callback) {
  require_valid(problem, start, options);
  Eigen::VectorXd x = start;
  Eigen::VectorXcd z = unit_phasors(x);
  Eigen::VectorXcd gram_z = problem.gram * z;
  double cost = z.dot(gram_z).real();

  PhaseSolution solution;
  solution.status = PhaseStatus::kIterationLimit;
  solution.cost_history.push_back(cost);

  Eigen::MatrixXd normal = incident_normal_matrix(problem, x);
  Eigen::VectorXd gradient = tangential_part(z, gram_z);
  MadsenDamping damping(x.size() > 0 ? options.initial_damping * normal.diagonal().maxCoeff() : 0.0);
  const auto is_flat = [&] { return gradient.cwiseAbs().maxCoeff() <= options.gradient_tolerance * std::abs(cost); };

  if (x.size() == 0 || is_flat()) {
    solution.status = PhaseStatus::kConverged;
  }
  while (solution.status == PhaseStatus::kIterationLimit && solution.iterations < options.iterations) {
    ++solution.iterations;
    Eigen::MatrixXd damped = normal;
    damped.diagonal().array() += damping.value();
    const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> cholesky(damped);
    bool accepted = false;
    if (cholesky.info() == Eigen::Success) {
      const Eigen::VectorXd step = cholesky.solve(-gradient);
      const Eigen::VectorXd candidate = x + step;
      const Eigen::VectorXcd candidate_z = unit_phasors(candidate);
      const Eigen::VectorXcd candidate_gram_z = problem.gram * candidate_z;
      const double candidate_cost = candidate_z.dot(candidate_gram_z).real();
      const double predicted = step.dot(damping.value() * step - gradient);
      const double gain = (cost - candidate_cost) / predicted;
      accepted = candidate_cost < cost && predicted > 0;
      if (accepted) {
        const bool tiny = step.norm() <= options.step_tolerance * (1.0 + x.norm());
        x = candidate;
        z = candidate_z;
        gram_z = candidate_gram_z;
        cost = candidate_cost;
        normal = incident_normal_matrix(problem, x);
        gradient = tangential_part(z, gram_z);
        damping.accept(gain);
        if (tiny || is_flat()) {
          solution.status = PhaseStatus::kConverged;
        }
      } else if (step.norm() <= options.step_tolerance * (1.0 + x.norm())) {
        solution.status = PhaseStatus::kConverged;  // the cost cannot be told from its minimum's any more
      }
    }
    if (!accepted) {
      damping.reject();
      if (solution.status == PhaseStatus::kIterationLimit && damping.exhausted()) {
        solution.status = PhaseStatus::kStalled;
      }
    }
    solution.cost_history.push_back(cost);
    if (callback) {
      callback(solution.iterations, cost);
    }
  }
  solution.phases = wrapped(x.tail(problem.channel_count()));
  solution.amplitudes = Eigen::VectorXd::Ones(problem.channel_count());
  return solution;
}

}  // namespace touchfield
