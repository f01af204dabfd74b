#include "sim/run/check.h"

#include <algorithm>
#include <cmath>
#include <set>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "sim/acoustics/array_geometry.h"
#include "sim/core/errors.h"
#include "sim/core/text.h"
#include "sim/core/units.h"
#include "sim/field/evaluate.h"
#include "sim/model/evaluation.h"
#include "sim/run/estimates.h"
#include "sim/run/methods.h"
#include "sim/run/result_warnings.h"

namespace touchfield {

namespace {

constexpr double kMebibyte = 1024.0 * 1024.0;
constexpr double kComplex = 16.0;  // bytes
// Operations of a product A^H A, of a Cholesky factorisation, times their sizes.
constexpr double kGramFlops = 4.0;
constexpr double kCholeskyFlops = 1.0 / 3.0;
constexpr double kSolvedBlocks = 6.5;  // b, p, what refines and polishes them: numbers a face and right-hand side
constexpr double kKernelCost = 10;  // of a kernel outside the solver, in double, over one pair of a product in single

/// Whether a method asks for the field of every channel.
bool drives_channels(const Scene& scene) {
  return scene.solve.optimality_bound || scene.write.transfer ||
         std::ranges::any_of(scene.solve.methods,
                             [](const MethodSpec& method) { return method.kind->model != MethodModel::kGiven; });
}

/// Right-hand sides solved one after another: the pressures that the methods make, the way from the target's centre,
/// trials of the best pressure.
double single_solves(const Scene& scene) {
  const std::vector<MethodSpec>& methods = scene.solve.methods;
  double solves = static_cast<double>(methods.size());
  const bool best = scene.target && !scene.target->pressure;
  if (best) {
    solves += methods.front().kind->iterates ? kScaleTrials : 1;
  }
  const bool centre =
      std::ranges::any_of(methods, [](const MethodSpec& method) { return method.kind->model == MethodModel::kCentre; });
  return solves + (centre || (best && methods.front().kind->iterates) ? 1.0 : 0.0);
}

int surface_iterations(const Scene& scene) {
  int iterations = 0;
  for (const MethodSpec& method : scene.solve.methods) {
    if (method.kind->counts_outside && !method.kind->radiation) {  // whose steps are two products
      iterations += method.iterations * method.start.restarts;
    }
  }
  return iterations;
}

/// Seconds of the resonance checks that a run raises: of its first method's scheme and of each without a cure.
double resonance_checks_seconds(const Scene& scene, double product, double spent) {
  std::set<Scheme> schemes = {scene.solve.methods.front().scheme};
  for (const MethodSpec& method : scene.solve.methods) {
    if (!has_cure(method.scheme)) {
      schemes.insert(method.scheme);
    }
  }
  double seconds = 0.0;
  for (const Scheme scheme : schemes) {
    const bool plain = !has_cure(scheme);
    const double resonance_check = resonance_check_seconds(plain, product);
    seconds += wants_resonance_check(scene.solve.solver.resonance_check, plain, resonance_check, spent)
                   ? resonance_check
                   : 0.0;
  }
  return seconds;
}

/// What the fields off the skin take.
struct FieldsCost {
  double bytes = 0;  // of all and of the largest grid that one goes through
  double pairs = 0;  // of points with channels or faces
};

/// faces   of the evaluation; 0: those that are solved
FieldsCost fields_cost(const Model& model, double faces) {
  FieldsCost cost;
  const auto methods = static_cast<double>(model.fixed->scene.solve.methods.size());
  double largest_grid = 0;
  for (const FieldGrid& grid : model.fixed->fields) {
    const auto points = static_cast<double>(grid.size());
    const Vector3 high =
        grid.origin + grid.spacing.cwiseProduct(Vector3(grid.count[0] - 1, grid.count[1] - 1, grid.count[2] - 1));
    const FieldSums sums =
        choose_field_sums(model.body.mesh, model.fixed->wave, {grid.origin, high, points, methods}, faces);
    cost.pairs += sums.pairs + points * static_cast<double>(model.fixed->array.size());
    cost.bytes += kComplex * points * methods;
    largest_grid = std::max(largest_grid, sums.grid ? sums.grid->memory : 0.0);
  }
  cost.bytes += largest_grid;
  return cost;
}

/// What is known without an estimate.
CheckReport sizes_of(const Model& model) {
  const Scene& scene = model.fixed->scene;
  CheckReport report;
  report.faces = model.body.mesh.face_count();
  report.channels = model.fixed->array.size();
  report.target_faces = scene.target ? build_target(model).size() : 0;
  report.epw_mean = edges_per_wavelength(model.body.mesh, model.fixed->wave.wavelength());
  report.epw_min = model.fixed->wave.wavelength() / model.fixed->report.longest_edge;
  report.quality = mesh_quality(model.body.mesh, model.fixed->wave.wavelength(), world_sizing(scene, model.plan));
  if (!model.boxes.empty()) {
    report.near_target =
        resolution_within(model.body.mesh, model.fixed->wave.wavelength(), model.boxes.front().centre, kTargetReach);
  }
  return report;
}

}  // namespace

CheckReport check_model(const Model& model, int sharing) {
  const Scene& scene = model.fixed->scene;
  CheckReport report = sizes_of(model);
  const auto m = static_cast<double>(report.faces);
  const auto n = static_cast<double>(report.channels);
  const auto k = static_cast<double>(report.target_faces);
  double iterations = 0;
  double optimisers = 0;
  for (const MethodSpec& method : scene.solve.methods) {
    if (method.kind->model == MethodModel::kScattered || method.kind->model == MethodModel::kFree) {
      iterations += method.iterations;
      ++optimisers;
    }
  }
  if (scene.target && !scene.target->pressure) {
    iterations += kScaleTrials * scene.solve.methods.front().iterations;
  }
  require_fitting_phases(model);
  const Scheme scheme = scene.solve.scheme;
  const double inside = traits(scheme).interior_points ? chief_points(model) : 0.0;
  report.available_mib = available_memory() / kMebibyte;
  GridBody body = grid_body(model.body.mesh);
  const BodyCost own_cost = body_cost(body, model.fixed->wave, scene.solve.solver);
  report.decision =
      choose_solver(scene.solve.solver, scheme, static_cast<Eigen::Index>(m), available_memory(),
                    sharing * largest_block(scene, scheme, model.fixed->array.size(), sharing > 1), own_cost);
  const double product = product_seconds(model.body.mesh, model.fixed->wave);
  const double kernel = kKernelCost * product / (m * m);
  // Of every channel's field: the pressure and, where the slope enters, that too; b of the optimisers beside them, or
  // while it is compressed twice over.
  const double drives = largest_block(scene, scene.solve.scheme, 2) > 1
                            ? expected_drives(model.body.mesh, model.fixed->array, model.fixed->wave.wavelength())
                            : 0;
  // GMRES solves the drives too, LU's solves are counted below.
  const double solves = single_solves(scene) + (report.decision.options.kind == SolverKind::kLu ? 0.0 : drives);
  const double evaluated = model.fixed->evaluation.faces(model);
  const ModelCost own = scattering_cost(report.decision, scheme, m, inside, solves, product, own_cost);
  const double fields = drives_channels(scene) ? (traits(scheme).burton_miller ? 2.0 : 1.0) : 0.0;
  const double gram = optimisers > 0 ? (k + n) * (k + n) : 0.0;
  const double kept =
      m * n * (fields + (optimisers > 0 && traits(scheme).burton_miller ? 1.0 : 0.0)) + 2.0 * m * k + 4.0 * gram;
  const double compressing = drives > 0 ? 2.0 * m * n + 2.0 * m * drives : 0.0;
  const double solving = own.bytes + kComplex * kSolvedBlocks * m * drives;
  double bytes = kComplex * kept + std::max(kComplex * compressing, solving);
  const FieldsCost off_skin = fields_cost(model, evaluated);
  bytes += off_skin.bytes;
  report.seconds = own.seconds + kernel * ((fields + 1.0) * m * n + off_skin.pairs);
  const double share = product_share(report.decision.options.kind, model.body.mesh.face_count(), own_cost.grid.seconds);
  report.seconds += resonance_checks_seconds(scene, share * product, own.seconds);
  report.note = own.note;
  const auto flops = [&] {
    const Speed& speed = measured_speed(m);
    report.note = speed.note;
    return speed.flops;
  };
  if (optimisers > 0) {
    report.seconds += (kGramFlops * m * n * n + kCholeskyFlops * iterations * std::pow(k + n, 3)) / flops();
  }
  if (drives > 0) {  // products with the field of every channel, LU's solves, steps of surface
    const double tried = static_cast<double>(surface_iterations(scene));
    report.seconds +=
        (4.0 * kGramFlops * m * n * drives + kGramFlops * m * m * drives + std::pow(k + 2.0 * drives, 2) * n * tried) /
        flops();
  }
  if (evaluated > 0) {
    body.faces = evaluated;
    const BodyCost evaluation_cost = body_cost(body, model.fixed->wave, {});
    const auto columns = static_cast<Eigen::Index>(scene.solve.methods.size());
    const SolverDecision evaluation =
        choose_solver({}, model.fixed->evaluation.scheme, static_cast<Eigen::Index>(evaluated), available_memory(),
                      columns, evaluation_cost);
    const double scale = std::pow(evaluated / m, 2);
    const ModelCost cost = scattering_cost(evaluation, model.fixed->evaluation.scheme, evaluated, 0.0, 1.0,
                                           scale * product, evaluation_cost);
    const auto methods = static_cast<double>(columns);
    bytes += cost.bytes + kComplex * evaluated * 4.0 * methods * 30.0;
    report.seconds += cost.seconds * (1.0 + 0.3 * (methods - 1.0)) + 2.0 * kernel * evaluated * n;
  }
  report.evaluation_faces = static_cast<Eigen::Index>(evaluated);
  report.memory_mib = bytes / kMebibyte + 100.0;
  return report;
}

void require_memory(const CheckReport& report) {
  if (report.available_mib > 0 && report.memory_mib > report.available_mib) {
    throw InputError(
        fmt::format("the body has {} faces, which need about {:.1f} GiB of memory; {:.1f} GiB are free: choose a "
                    "larger body.edge_mm",
                    report.faces, report.memory_mib / 1024.0, report.available_mib / 1024.0));
  }
}

Json check_value(const Model& model, const CheckReport& report, const Remarks& more) {
  const Scene& scene = model.fixed->scene;
  const MeshReport& mesh = model.fixed->report;
  const Wave& wave = model.fixed->wave;
  Json landmarks = Json::object();
  for (const GivenLandmark& landmark : model.plan.landmarks) {
    landmarks[landmark.name] = landmark.off / kMillimetre;
  }
  Json fields = Json::object();
  for (const FieldGrid& grid : model.fixed->fields) {
    fields[grid.name] = grid.size() == 1
                            ? place_text(grid.origin)
                            : fmt::format("{} x {} x {} points", grid.count[0], grid.count[1], grid.count[2]);
  }
  Remarks remarks = model_remarks(model);
  if (std::string warning = reach_warning(model); !warning.empty()) {
    remarks.warnings.push_back(std::move(warning));
  }
  add(more, remarks);
  const std::optional<EdgeFit>& fit = report.quality.edges;
  const std::optional<Resolution>& near = report.near_target;
  return {{"name", scene.name},
          {"medium", fmt::format("c {:.2f} m/s, rho {:.4f} kg/m3, absorption {:.3g} Np/m", wave.medium().sound_speed,
                                 wave.medium().density, wave.medium().absorption)},
          {"frequency_hz", wave.frequency()},
          {"wavelength_mm", wave.wavelength() / kMillimetre},
          {"array", describe_array(model.fixed->array)},
          {"channels", report.channels},
          {"faces", report.faces},
          {"vertices", mesh.vertices},
          {"components", mesh.components},
          {"area_cm2", mesh.area * 1e4},
          {"volume_cm3", mesh.volume * 1e6},
          {"edges_mm",
           {{"shortest", mesh.shortest_edge / kMillimetre},
            {"mean", model.body.mesh.mean_edge() / kMillimetre},
            {"longest", mesh.longest_edge / kMillimetre}}},
          {"smallest_angle_deg", mesh.smallest_angle / kDegree},
          {"angle_at_1_percent_deg", report.quality.smallest_angle_1 / kDegree},
          {"epw_mean", report.epw_mean},
          {"epw_min", report.epw_min},
          {"epw_near_target", near ? Json{{"mean", near->mean}, {"least", near->least}} : Json()},
          {"edges_as_asked", fit ? Json{{"share", fit->share},
                                        {"from", EdgeFit::kShortest},
                                        {"to", EdgeFit::kLongest},
                                        {"shortest", fit->shortest},
                                        {"longest", fit->longest}}
                                 : Json()},
          {"skin", "closed, manifold, outward: no faults"},
          {"faults", mesh.faults},
          {"mesh_notes", model.plan.notes},
          {"landmarks_off_mm", landmarks},
          {"target_faces", report.target_faces},
          {"target_boxes", model.boxes.size()},
          {"fields", fields},
          {"scheme", to_string(scene.solve.scheme)},
          {"solver", solver_name(report.decision.options.kind, report.decision.options.two_level)},
          {"precision", precision_name(report.decision.options)},
          {"solver_reason", report.decision.reason},
          {"evaluation_faces", report.evaluation_faces},
          {"evaluation", report.evaluation_faces > 0 ? to_string(model.fixed->evaluation.scheme) : ""},
          {"warnings", remarks.warnings},
          {"notes", remarks.notes},
          {"note", report.note},
          {"memory_mib", report.memory_mib},
          {"available_mib", report.available_mib},
          {"seconds", report.seconds}};
}

}  // namespace touchfield
