#include "tests/hard/hard_support.h"

#include <cmath>
#include <cstdio>

#include <fmt/format.h>

#include "sim/mesh/remesh/subdivide.h"

namespace touchfield {

Wave wave_at(double frequency) { return {air(293.15), frequency}; }

TransducerArray omni_at(const Points& positions) {
  const Eigen::Index n = positions.cols();
  return make_array({positions, Vector3::UnitZ().replicate(1, n), Eigen::VectorXi::Zero(n), Eigen::VectorXi::Zero(n)},
                    Directivity::omni(), 1.0, 1.0);
}

SolverOptions usual_solver(Scheme scheme) {
  SolverOptions options;
  options.tolerance = 1e-6;  // what is measured here is the discretisation alone
  if (scheme != Scheme::kBurtonMiller && scheme != Scheme::kBurtonMillerPolished) {
    options.kind = SolverKind::kLu;
  }
  return options;
}

Answer answer(const TriangleMesh& mesh, const Wave& wave, const TransducerArray& array, Scheme scheme,
              const SolverOptions& options) {
  const ScatteringSystem system(mesh, wave, scheme);
  const IncidentField incident = system.incident(array, Eigen::MatrixXcd::Ones(array.size(), 1));
  const auto solver = make_solver(system, options);
  const Solved solved = solver->solve(system.right_hand_side(incident));
  return {system.pressure(solved.x, incident), solved.report, solver->reciprocal_condition()};
}

Answers answers(const TriangleMesh& mesh, const Wave& wave, const TransducerArray& array,
                const std::vector<Scheme>& schemes) {
  Answers all;
  for (const Scheme scheme : schemes) {
    all[scheme] = answer(mesh, wave, array, scheme, usual_solver(scheme));
  }
  return all;
}

Eigen::VectorXcd split_reference(const TriangleMesh& mesh, const Wave& wave, const TransducerArray& array, int times) {
  TriangleMesh fine = mesh;
  for (int i = 0; i < times; ++i) {
    fine = split_faces(fine);
  }
  Eigen::VectorXcd p =
      answer(fine, wave, array, Scheme::kBurtonMillerPolished, usual_solver(Scheme::kBurtonMillerPolished)).pressure;
  for (int i = 0; i < times; ++i) {
    p = Eigen::VectorXcd(p(Eigen::seqN(3, p.size() / 4, 4)));  // the middle face has its parent's centroid
  }
  return p;
}

double error(const Eigen::VectorXd& weights, const Eigen::VectorXcd& p, const Eigen::VectorXcd& exact) {
  return std::sqrt(weights.dot((p - exact).cwiseAbs2()) / weights.dot(exact.cwiseAbs2()));
}

double amplitude_error(const Eigen::VectorXd& weights, const Eigen::VectorXcd& p, const Eigen::VectorXcd& exact) {
  return error(weights, p.cwiseAbs().cast<Complex>(), exact.cwiseAbs().cast<Complex>());
}

double mean_amplitude(const Eigen::VectorXd& weights, const Eigen::VectorXcd& p) {
  return std::sqrt(weights.dot(p.cwiseAbs2()) / weights.sum());
}

Errors errors(const Eigen::VectorXd& weights, const Answers& answers, const Eigen::VectorXcd& exact) {
  Errors all;
  for (const auto& [scheme, answer] : answers) {
    all[scheme] = error(weights, answer.pressure, exact);
  }
  return all;
}

void print_errors(const std::string& what, const Errors& errors) {
  std::string line = what + ":";
  for (const auto& [scheme, value] : errors) {
    line += fmt::format(" {} {:.2f} %,", to_string(scheme), 100.0 * value);
  }
  line.back() = '\n';
  std::fputs(line.c_str(), stdout);
  std::fflush(stdout);
}

void print_steps(const std::string& what, const Answers& answers) {
  std::string line = what + ", steps:";
  for (const auto& [scheme, answer] : answers) {
    line += fmt::format(" {} {}{},", to_string(scheme), answer.report.steps,
                        answer.report.converged ? "" : fmt::format(" (residual {:.1e})", answer.report.residual));
  }
  line.back() = '\n';
  std::fputs(line.c_str(), stdout);
  std::fflush(stdout);
}

}  // namespace touchfield
