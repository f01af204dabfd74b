#include "sim/model/warnings.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <variant>

#include <fmt/format.h>

#include "sim/acoustics/array_geometry.h"
#include "sim/core/text.h"
#include "sim/core/units.h"
#include "sim/mesh/query/clearance.h"
#include "sim/mesh/query/inspect.h"
#include "sim/mesh/query/self_intersections.h"
#include "sim/mesh/remesh/mesh_quality.h"
#include "sim/mesh/topology.h"
#include "sim/model/clear_transducers.h"
#include "sim/model/evaluation.h"
#include "sim/model/meshed_body.h"
#include "sim/model/scene_slips.h"

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
  const TriangleMesh& mesh = model.body.mesh;
  Vector3 middle = mesh.centroids() * mesh.areas() / mesh.total_area();
  if (!model.boxes.empty()) {
    middle.setZero();
    for (const TargetBox& box : model.boxes) {
      middle += box.centre / static_cast<double>(model.boxes.size());
    }
  }
  const Eigen::Index behind = count_behind(array, middle);
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

/// "coarse_mesh: PLACE has 2.10 edges per wavelength, 3 are needed. CONSEQUENCE. REMEDY".
std::string coarse_text(const std::string& place, double found, double needed, double mean, double wavelength) {
  const char* worth = mean < kFewestSolved     ? "Pressures there are meaningless"
                      : mean < kFewestAnywhere ? "Pressures have errors of 10 % and more, several times that in shadow"
                                               : "Pressures are estimates";
  return fmt::format(
      "coarse_mesh: {} has {:.2f} edges per wavelength, {:g} are needed. {}. Use edges of {:.2g} mm or "
      "less there (body.edge_mm); `touchfield check SCENE --accuracy` measures the error",
      place, found, needed, worth, wavelength / needed / kMillimetre);
}

/// Whether the mesh counts near the target alone: where it finds phases that are then evaluated on bodies meshed again.
bool counts_near_target(const Model& model, const std::optional<Target>& target) {
  return target && model.fixed->evaluation.kind == Evaluation::Kind::kEdge;
}

void warn_of_coarse_mesh(const Model& model, const std::optional<Target>& target, Remarks& remarks) {
  const TriangleMesh& mesh = model.body.mesh;
  const double wavelength = model.fixed->wave.wavelength();
  const Resolution all = mesh_quality(mesh, wavelength).resolution;
  const std::optional<Resolution> near =
      target ? resolution_where(mesh, wavelength, target_surroundings(mesh, target->faces)) : std::nullopt;
  const std::string there = fmt::format("within {:.0f} mm of the target", kTargetReach / kMillimetre);
  const bool near_alone = near && counts_near_target(model, target);  // the evaluation resolves the rest of the skin
  const Resolution& counted = near_alone ? *near : all;
  const double worst = near ? std::min(counted.mean, near->mean) : all.mean;
  const auto warn = [&](const std::string& place, double found, double needed) {
    remarks.warnings.push_back(coarse_text(place, found, needed, worst, wavelength));
  };
  const std::string part = "5 % of the skin";
  if (near && near->mean < kFewestSolved) {
    warn("the skin " + there, near->mean, kFewestEdges);
  } else if (counted.mean < kFewestEdges) {
    warn(near_alone ? "the skin " + there : "the mesh", counted.mean, kFewestEdges);
  } else if (counted.least_5 < kFewestAnywhere) {
    warn(near_alone ? part + " " + there : part, counted.least_5, kFewestAnywhere);
  } else if (near && !near_alone && near->least_5 < kFewestNearTarget) {
    warn(part + " " + there, near->least_5, kFewestNearTarget);
  }
}

/// The faces near the target.
TriangleMesh surroundings(const TriangleMesh& mesh, const Target& target) {
  const std::vector<unsigned char> near = target_surroundings(mesh, target.faces);
  return {mesh.vertices(),
          faces_where(mesh.triangles(), [&](Eigen::Index f) { return near[static_cast<std::size_t>(f)] != 0; })};
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
  if (scene.target && found && model.fixed->evaluation.kind == Evaluation::Kind::kSame) {
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
  if (model.fixed->shadowed > kShadowed) {
    remarks.warnings.push_back(
        fmt::format("shadowed_skin: another body is between the array and {:.0f} % of the skin beyond keep_within_mm. "
                    "The incident pressure is wrong there: leave keep_within_mm out",
                    100.0 * model.fixed->shadowed));
  }
}

void note_forearms(const Model& model, Remarks& remarks) {
  const auto any_hand = [&](auto holds) {
    return std::ranges::any_of(model.posture.bodies, [&](const BodySpec& body) {
      const auto* hand = std::get_if<HandShape>(&body.shape);
      return hand != nullptr && holds(*hand);
    });
  };
  if (any_hand([](const HandShape& hand) { return hand.forearm == 0; })) {
    remarks.notes.push_back(
        std::string(kHandAlone) +
        "the hand has no forearm, and no figure counts the sound that would reach one. Use hand.forearm_mm: 250");
  }
  if (any_hand([](const HandShape& hand) { return !hand.forearm_given; })) {
    remarks.notes.push_back(
        fmt::format("forearm: the hand has {:g} mm of forearm, since the scene has no hand.forearm_mm. Release 0.3 "
                    "took a hand alone, which is hand.forearm_mm: 0",
                    kUsualForearm / kMillimetre));
  }
}

using Index = Eigen::Index;

constexpr double kAlike = 0.5;       // cosine between the axes of a part: 60 degrees
constexpr double kLeastShare = 0.1;  // of the pressure at the target
constexpr double kLeastSide = 0.3;   // length of a mean normal

/// Numbers of an array's transducers by the part that they belong to.
std::vector<std::vector<Index>> parts_of(const TransducerArray& array) {
  std::vector<Index> left(static_cast<std::size_t>(array.size()));
  for (std::size_t n = 0; n < left.size(); ++n) {
    left[n] = static_cast<Index>(n);
  }
  std::vector<std::vector<Index>> parts;
  while (!left.empty()) {
    const Vector3 mean = array.axes(Eigen::all, left).rowwise().sum();
    const Index first = *std::ranges::max_element(left, {}, [&](Index n) { return array.axes.col(n).dot(mean); });
    const Vector3 axis = array.axes.col(first);
    const auto others =
        std::stable_partition(left.begin(), left.end(), [&](Index n) { return array.axes.col(n).dot(axis) < kAlike; });
    parts.emplace_back(others, left.end());
    left.erase(others, left.end());
  }
  return parts;
}

/// The largest cosine between a vector and the directions from a point to the parts of an array.
double best_cosine(const TransducerArray& array, const std::vector<std::vector<Index>>& parts, const Vector3& at,
                   const Vector3& normal) {
  if (array.kind == TransducerArray::Kind::kPlaneWave) {
    return -normal.dot(array.axes.col(0));
  }
  std::vector<std::pair<double, double>> found;  // pressure, cosine
  double total = 0.0;
  for (const std::vector<Index>& part : parts) {
    Vector3 direction = Vector3::Zero();
    double pressure = 0.0;
    for (const Index n : part) {
      const Vector3 to = array.positions.col(n) - at;
      const double distance = to.norm();
      const double gain = array.response.as_designed() ? 1.0 : array.response.gain(n);
      const double made = gain * array.amplitudes(n) / distance *
                          std::abs(array.directivity.value(-to.dot(array.axes.col(n)) / distance));
      direction += made / distance * to;
      pressure += made;
    }
    if (direction.norm() > 0) {
      found.emplace_back(pressure, normal.dot(direction.normalized()));
    }
    total += pressure;
  }
  double best = -1.0;
  for (const auto& [pressure, cosine] : found) {
    best = pressure >= kLeastShare * total ? std::max(best, cosine) : best;
  }
  return best;
}

/// Box by box, those whose target has a side.
std::vector<BoxView> box_views(const Model& model, const Target& target) {
  const TriangleMesh& mesh = model.body.mesh;
  const std::vector<std::vector<Index>> parts = parts_of(model.fixed->array);
  const Eigen::VectorXd areas = target.areas(mesh.areas());
  std::vector<BoxView> views;
  for (std::size_t b = 0; b < model.boxes.size(); ++b) {
    double area = 0.0;
    Vector3 centre = Vector3::Zero();
    Vector3 normal = Vector3::Zero();
    std::vector<double> on_body(model.posture.bodies.size(), 0.0);
    for (std::size_t i = 0; i < target.faces.size(); ++i) {
      if (target.box[i] == static_cast<int>(b)) {
        const Index f = target.faces[i];
        const double on_face = areas(static_cast<Index>(i));
        area += on_face;
        centre += on_face * mesh.centroids().col(f);
        normal += on_face * mesh.normals().col(f);
        on_body[static_cast<std::size_t>(model.fixed->owner[static_cast<std::size_t>(f)])] += on_face;
      }
    }
    if (area > 0 && normal.norm() >= kLeastSide * area) {
      const auto body = static_cast<std::size_t>(std::ranges::max_element(on_body) - on_body.begin());
      const double cosine = best_cosine(model.fixed->array, parts, centre / area, normal.normalized());
      views.push_back({model.boxes[b].key, normal.norm() / area * cosine, std::acos(std::clamp(cosine, -1.0, 1.0)),
                       called(model.posture.bodies[body])});
    }
  }
  return views;
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
    remarks.warnings.push_back(fmt::format(
        "narrow_gap: a gap {} is {:.2g} mm wide, {:.2f} of the edges there. Pressures in it are unreliable. "
        "Use edges no longer than the gap is wide (body.edge_mm)",
        at(risks.gap_at), risks.gap * risks.gap_edge / kMillimetre, risks.gap));
  }
  if (risks.thickness < kThinnestBody) {
    remarks.warnings.push_back(
        fmt::format("thin_body: the body {} is {:.2g} mm thick, {:.2f} of the edges there. Pressures on its side in "
                    "shadow are unreliable. Use edges of half the thickness or less (body.edge_mm)",
                    at(risks.thickness_at), risks.thickness * risks.thickness_edge / kMillimetre, risks.thickness));
  }
  std::ranges::copy(array_warnings(model.fixed->array, model.fixed->wave.wavelength()),
                    std::back_inserter(remarks.warnings));
  std::ranges::move(scene_slips(model.fixed->scene, model.fixed->array, model.fixed->wave.wavelength(), mesh),
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
  for (const GivenLandmark& landmark : model.plan.landmarks) {
    if (landmark.off >= kNotedLandmarkOff) {
      remarks.notes.push_back(
          fmt::format("landmark_off: {}; that point is used: check the landmark and the file's unit", landmark.text));
    }
  }
  if (std::string note = near_field_note(view, model); !note.empty()) {
    remarks.notes.push_back(std::move(note));
  }
  note_own_evaluation(model, edges_per_wavelength(mesh, model.fixed->wave.wavelength()), remarks);
  remark_on_part(model, remarks);
  note_forearms(model, remarks);
  return remarks;
}

ArrayView array_view(const Model& model) {
  ArrayView view;
  if (presses(model)) {
    const std::vector<BoxView> boxes = box_views(model, build_target(model));
    const auto worst = std::ranges::min_element(boxes, {}, &BoxView::cosine);
    if (worst != boxes.end()) {
      view.worst = *worst;
    }
  }
  const double near = kNearField * model.fixed->wave.wavelength();
  if (model.fixed->array.kind == TransducerArray::Kind::kPlaneWave ||
      lies_apart(model.fixed->array, model.body.mesh, near)) {
    return view;
  }
  const std::vector<PointClearance> clearances = point_clearances(model.body.mesh, model.fixed->array.positions);
  const auto nearest = std::ranges::min_element(clearances, {}, &PointClearance::distance);
  view.transducer = nearest - clearances.begin();
  view.distance = nearest->distance;
  return view;
}

std::string facing_warning(const ArrayView& view) {
  if (!view.worst || view.worst->cosine >= kFacing) {
    return "";
  }
  const BoxView& worst = *view.worst;
  return fmt::format(
      "facing_away: the skin in {} is turned {:.0f} degrees away from the array, so the sound comes round the "
      "body. "
      "Turn the body with {}.place.rotate_deg, or press on its other side",
      worst.part, worst.angle / kDegree, worst.body);
}

std::string near_field_note(const ArrayView& view, const Model& model) {
  const double wavelengths = view.distance / model.fixed->wave.wavelength();
  if (!(wavelengths < kNearField)) {
    return "";
  }
  return fmt::format(
      "near_field: transducer {} is {:.1f} mm from the skin, {:.2f} wavelengths. Below {:.0f} the near fields of "
      "single transducers and reflections from the board matter. The model has point transducers and no board",
      view.transducer, view.distance / kMillimetre, wavelengths, kNearField);
}

}  // namespace touchfield
