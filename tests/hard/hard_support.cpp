#include "tests/hard/hard_support.h"

#include <cmath>
#include <cstdio>

#include <fmt/format.h>

#include "sim/mesh/topology.h"

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

namespace {

constexpr double kSameSolution = 1e-4;  // of two solutions to 1e-6, whatever the condition

/// The preconditioner leaves the solution as it is, on any body.
void expect_same_on_two_levels(const TriangleMesh& mesh, const Wave& wave, const TransducerArray& array, Scheme scheme,
                               Answer& plain) {
  SolverOptions options = usual_solver(scheme);
  options.two_level = true;
  const Answer found = answer(mesh, wave, array, scheme, options);
  plain.two_level_steps = found.report.steps;
  if (plain.report.converged) {
    EXPECT_TRUE(found.report.converged);
    EXPECT_LT((found.pressure - plain.pressure).norm(), kSameSolution * plain.pressure.norm());
  }
}

}  // namespace

Answers answers(const TriangleMesh& mesh, const Wave& wave, const TransducerArray& array,
                const std::vector<Scheme>& schemes) {
  Answers all;
  for (const Scheme scheme : schemes) {
    all[scheme] = answer(mesh, wave, array, scheme, usual_solver(scheme));
    if (const SolveReport& report = all[scheme].report; !report.converged) {
      fmt::print("{} has not converged: residual {:.1e} after {} steps\n", to_string(scheme), report.residual,
                 report.steps);
    }
    if (traits(scheme).burton_miller) {
      expect_same_on_two_levels(mesh, wave, array, scheme, all[scheme]);
    }
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

std::string letters(Scheme scheme) {
  static const std::map<Scheme, std::string> all = {{Scheme::kPaper, "P"},
                                                    {Scheme::kPaperCorrected, "PC"},
                                                    {Scheme::kChief, "CH"},
                                                    {Scheme::kBurtonMiller, "BM"},
                                                    {Scheme::kBurtonMillerPolished, "BMP"}};
  return all.at(scheme);
}

namespace {

constexpr double kSame = 1e-4;  // of two solutions to 1e-6, whatever the condition

std::string in_percent(double value) {
  return fmt::format("{:.{}f}", 100 * value, value < 0.1 ? 2 : value < 1 ? 1 : 0);
}

}  // namespace

Cells mesh_cells(const TriangleMesh& mesh, const Wave& wave) {
  return {{"epw", fmt::format("{:.1f}", edges_per_wavelength(mesh, wave.wavelength()))},
          {"faces", fmt::to_string(mesh.face_count())}};
}

Cells scheme_cells(const std::vector<Errors>& figures) {
  Cells cells;
  for (const Scheme scheme : all_schemes()) {
    std::vector<std::string> shown;
    for (const Errors& figure : figures) {
      shown.push_back(figure.contains(scheme) ? in_percent(figure.at(scheme)) : "-");
    }
    cells.emplace_back(letters(scheme), fmt::format("{}", fmt::join(shown, " / ")));
  }
  return cells;
}

Cells step_cells(const Answers& answers) {
  const Answer& found = answers.at(Scheme::kBurtonMiller);
  return {{"steps of BM", fmt::to_string(found.report.steps)}, {"two levels", fmt::to_string(found.two_level_steps)}};
}

}  // namespace touchfield
