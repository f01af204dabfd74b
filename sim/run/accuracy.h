#pragma once

#include <string>
#include <vector>

#include "sim/core/json.h"
#include "sim/core/progress.h"
#include "sim/model/model.h"

namespace touchfield {

/// Errors of several solutions, over a part of the skin: area-weighted relative L2 of complex p.
struct ErrorSummary {
  double worst = 0;
  double rms = 0;
};

/// How accurate a scheme is on one very mesh.
struct AccuracyReport {
  std::string scheme;
  int sources = 0;          // point sources inside the body
  double reach = 0;         // of the target's surroundings [m]
  ErrorSummary body;        // the indicator: sources' fields against what the scheme makes of them
  ErrorSummary target;      // over the faces within reach of the target; NaN without one
  double split_body = 0;    // difference from the same scheme with every face split in four, of the field of the array
  double split_target = 0;  // focused on the target; NaN where that was not affordable, split_reason says why
  std::string split_reason;
  double residual = 0;  // of the worst solve
  double seconds = 0;
};

/// The edge length at which an error would fall to a wanted one [m]: the schemes are of first order in it.
double edge_for_error(double edge, double error, double wanted);

/// Sources of the indicator are seeded: the same mesh gives the same figures.
///
/// throws   InputError if the body is nowhere deep enough for sources at this mesh
AccuracyReport measure_accuracy(const Model& model, Progress& progress);

/// The indicator alone.
AccuracyReport interior_indicator(const Model& model, Scheme scheme, const SolverSpec& spec, Progress& progress);

/// Adds the report to what `check` says, with edge lengths for errors of 5, 2 and 1 %, of first order.
///
/// edge   mean of the mesh [m]
void add_accuracy(Json& check, const AccuracyReport& report, double edge);

/// Drives that focus the array on the target (or on the skin nearest to it) as if there were no body, N x 1.
Eigen::VectorXcd free_focus(const Model& model);

}  // namespace touchfield
