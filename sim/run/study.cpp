#include "sim/run/study.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <malloc.h>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "sim/core/errors.h"
#include "sim/core/units.h"
#include "sim/core/version.h"
#include "sim/mesh/topology.h"
#include "sim/model/evaluation.h"
#include "sim/run/estimates.h"
#include "sim/run/methods.h"

namespace touchfield {

namespace {

constexpr double kReferenceEdge = 0.6;  // of the finest rung's
constexpr double kMemoryShare = 0.9;    // of the free memory that a rung may be expected to take

/// NaN where the system does not say.
double peak_memory_mib() {
  std::ifstream status("/proc/self/status");
  std::string line;
  while (std::getline(status, line)) {
    if (line.rfind("VmHWM:", 0) == 0) {
      return std::stod(line.substr(6)) / 1024.0;
    }
  }
  return std::numeric_limits<double>::quiet_NaN();
}

/// Whether the bodies' faces are those of files, so that a study cannot choose their size.
bool from_file(const Scene& scene) {
  return std::none_of(scene.bodies.begin(), scene.bodies.end(), [](const BodySpec& body) { return body.edge; });
}

/// The finest edge of the first body that has one: what the rungs of a study are called by.
double named_edge(const Scene& scene) {
  const auto first = std::find_if(scene.bodies.begin(), scene.bodies.end(), [](const BodySpec& b) { return b.edge; });
  return first->edge->finest();
}

/// Every edge length in proportion, so that the finest of the first body becomes `edge`.
Scene with_edge(Scene scene, double edge) {
  if (!from_file(scene)) {
    const double factor = edge / named_edge(scene);
    for (BodySpec& body : scene.bodies) {
      if (body.edge) {
        body.edge = body.edge->scaled(factor);
        if (std::holds_alternative<HandShape>(body.shape)) {
          body.edge->far = std::min(body.edge->far, kMostHandEdge);
        }
      }
    }
  }
  return scene;
}

/// The finest converged solution: what every rung is held against.
class Reference {
 public:
  Reference(const Scene& scene, const Model& finest, double finest_edge, Progress& progress)
      : model_(finest),
        scattering_(mesh_of(scene, finest, finest_edge), finest.fixed->wave, Scheme::kBurtonMillerPolished,
                    SolverSpec{}, finest.fixed->array, records_, progress) {
    focus_ = scattering_.pressure(free_focus(finest), "reference");
    if (scene.target) {
      target_ = build_target(finest, mesh());
    }
  }

  const TriangleMesh& mesh() const { return scattering_.system().mesh(); }

  Eigen::VectorXcd focus_at(const TriangleMesh& other) const {
    return EvaluationComparison(other, mesh(), std::nullopt).at_centroids(focus_);
  }

  double pattern_error(const PhaseSolution& solution) {
    if (!target_) {
      return kNotComputed;
    }
    const Eigen::VectorXcd p = scattering_.pressure(drive(solution), "reference");
    return pattern_metrics(mesh(), model_.boxes, *target_, p).relative_error;
  }

 private:
  static TriangleMesh mesh_of(const Scene& scene, const Model& finest, double finest_edge) {
    if (from_file(scene)) {
      return split_faces(finest.body.mesh);
    }
    return build_bodies(with_edge(scene, kReferenceEdge * finest_edge), finest.plan, {}, Extent::kSolved).body.mesh;
  }

  const Model& model_;
  std::vector<SolveRecord> records_;
  SkinScattering scattering_;
  Eigen::VectorXcd focus_;
  std::optional<Target> target_;
};

/// What rungs of one scheme and one mesh share: it does not depend on how B p = b is solved.
struct Shared {
  double interior = kNotComputed;
  double pattern = kNotComputed;
};

SolverSpec spec_of(const Scene& scene, SolverKind solver, Precision precision) {
  SolverSpec spec = scene.solve.solver;
  spec.solver = solver == SolverKind::kLu      ? SolverChoice::kLu
                : solver == SolverKind::kGmres ? SolverChoice::kGmres
                : solver == SolverKind::kFft   ? SolverChoice::kFft
                                               : SolverChoice::kMatrixFree;
  spec.precision = precision == Precision::kSingle ? PrecisionChoice::kSingle : PrecisionChoice::kDouble;
  return spec;
}

/// Why a rung is not worth starting; empty if it is.
std::string reason_to_skip(const Model& model, Scheme scheme, const SolverSpec& spec, double limit) {
  const auto faces = static_cast<double>(model.body.mesh.face_count());
  const double inside = traits(scheme).interior_points ? chief_points(model) : 0.0;
  const BodyCost body = body_cost(grid_body(model.body.mesh), model.fixed->wave, spec);
  const SolverDecision decision =
      choose_solver(spec, scheme, static_cast<Eigen::Index>(faces), available_memory(), 1, body);
  const ModelCost cost =
      scattering_cost(decision, scheme, faces, inside, static_cast<double>(model.fixed->scene.solve.methods.size()),
                      product_seconds(model.body.mesh, model.fixed->wave), body);
  if (available_memory() > 0 && cost.bytes > kMemoryShare * available_memory()) {
    return fmt::format("skipped: needs about {:.1f} GiB", cost.bytes / std::pow(2.0, 30));
  }
  if (cost.seconds > limit) {
    return fmt::format("skipped: expected to take {:.2g} s", cost.seconds);
  }
  return "";
}

void require_rungs(const Scene& scene, const StudyOptions& options) {
  if (from_file(scene) && !options.edges.empty()) {
    throw InputError("study: a body from a mesh file without edge_mm has its own edges; leave --edges-mm out");
  }
  const auto& schemes = options.schemes;
  const auto& solvers = options.solvers;
  const bool chief_alone = schemes.size() == 1 && traits(schemes.front()).interior_points;
  if (chief_alone && !solvers.empty() && std::find(solvers.begin(), solvers.end(), SolverKind::kLu) == solvers.end()) {
    throw InputError("study: chief needs lu, which --solvers leaves out");
  }
}

/// The coarsest first.
std::vector<double> edges_of(const Scene& scene, const StudyOptions& options) {
  if (from_file(scene)) {
    return {0.0};
  }
  std::vector<double> edges = options.edges;
  if (edges.empty()) {
    const double own = named_edge(scene);
    edges = {1.4 * own, own, 0.7 * own};
  }
  std::sort(edges.begin(), edges.end(), std::greater<>());
  return edges;
}

/// A scene that asks for the best pressure gets one for all rungs, found on the coarsest mesh.
void find_pressure(const Scene& scene, std::vector<Model>& models, Progress& progress) {
  const Model& model = models.front();
  std::vector<SolveRecord> records;
  SkinScattering scattering(model.body.mesh, model.fixed->wave, Scheme::kBurtonMillerPolished, SolverSpec{},
                            model.fixed->array, records, progress);
  MethodSolver methods(scattering, model.fixed->array.size(), build_target(model), scene.solve, outside_skin(model));
  const double pressure = methods.best_scale(scene.solve.methods.front(), model.body.mesh, model.boxes, progress);
  for (Model& rung : models) {
    rung.posture.target->pressure = pressure;
  }
}

double indicator(Scheme scheme, const Model& model, Progress& progress) {
  SolverSpec solver = model.fixed->scene.solve.solver;
  solver.solver = SolverChoice::kAuto;
  solver.precision = PrecisionChoice::kAuto;
  try {
    return interior_indicator(model, scheme, solver, progress).body.rms;
  } catch (const InputError& error) {  // no room for sources in a thin body or a coarse mesh
    progress.warn(error.what());
    return kNotComputed;
  }
}

void solve_rung(const Scene& scene, const Model& model, Scheme scheme, const SolverSpec& spec,
                const Eigen::VectorXcd& expected, Reference& reference, Shared& shared, Progress& progress,
                StudyRung& rung) {
  const std::optional<Target> target = scene.target ? std::optional(build_target(model)) : std::nullopt;
  const Eigen::VectorXd amplitudes = target ? target->amplitudes : Eigen::VectorXd();
  std::vector<SolveRecord> records;
  // The largest resident memory is counted again; where the system cannot, it counts from the start of the process.
  malloc_trim(0);  // what is free goes back first, or it would count
  std::ofstream("/proc/self/clear_refs") << "5" << std::flush;
  const double start = steady_now();
  SkinScattering scattering(model.body.mesh, model.fixed->wave, scheme, spec, model.fixed->array, records, progress);
  scattering.allow_broken();
  MethodSolver methods(scattering, model.fixed->array.size(), target, scene.solve, outside_skin(model));
  std::optional<PhaseSolution> first;
  for (const MethodSpec& method : scene.solve.methods) {
    const PhaseSolution solution = methods.solve(method, amplitudes, progress);
    scattering.pressure(drive(solution), "study");
    first = first ? first : std::optional(solution);
  }
  rung.seconds = steady_now() - start;
  rung.peak_mib = peak_memory_mib();
  const Eigen::VectorXcd focus = scattering.pressure(free_focus(model), "study");
  rung.error_reference = relative_difference(model.body.mesh.areas(), focus, expected);
  if (std::ranges::any_of(records, [](const SolveRecord& solve) { return !solve.converged; })) {
    rung.status = fmt::format("not converged in {} steps", spec.max_steps);
  }
  if (std::isnan(shared.pattern)) {
    shared.pattern = reference.pattern_error(*first);
  }
  if (std::isnan(shared.interior)) {
    shared.interior = indicator(scheme, model, progress);
  }
  rung.pattern_error = shared.pattern;
  rung.error_interior = shared.interior;
}

template <typename Value>
std::vector<Value> listed(const std::vector<Value>& asked, const std::vector<Value>& all) {
  return asked.empty() ? all : asked;
}

/// Sets `pareto` of every rung: true if no other has at most its error_reference in at most its seconds, one of the two
/// smaller. A rung without both numbers is never marked.
void mark_pareto(std::vector<StudyRung>& rungs) {
  const auto has_both = [](const StudyRung& rung) {
    return std::isfinite(rung.seconds) && std::isfinite(rung.error_reference);
  };
  for (StudyRung& rung : rungs) {
    rung.pareto = has_both(rung) && std::ranges::none_of(rungs, [&](const StudyRung& other) {
                    return has_both(other) && other.seconds <= rung.seconds &&
                           other.error_reference <= rung.error_reference &&
                           (other.seconds < rung.seconds || other.error_reference < rung.error_reference);
                  });
  }
}

}  // namespace

std::vector<Model> study_models(Scene scene, const StudyOptions& options) {
  require_rungs(scene, options);
  scene.solve.allow_coarse_mesh = true;  // the error is what a study measures
  std::vector<Model> models;
  for (const double edge : edges_of(scene, options)) {
    models.push_back(build_model(with_edge(scene, edge)));
  }
  require_fitting_phases(models.front());
  return models;
}

Json rung_value(const StudyRung& rung) {
  return {{"scheme", rung.scheme},
          {"edge_mm", rung.edge_mm},
          {"faces", rung.faces},
          {"precision", rung.precision},
          {"solver", rung.solver},
          {"seconds", rung.seconds},
          {"peak_mib", rung.peak_mib},
          {"error_reference", rung.error_reference},
          {"error_interior", rung.error_interior},
          {"pattern_error", rung.pattern_error},
          {"pareto", rung.pareto},
          {"status", rung.status}};
}

Study run_study(const Scene& scene, std::vector<Model> models, const StudyOptions& options, Progress& progress,
                const std::function<void(const Study&)>& on_rung) {
  const std::vector<double> edges = edges_of(scene, options);
  auto start = steady_now();
  progress.begin("reference solution");
  Reference reference(scene, models.back(), edges.back(), progress);
  progress.end(steady_now() - start);
  Study study{
      fmt::format("{}, {} faces, edge {:.2f} mm, {:.1f} s", to_string(Scheme::kBurtonMillerPolished),
                  reference.mesh().face_count(), reference.mesh().mean_edge() / kMillimetre, steady_now() - start),
      {}};
  if (scene.target && !scene.target->pressure) {
    find_pressure(scene, models, progress);
  }
  const auto climb = [&](const Model& model, double edge, Scheme scheme, const SolverSpec& spec,
                         const Eigen::VectorXcd& expected, Shared& shared) {
    const SolverOptions chosen = choose_solver(spec, scheme, model.body.mesh.face_count(), 0.0).options;
    StudyRung rung{to_string(scheme), edge / kMillimetre, model.body.mesh.face_count(), precision_name(chosen),
                   to_string(chosen.kind)};
    if (const std::string reason = reason_to_skip(model, scheme, spec, options.rung_seconds); !reason.empty()) {
      rung.status = reason;
    } else {
      start = steady_now();
      progress.begin(fmt::format("{}, {} faces, {}, {}", rung.scheme, rung.faces, rung.solver, rung.precision));
      try {
        solve_rung(scene, model, scheme, spec, expected, reference, shared, progress, rung);
      } catch (const NumericalError& error) {
        rung.status = fmt::format("failed: {}", error.what());
      }
      progress.end(steady_now() - start);
    }
    study.rungs.push_back(std::move(rung));
    mark_pareto(study.rungs);
    on_rung(study);
  };
  for (std::size_t m = 0; m < models.size(); ++m) {
    const Model& model = models[m];
    const double edge = from_file(scene) ? model.body.mesh.mean_edge() : edges[m];
    const Eigen::VectorXcd expected = reference.focus_at(model.body.mesh);
    for (const Scheme scheme : listed(options.schemes, all_schemes())) {
      Shared shared;
      for (const SolverKind solver :
           listed(options.solvers, {SolverKind::kLu, SolverKind::kGmres, SolverKind::kMatrixFree, SolverKind::kFft})) {
        if (traits(scheme).interior_points && solver != SolverKind::kLu) {
          continue;
        }
        for (const Precision precision : listed(options.precisions, {Precision::kDouble, Precision::kSingle})) {
          climb(model, edge, scheme, spec_of(scene, solver, precision), expected, shared);
        }
      }
    }
  }
  return study;
}

}  // namespace touchfield
