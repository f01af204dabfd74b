#pragma once

#include <functional>
#include <string>
#include <vector>

#include "sim/bem/scattering_solver.h"
#include "sim/core/json.h"
#include "sim/core/progress.h"
#include "sim/field/metrics.h"
#include "sim/model/model.h"

namespace touchfield {

/// The ways of a study: every combination of these. Empty lists mean all there are.
struct StudyOptions {
  std::vector<double> edges;  // [m]; empty: 1.4, 1 and 0.7 times the scene's. A mesh from a file has its own alone
  std::vector<Scheme> schemes;
  std::vector<SolverKind> solvers;
  std::vector<Precision> precisions;
  double rung_seconds = 300;  // a way that is expected to take longer is skipped, with its status saying so
};

/// One way to solve a scene, and what it costs and gives. A number that was not computed is NaN.
struct StudyRung {
  std::string scheme;
  double edge_mm = kNotComputed;  // body.edge_mm; of a mesh from a file its mean edge
  Eigen::Index faces = 0;
  std::string precision;
  std::string solver;
  double seconds = kNotComputed;
  double peak_mib = kNotComputed;         // largest memory [MiB]
  double error_reference = kNotComputed;  // relative, against the reference solution
  double error_interior = kNotComputed;   // relative, rms of the interior-source indicator
  double pattern_error = kNotComputed;    // relative, after the best scale
  bool pareto = false;                    // no rung is both as fast and as exact, and better in one
  std::string status = "ok";              // or why it has no numbers
};

/// A rung by the names of its members: a line of study.csv and of Python's table.
Json rung_value(const StudyRung& rung);

struct Study {
  std::string reference;  // what it compares with, in a sentence
  std::vector<StudyRung> rungs;
};

/// Solves a scene in every way of the options. The seconds of a rung cover setting up the scheme and solving the
/// scene's methods and their pressures on the skin. They do not cover meshing and files. The memory of a rung is the
/// largest of the process meanwhile.
///
///   error_reference   of the pressure that the array focused on the target makes, at the rung's centroids. The
///                     reference is burton_miller_polished on a mesh of 0.6 times the finest edge (of a file's mesh:
///                     every face in four)
///   error_interior    rms of the interior-source indicator over the body
///   pattern_error     relative_error of the scene's first method, evaluated on the reference; NaN without a target
///
/// chief has no iterative rungs, because no iterative solver suits its square form.
///
/// models    as study_models makes them
/// on_rung   called after each rung with all so far, so that no rung is lost
Study run_study(const Scene& scene, std::vector<Model> models, const StudyOptions& options, Progress& progress,
                const std::function<void(const Study&)>& on_rung);

/// The models of a study's edge lengths, the coarsest first, however coarse that is: it measures the error.
/// throws   InputError as build_model, or on options that leave no rung or do not fit the scene
std::vector<Model> study_models(Scene scene, const StudyOptions& options);

}  // namespace touchfield
