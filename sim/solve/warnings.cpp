#include "sim/solve/warnings.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "sim/core/place_text.h"
#include "sim/core/units.h"
#include "sim/mesh/query/mesh_risks.h"

namespace touchfield {

namespace {

constexpr double kFewestEdges = 3.0;  // a wavelength
constexpr double kSmallestAngle = 10.0 * kDegree;
constexpr double kLargestJump = 3.0;
constexpr double kNearestParts = 1.0;   // edges
constexpr double kThinnestBody = 2.0;   // edges: at one, the dark side of a plate is 11 % off
constexpr double kNearestSource = 1.0;  // edges
constexpr double kLargestAlarm = 0.1;
constexpr double kLargestAmplification = 2.0;

std::string at(const Vector3& point) { return "at " + place_text(point); }

/// The transducer that is nearest to the skin, counted in edges of the face it is nearest to.
void warn_of_near_source(const Model& model, std::vector<std::string>& warnings) {
  if (model.array.kind == TransducerArray::Kind::kPlaneWave) {
    return;
  }
  const TriangleMesh& mesh = model.body.mesh;
  const Eigen::VectorXd edges = (4.0 / std::sqrt(3.0) * mesh.areas()).cwiseSqrt();
  double least = std::numeric_limits<double>::infinity();
  Eigen::Index nearest = 0;
  for (Eigen::Index n = 0; n < model.array.size(); ++n) {
    const double distance =
        ((mesh.centroids().colwise() - model.array.positions.col(n)).colwise().norm().transpose().cwiseQuotient(edges))
            .minCoeff();
    if (distance < least) {
      least = distance;
      nearest = n;
    }
  }
  if (least < kNearestSource) {
    warnings.push_back(
        fmt::format("near_source: transducer {} is {:.2f} edges from the skin; its field is sampled once a face, which "
                    "needs at least {:.0f}",
                    nearest, least, kNearestSource));
  }
}

/// Transducers are made to radiate ahead of them; what their directivity says of the half space behind was not
/// measured.
void warn_of_body_behind(const Model& model, std::vector<std::string>& warnings) {
  const TransducerArray& array = model.array;
  if (array.kind == TransducerArray::Kind::kPlaneWave || array.directivity.kind() == Directivity::Kind::kOmni) {
    return;
  }
  const TriangleMesh& mesh = model.body.mesh;
  Vector3 middle = mesh.centroids() * mesh.areas() / mesh.total_area();
  if (!model.boxes.empty()) {
    middle.setZero();
    for (const TargetBox& box : model.boxes) {
      middle += box.centre / static_cast<double>(model.boxes.size());
    }
  }
  const Eigen::RowVectorXd ahead = array.axes.cwiseProduct((-array.positions).colwise() + middle).colwise().sum();
  const Eigen::Index behind = (ahead.array() <= 0).count();
  if (2 * behind > array.size()) {
    warnings.push_back(fmt::format(
        "behind_array: {} of {} transducers point away from the {}, {}; nobody measured what they radiate behind them: "
        "turn the array by array.rotate_deg, or move it or the body",
        behind, array.size(), model.boxes.empty() ? "body" : "target", at(middle)));
  }
}

}  // namespace

std::vector<std::string> model_warnings(const Model& model) {
  const TriangleMesh& mesh = model.body.mesh;
  std::vector<std::string> warnings = model.plan.warnings;
  const double epw = edges_per_wavelength(mesh, model.wave.wavelength());
  if (epw < kFewestEdges) {
    warnings.push_back(
        fmt::format("coarse_mesh: {:.2f} edges a wavelength; below {:.0f} the pressure of any scheme is an estimate "
                    "(check --accuracy measures it on this mesh)",
                    epw, kFewestEdges));
  }
  const MeshRisks risks = mesh_risks(mesh);
  if (risks.smallest_angle < kSmallestAngle) {
    warnings.push_back(fmt::format("slivers: a face has an angle of {:.2f} degrees {}; it should have {:.0f} or more",
                                   risks.smallest_angle / kDegree, at(risks.angle_at), kSmallestAngle / kDegree));
  }
  if (risks.size_jump > kLargestJump) {
    warnings.push_back(fmt::format(
        "size_jump: two faces that share an edge differ {:.1f} times in size {}; it should be {:.0f} at most",
        risks.size_jump, at(risks.jump_at), kLargestJump));
  }
  if (risks.gap < kNearestParts) {
    warnings.push_back(fmt::format(
        "narrow_gap: two parts of the skin are {:.2f} edges of air apart {}; what lies between them needs edges no "
        "longer than the gap",
        risks.gap, at(risks.gap_at)));
  }
  if (risks.thickness < kThinnestBody) {
    warnings.push_back(
        fmt::format("thin_body: the body is {:.2f} edges thick {}; its two sides need edges no longer than that",
                    risks.thickness, at(risks.thickness_at)));
  }
  warn_of_body_behind(model, warnings);
  warn_of_near_source(model, warnings);
  return warnings;
}

std::vector<std::string> result_warnings(const Run& run, Scheme scheme) {
  std::vector<std::string> warnings;
  for (const SolveRecord& solve : run.solves) {
    if (!solve.converged && solve.stage != "alarm") {
      warnings.push_back(fmt::format("not_converged: {}: scheme {} by {} reached a residual of {:.1e} in {} steps",
                                     solve.stage, solve.scheme, solve.solver, solve.residual, solve.steps));
    }
  }
  const bool plain = !traits(scheme).burton_miller && !traits(scheme).interior_points;
  if (plain && run.alarm > kLargestAlarm) {
    warnings.push_back(fmt::format(
        "fictitious_frequency: scheme {} differs from Burton-Miller by {:.1f} %: this body resonates inside "
        "near this frequency, or the mesh is too coarse",
        to_string(scheme), 100.0 * run.alarm));
  }
  if (run.target && !run.methods.empty() && run.methods.front().pressure.size() > 0) {
    const Eigen::VectorXd power = run.methods.front().pressure.cwiseAbs2();
    const Eigen::VectorXd& area = run.mesh.areas();
    double inside = 0.0;
    double inside_area = 0.0;
    for (const Eigen::Index f : run.target->faces) {
      inside += area(f) * power(f);
      inside_area += area(f);
    }
    const double amplification = std::sqrt(area.dot(power) / area.sum() / (inside / inside_area));
    if (amplification > kLargestAmplification) {
      warnings.push_back(
          fmt::format("deep_shadow: the target is {:.1f} times as quiet as the skin on average with method {}; errors "
                      "count that many times there",
                      amplification, run.methods.front().name));
    }
  }
  return warnings;
}

}  // namespace touchfield
