#pragma once

#include <functional>
#include <string>

#include "sim/acoustics/medium.h"
#include "sim/bem/scheme.h"
#include "sim/core/json.h"
#include "sim/core/progress.h"
#include "sim/mesh/triangle_mesh.h"
#include "sim/model/model.h"
#include "sim/run/solver_choice.h"

namespace touchfield {

/// What this machine does now, on all threads, for estimates: measured in a few hundredths of a second.

/// Seconds of one product without near corrections in single precision, one right-hand side.
double product_seconds(const TriangleMesh& mesh, const Wave& wave);

/// Floating-point operations per second, and what a reader of an estimate must know about them.
struct Speed {
  double flops = 0;
  std::string note;  // empty, or why this is a guess
};

/// The fastest of two trials of the given work: operations / seconds. Work that fails or takes no time that can be
/// measured gives a guess of 1e10 per thread and a note, never an error.
Speed speed_of(const std::function<void()>& work, double operations);

/// Rows of the largest LU that is timed: of about half a second.
inline constexpr double kTimedRows = 1600;

/// The speed of an LU of about that many rows, at most kTimedRows. An estimate thus takes no longer than the work that
/// it is for. Each size is measured once per process.
const Speed& measured_speed(double rows);

/// What one scattering model takes beside its mesh: its matrix, grid or Krylov space, near pairs, and its solves.
/// Estimates, within a factor of two.
struct ModelCost {
  double bytes = 0;
  double seconds = 0;
  std::string note;  // empty, or why the seconds are a guess
};

/// inside   CHIEF's points, chief_points(); 0 of other schemes
/// solves            right-hand sides, solved one after another
/// product           seconds of a direct product with D in single precision on this mesh (product_seconds)
/// body              body_cost() of this mesh
ModelCost scattering_cost(const SolverDecision& decision, Scheme scheme, double faces, double inside, double solves,
                          double product, const BodyCost& body);

/// Points inside the body that a CHIEF system will have, about: one a cube of the spacing in its volume.
double chief_points(const Model& model);

/// Errors of several solutions, over a part of the skin: area-weighted relative L2 of complex p.
struct ErrorSummary {
  double worst = 0;
  double rms = 0;
};

/// How accurate a scheme is on one very mesh.
struct AccuracyReport {
  std::string scheme;
  std::string solver;
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
