#include "sim/model/warnings.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <optional>

#include <fmt/format.h>

#include "sim/acoustics/array_geometry.h"
#include "sim/core/text.h"
#include "sim/core/units.h"
#include "sim/mesh/query/inspect.h"
#include "sim/mesh/query/self_intersections.h"
#include "sim/mesh/remesh/mesh_quality.h"
#include "sim/mesh/topology.h"
#include "sim/model/array_view.h"
#include "sim/model/clear_transducers.h"
#include "sim/model/evaluation_comparison.h"

namespace touchfield {

namespace {

constexpr double kFewestEdges = 3.0;       // a wavelength, by the mean face
constexpr double kFewestNearTarget = 2.5;  // on all but a twentieth of the target's surroundings
constexpr double kFewestAnywhere = 2.0;    // on all but a twentieth of the skin
constexpr double kSmallestAngle = 10.0 * kDegree;
constexpr double kLargestJump = 3.0;
constexpr double kNearestParts = 1.0;    // edges
constexpr double kThinnestBody = 2.0;    // edges: at one, the dark side of a plate is 11 % off
constexpr double kNearestSource = 1.0;   // edges
constexpr double kLargestOpposed = 0.1;  // share of the target

std::string at(const Vector3& point) { return "at " + place_text(point); }

/// The transducer that is nearest to the skin, counted in edges of the face it is nearest to.
void warn_of_near_source(const Model& model, Remarks& remarks) {
  const TriangleMesh& mesh = model.body.mesh;
  const Eigen::VectorXd edges = (4.0 / std::sqrt(3.0) * mesh.areas()).cwiseSqrt();
  if (model.fixed->array.kind == TransducerArray::Kind::kPlaneWave ||
      lies_apart(model.fixed->array, mesh, kNearestSource * edges.maxCoeff())) {
    return;
  }
  double least = std::numeric_limits<double>::infinity();
  Eigen::Index nearest = 0;
  for (Eigen::Index n = 0; n < model.fixed->array.size(); ++n) {
    const double distance = ((mesh.centroids().colwise() - model.fixed->array.positions.col(n))
                                 .colwise()
                                 .norm()
                                 .transpose()
                                 .cwiseQuotient(edges))
                                .minCoeff();
    if (distance < least) {
      least = distance;
      nearest = n;
    }
  }
  if (least < kNearestSource) {
    remarks.warnings.push_back(
        fmt::format("near_source: transducer {} is {:.2f} edges from the skin; its field is sampled once per face, "
                    "which needs at least {:.0f}",
                    nearest, least, kNearestSource));
  }
}

/// Transducers are made to radiate ahead of them; what their directivity says of the half space behind was not
/// measured.
void warn_of_body_behind(const Model& model, Remarks& remarks) {
  const TransducerArray& array = model.fixed->array;
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
    remarks.warnings.push_back(
        fmt::format("behind_array: {} of {} transducers point away from the {}, {}; their radiation backwards was "
                    "never measured: turn the array with array.rotate_deg, or move it or the body",
                    behind, array.size(), model.boxes.empty() ? "body" : "target", at(middle)));
  }
}

void warn_of_crossings(const TriangleMesh& mesh, Remarks& remarks) {
  constexpr std::size_t kMost = 1000;
  const auto pairs = self_intersections(mesh, kMost);
  if (!pairs.empty()) {
    remarks.warnings.push_back(
        fmt::format("cutting_faces: {}; no scheme can tell there which side is air: `touchfield mesh --resurface` or "
                    "body.mesh.resurface_mm makes one skin of them",
                    self_intersections_text(mesh, pairs, kMost)));
  }
}

/// What a mesh of so many edges per wavelength is good for.
std::string worth(double resolution) {
  if (resolution < kFewestSolved) {
    return "pressures there are meaningless";
  }
  if (resolution < kFewestAnywhere) {
    return "expect errors of 10 % and more, and several times that in the shadow of the body: such a mesh is for "
           "trials, not for results (check --accuracy measures the error on this mesh)";
  }
  return "the pressure of any scheme is an estimate (check --accuracy measures the error on this mesh)";
}

/// Whether the mesh counts near the target alone: where it finds phases that are then evaluated on bodies meshed again.
bool counts_near_target(const Model& model, const std::optional<Target>& target) {
  return target && evaluates_own_bodies(model);
}

/// `near` counts: the evaluation resolves the rest of the skin.
void warn_of_coarse_surroundings(const Resolution& near, Remarks& remarks) {
  const bool few = near.mean < kFewestEdges;
  if (few || near.least_5 < kFewestAnywhere) {
    remarks.warnings.push_back(
        fmt::format("coarse_mesh: {:.2f} edges per wavelength {}within {:.0f} mm of the target; below {}: {}",
                    few ? near.mean : near.least_5, few ? "" : "on a twentieth of the skin ",
                    kTargetReach / kMillimetre, few ? kFewestEdges : kFewestAnywhere, worth(near.mean)));
  }
}

void warn_of_coarse_mesh(const Model& model, const std::optional<Target>& target, Remarks& remarks) {
  const TriangleMesh& mesh = model.body.mesh;
  const double wavelength = model.fixed->wave.wavelength();
  const Resolution all = mesh_quality(mesh, wavelength).resolution;
  const std::optional<Resolution> near =
      target ? resolution_where(mesh, wavelength, target_surroundings(mesh, target->faces)) : std::nullopt;
  if (near && counts_near_target(model, target)) {
    warn_of_coarse_surroundings(*near, remarks);
    return;
  }
  std::string where;
  if (all.mean < kFewestEdges) {
    where = fmt::format("{:.2f} edges per wavelength; below {:.0f}", all.mean, kFewestEdges);
  } else if (all.least_5 < kFewestAnywhere) {
    where = fmt::format("{:.2f} edges per wavelength on a twentieth of the skin; below {:.0f}", all.least_5,
                        kFewestAnywhere);
  } else if (near && near->least_5 < kFewestNearTarget) {
    where =
        fmt::format("{:.2f} edges per wavelength on a twentieth of the skin within {:.0f} mm of the target; below {}",
                    near->least_5, kTargetReach / kMillimetre, kFewestNearTarget);
  }
  if (near && near->mean < kFewestSolved) {
    where = fmt::format("{:.2f} edges per wavelength within {:.0f} mm of the target; below {}", near->mean,
                        kTargetReach / kMillimetre, kFewestSolved);
  }
  if (!where.empty()) {
    const double worst = near ? std::min(all.mean, near->mean) : all.mean;
    remarks.warnings.push_back(fmt::format("coarse_mesh: {}: {}", where, worth(worst)));
  }
}

/// The faces near the target.
TriangleMesh surroundings(const TriangleMesh& mesh, const Target& target) {
  const std::vector<unsigned char> near = target_surroundings(mesh, target.faces);
  return {mesh.vertices(),
          faces_where(mesh.triangles(), [&](Eigen::Index f) { return near[static_cast<std::size_t>(f)] != 0; })};
}

void note_landmarks(const BodyPlan& plan, Remarks& remarks) {
  for (const GivenLandmark& landmark : plan.landmarks) {
    if (landmark.off >= kNotedLandmarkOff) {
      remarks.notes.push_back(
          fmt::format("landmark_off: {}; that point is used: check the landmark and the file's unit", landmark.text));
    }
  }
}

void warn_of_both_sides(const TriangleMesh& mesh, const Target& target, Remarks& remarks) {
  const OppositeSides sides = opposite_sides(mesh, target);
  if (sides.share > kLargestOpposed) {
    remarks.warnings.push_back(
        fmt::format("both_sides: {:.0f} % of the target is on two opposite sides of {:.1f} mm of a body, e.g. {}; "
                    "sound reaches only one of them: make the box thinner, or move it",
                    100.0 * sides.share, sides.thickness / kMillimetre, at(sides.at)));
  }
}

/// A pattern fits the mesh that it was found on, errors included.
void note_own_evaluation(const Model& model, double mean_resolution, Remarks& remarks) {
  const Scene& scene = model.fixed->scene;
  const bool found = std::ranges::any_of(
      scene.solve.methods, [](const MethodSpec& method) { return method.kind->model != MethodModel::kGiven; });
  if (scene.target && found && scene.evaluation.kind == EvaluationSpec::Kind::kSame && !evaluated_elsewhere(model)) {
    remarks.notes.push_back(fmt::format(
        "evaluated_by_itself: the pattern is evaluated by {} on the mesh on which it was found, with {:.2f} edges per "
        "wavelength. It is fitted to the errors of this mesh too; evaluation: {{scheme, edge_mm}} uses another mesh",
        to_string(scene.solve.scheme), mean_resolution));
  }
}

/// What keep_within leaves out, and how it counts.
void remark_on_part(const Model& model, Remarks& remarks) {
  constexpr double kShadowed = 0.05;
  double radius = std::numeric_limits<double>::infinity();
  for (const int body : model.fixed->cut) {
    radius = std::min(radius, *model.posture.bodies[static_cast<std::size_t>(body)].keep_within / kMillimetre);
  }
  if (!model.beyond.empty()) {
    remarks.notes.push_back(
        fmt::format("beyond: scattering is solved within {:.4g} mm of the target. The phases include the rest of the "
                    "skin by its incident pressure at {} points, and the evaluation mesh has all of it",
                    radius, model.beyond.size()));
  }
  const auto ends_at_the_wrist = [](const BodySpec& body) {
    const auto* hand = std::get_if<HandShape>(&body.shape);
    return hand != nullptr && hand->forearm == 0;
  };
  if (model.posture.target && std::ranges::any_of(model.posture.bodies, ends_at_the_wrist)) {
    remarks.notes.emplace_back(
        "no_arm: the hand ends behind the wrist. Sound that the phases keep off the hand goes where an arm would be: "
        "body.hand.forearm_mm: 250 adds one");
  }
  if (model.fixed->shadowed > kShadowed) {
    remarks.warnings.push_back(
        fmt::format("shadowed_skin: another body is between the array and {:.0f} % of the skin beyond keep_within_mm. "
                    "The incident pressure is wrong there: leave keep_within_mm out",
                    100.0 * model.fixed->shadowed));
  }
}

}  // namespace

void add(const Remarks& more, Remarks& remarks) {
  remarks.warnings.insert(remarks.warnings.end(), more.warnings.begin(), more.warnings.end());
  remarks.notes.insert(remarks.notes.end(), more.notes.begin(), more.notes.end());
}

Remarks model_remarks(const Model& model) {
  Remarks remarks = played_remarks(model);
  if (model.fixed->scene.motion) {
    remarks.notes.insert(
        remarks.notes.begin(),
        "still: `run` ignores the scene's motion and uses its other keys as they are; `play` plays the motion");
  }
  return remarks;
}

Remarks played_remarks(const Model& model) {
  const TriangleMesh& mesh = model.body.mesh;
  const auto target =
      model.posture.target && hold_faces(mesh, model.boxes) ? std::optional(build_target(model)) : std::nullopt;
  Remarks remarks{model.plan.warnings, {}};
  warn_of_crossings(mesh, remarks);
  warn_of_coarse_mesh(model, target, remarks);
  const MeshRisks risks = mesh_risks(counts_near_target(model, target) ? surroundings(mesh, *target) : mesh);
  if (risks.smallest_angle < kSmallestAngle) {
    remarks.warnings.push_back(
        fmt::format("slivers: a face has an angle of {:.2f} degrees {}; it should have {:.0f} or more",
                    risks.smallest_angle / kDegree, at(risks.angle_at), kSmallestAngle / kDegree));
  }
  if (risks.size_jump > kLargestJump) {
    remarks.warnings.push_back(fmt::format(
        "size_jump: two faces that share an edge differ {:.1f} times in size {}; it should be {:.0f} at most",
        risks.size_jump, at(risks.jump_at), kLargestJump));
  }
  if (risks.gap < kNearestParts) {
    remarks.warnings.push_back(
        fmt::format("narrow_gap: two parts of the skin are {:.2f} edges of air apart {}; the gap needs edges no longer "
                    "than its width",
                    risks.gap, at(risks.gap_at)));
  }
  if (risks.thickness < kThinnestBody) {
    remarks.warnings.push_back(
        fmt::format("thin_body: the body is {:.2f} edges thick {}; its two sides need edges no longer than that",
                    risks.thickness, at(risks.thickness_at)));
  }
  std::ranges::copy(array_warnings(model.fixed->array, model.fixed->wave.wavelength()),
                    std::back_inserter(remarks.warnings));
  warn_of_body_behind(model, remarks);
  warn_of_near_source(model, remarks);
  if (target) {
    warn_of_both_sides(mesh, *target, remarks);
  }
  const ArrayView view = array_view(model);
  if (std::string warning = facing_warning(view); !warning.empty()) {
    remarks.warnings.push_back(std::move(warning));
  }
  note_landmarks(model.plan, remarks);
  if (std::string note = near_field_note(view, model); !note.empty()) {
    remarks.notes.push_back(std::move(note));
  }
  note_own_evaluation(model, edges_per_wavelength(mesh, model.fixed->wave.wavelength()), remarks);
  remark_on_part(model, remarks);
  return remarks;
}

}  // namespace touchfield
