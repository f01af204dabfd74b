#include "sim/model/bodies.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <utility>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/require.h"
#include "sim/core/text.h"
#include "sim/core/units.h"
#include "sim/field/target.h"
#include "sim/mesh/query/clearance.h"
#include "sim/mesh/query/inspect.h"
#include "sim/mesh/remesh/cut.h"
#include "sim/scene/scene_reader.h"

namespace touchfield {

namespace {

constexpr double kNearestSkin = 0.5;  // of keep_within: farther from its centre kept_within finds none

/// What is known of a body before it is meshed as it is asked for.
class Locator {
 public:
  explicit Locator(const BodySpec& spec, KeptBodies* kept = nullptr) : spec_(spec), kept_(kept) {}

  /// A landmark in the body's own frame.
  Vector3 landmark(const std::string& name) {
    if (const auto* shape = std::get_if<HandShape>(&spec_.shape)) {
      const auto find = [&] { return hand_landmark(hand_options(*shape, HandOptions().edge), name); };
      return kept_ != nullptr ? kept_->landmark(shape_text(spec_) + name, find) : find();
    }
    return position(base().mesh, find_landmark(base(), name));
  }

  bool has(const std::string& name) {
    try {
      landmark(name);
      return true;
    } catch (const InputError&) {
      return false;
    }
  }

  const Body& base() {
    if (!base_) {
      base_ = plain_body(spec_, spec_.edge ? spec_.edge->finest() : 0.0, kept_);
    }
    return *base_;
  }

 private:
  const BodySpec& spec_;
  KeptBodies* kept_;
  std::optional<Body> base_;
};

/// Number of the body that a landmark's name means, and the name there.
std::pair<std::size_t, std::string> owner_of(const Scene& scene, std::vector<Locator>& locators,
                                             const std::string& name) {
  std::vector<std::size_t> owners;
  for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
    const std::string& body = scene.bodies[i].name;
    if (!body.empty() && name.rfind(body + ".", 0) == 0) {
      return {i, name.substr(body.size() + 1)};
    }
    if (scene.bodies.size() > 1 && locators[i].has(name)) {
      owners.push_back(i);
    }
  }
  if (scene.bodies.size() == 1) {
    return {0, name};
  }
  if (owners.size() == 1) {
    return {owners.front(), name};
  }
  throw InputError(owners.empty() ? fmt::format("no body has a landmark '{}'", name)
                                  : fmt::format("{1} bodies have a landmark '{0}'; say which: {2}.{3}", name,
                                                owners.size(), scene.bodies[owners.front()].name, name));
}

Vector3 to_world(const Placement& place, const Vector3& anchor, const Vector3& own) {
  return place.at + extrinsic_rotation(place.angles) * (own - anchor);
}

/// A mesh of several, one behind the other.
TriangleMesh joined(const std::vector<Body>& bodies) {
  Eigen::Index vertices = 0;
  Eigen::Index faces = 0;
  for (const Body& body : bodies) {
    vertices += body.mesh.vertex_count();
    faces += body.mesh.face_count();
  }
  Points points(3, vertices);
  Triangles triangles(3, faces);
  vertices = faces = 0;
  for (const Body& body : bodies) {
    points.middleCols(vertices, body.mesh.vertex_count()) = body.mesh.vertices();
    triangles.middleCols(faces, body.mesh.face_count()) = body.mesh.triangles().array() + static_cast<int>(vertices);
    vertices += body.mesh.vertex_count();
    faces += body.mesh.face_count();
  }
  return {std::move(points), std::move(triangles)};
}

/// numbers   of the bodies in the scene
std::vector<Landmark> joined_landmarks(const Scene& scene, const std::vector<Body>& bodies,
                                       const std::vector<std::size_t>& numbers) {
  if (scene.bodies.front().name.empty()) {
    return bodies.front().landmarks;
  }
  std::map<std::string, int> count;
  for (const Body& body : bodies) {
    for (const Landmark& landmark : body.landmarks) {
      ++count[landmark.name];
    }
  }
  std::vector<Landmark> landmarks;
  Eigen::Index first = 0;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    for (Landmark landmark : bodies[i].landmarks) {
      landmark.face += first;
      const std::string name = landmark.name;
      landmark.name = scene.bodies[numbers[i]].name + "." + name;
      landmarks.push_back(landmark);
      if (count[name] == 1) {
        landmark.name = name;
        landmarks.push_back(landmark);
      }
    }
    first += bodies[i].mesh.face_count();
  }
  return landmarks;
}

/// What messages write behind "target" of what it consists of.
const char* boxes_of(const TargetSpec& target) {
  if (!target.points.empty() || !target.lines.empty() || target.mask) {
    return "";
  }
  return target.boxes.size() == 1 ? ".box" : ".boxes";
}

/// No skin of a body is where the target is.
[[noreturn]] void refuse_far_target(const Scene& scene, const BodyPlan& plan, std::size_t i,
                                    const TriangleMesh& whole) {
  const BodySpec& spec = scene.bodies[i];
  const double half = kNearestSkin * *spec.keep_within;
  const Vector3& centre = plan.bodies[i].kept_about;
  const Vector3 nearest = position(whole, nearest_landmark(whole, "", centre));
  const auto world = [&](const Vector3& own) { return place_text(to_world(spec.place, plan.bodies[i].anchor, own)); };
  throw InputError(
      fmt::format("target{}: no skin of {} within {:.4g} mm (half of keep_within_mm) of {} (scene coordinates); the "
                  "nearest is {:.1f} mm away at {}",
                  boxes_of(*scene.target), called(spec), half / kMillimetre, world(centre),
                  (nearest - centre).norm() / kMillimetre, world(nearest)));
}

/// Leaves out what is farther than keep_within from the target; marks what is left as skin or cap. A body that lies
/// beyond as a whole has no faces marked.
void keep_part(const Scene& scene, const BodyPlan& plan, std::size_t i, const EdgeSizing& sizing, MeshedBody& made) {
  Body& body = made.body;
  if (plan.targets.empty()) {
    throw InputError(called(scene.bodies[i]) + ".keep_within_mm needs a target, the scene has none");
  }
  const double radius = *scene.bodies[i].keep_within;
  const Vector3& centre = plan.bodies[i].kept_about;
  if (((body.mesh.vertices().colwise() - centre).cwiseAbs().array() < radius).all()) {
    return;
  }
  const Vector3 nearest = position(body.mesh, nearest_landmark(body.mesh, "", centre));
  if ((nearest - centre).norm() > kNearestSkin * radius) {
    if (plan.bodies[i].pressed) {
      refuse_far_target(scene, plan, i, body.mesh);
    }
    made.whole = body.mesh;
    made.skin.clear();
    return;
  }
  Body kept{kept_within(body.mesh, centre, radius, sizing), {}};
  kept.landmarks = carried_over(body, kept.mesh);
  made.whole = std::move(body.mesh);
  body = std::move(kept);
  made.skin.resize(static_cast<std::size_t>(body.mesh.face_count()));
  for (Eigen::Index f = 0; f < body.mesh.face_count(); ++f) {
    const double distance = cube_distance(body.mesh.centroids().col(f), centre);
    made.skin[static_cast<std::size_t>(f)] = distance < kUncut * radius ? 1 : 0;
  }
}

/// Adds points along the straight lines from point to point, at most `step` [m] apart.
void add_along(const std::vector<Vector3>& points, double step, std::vector<Vector3>& all) {
  all.push_back(points.front());
  for (std::size_t i = 1; i < points.size(); ++i) {
    const Vector3 way = points[i] - points[i - 1];
    const int steps = std::max(1, static_cast<int>(std::ceil(way.norm() / step)));
    for (int s = 1; s <= steps; ++s) {
      all.emplace_back(points[i - 1] + s * way / steps);
    }
  }
}

/// A point to 1 nm: a body that only moves has the same one in its own frame but for rounding.
std::string place_key(const Vector3& x) { return fmt::format("({:.9f} {:.9f} {:.9f})", x.x(), x.y(), x.z()); }

/// All that a body's mesh in its own frame follows from.
///
/// kept_about     centre of keep_within; null: the whole body
/// pressed        whether a place of the target is a landmark of the body
std::string meshing_key(const BodySpec& spec, const std::optional<EdgeSizing>& sizing, const Vector3* kept_about,
                        bool pressed) {
  std::string key = shape_text(spec);
  if (const auto* shape = std::get_if<MeshShape>(&spec.shape)) {
    key += file_state(shape->file);
  }
  if (sizing) {
    key += fmt::format(" far {} growth {}", sizing->far(), sizing->growth());
    for (const SizingZone& zone : sizing->zones()) {
      key += fmt::format(" {} {} {}", place_key(zone.centre), zone.edge, zone.within);
    }
  }
  if (kept_about != nullptr) {
    key += fmt::format(" kept {} {}{}", *spec.keep_within, place_key(*kept_about), pressed ? " near" : "");
  }
  return key;
}

/// The surfaces of the bodies that one mesh holds, one behind the other, by their numbers.
std::map<int, TriangleMesh> parted(const TriangleMesh& mesh, const std::vector<int>& owner) {
  std::map<int, TriangleMesh> parts;
  Eigen::Index faces = 0;
  Eigen::Index vertices = 0;
  while (faces < mesh.face_count()) {
    const auto begin = owner.begin() + faces;
    const Eigen::Index count = std::upper_bound(begin, owner.end(), *begin) - begin;
    Triangles triangles = mesh.triangles().middleCols(faces, count).array() - static_cast<int>(vertices);
    const Eigen::Index own = triangles.maxCoeff() + 1;
    parts.emplace(*begin, TriangleMesh(mesh.vertices().middleCols(vertices, own), std::move(triangles)));
    faces += count;
    vertices += own;
  }
  return parts;
}

}  // namespace

RigidMotion BodyPlan::own_frame(const Posture& scene, std::size_t body) const {
  const Placement& place = scene.bodies[body].place;
  const Eigen::Matrix3d back = extrinsic_rotation(place.angles).transpose();
  return {back, bodies[body].anchor - back * place.at};
}

void require_apart(const Posture& posture, const TriangleMesh& mesh, const std::vector<int>& owner) {
  constexpr double kLeast = 0.05 * kMillimetre;
  if (owner.front() == owner.back()) {
    return;
  }
  const std::map<int, TriangleMesh> bodies = parted(mesh, owner);
  for (auto one = bodies.begin(); one != bodies.end(); ++one) {
    for (auto other = std::next(one); other != bodies.end(); ++other) {
      const Clearance clearance = least_clearance(one->second, other->second);
      const auto name = [&](const auto& body) { return posture.bodies[static_cast<std::size_t>(body->first)].name; };
      const std::string pair = fmt::format("{} and {}", name(one), name(other));
      const std::string at = place_text(clearance.on_first, 2);
      require(clearance.meeting == Meeting::kApart, "bodies: {} {} near {}; move one by its place.at_mm", pair,
              clearance.meeting == Meeting::kCut ? "intersect" : "contain one another", at);
      if (clearance.distance < kLeast) {
        throw InputError(
            fmt::format("bodies: {} are {:.3f} mm apart near {}, they must be >= {} mm apart; "
                        "move one by its place.at_mm",
                        pair, clearance.distance / kMillimetre, at, kLeast / kMillimetre));
      }
    }
  }
}

BodyPlan plan_bodies(const Scene& scene, const std::function<Vector3(const TriangleMesh&)>& near_array,
                     KeptBodies* kept) {
  std::vector<Locator> locators;
  locators.reserve(scene.bodies.size());
  for (const BodySpec& spec : scene.bodies) {
    locators.emplace_back(spec, kept);
  }
  BodyPlan plan;
  for (const BodySpec& spec : scene.bodies) {
    if (std::holds_alternative<MeshShape>(spec.shape)) {
      check_unit(spec, plan.warnings);
      std::vector<std::string> notes;
      body_from_file(spec, kept, &notes);
      plan.notes.insert(plan.notes.end(), notes.begin(), notes.end());
    }
  }
  for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
    const std::string& landmark = scene.bodies[i].place.landmark;
    const auto* shape = std::get_if<MeshShape>(&scene.bodies[i].shape);
    BodyPlan::Entry entry;
    if (!landmark.empty()) {
      entry.anchor = locators[i].landmark(landmark);
    }
    if (shape != nullptr && !shape->landmarks.empty()) {
      std::ranges::move(given_landmarks(scene.bodies[i], locators[i].base().mesh), std::back_inserter(plan.landmarks));
    }
    plan.bodies.push_back(entry);
  }
  if (!scene.target) {
    return plan;
  }
  const auto world = [&](std::size_t i, const Vector3& own) {
    return to_world(scene.bodies[i].place, plan.bodies[i].anchor, own);
  };
  const auto position_of = [&](const TargetPlace& place) -> Vector3 {
    if (place.at.empty()) {
      return place.centre;
    }
    if (place.at == kNearestToArray) {
      std::vector<Body> bodies;
      for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
        const Placement& place = scene.bodies[i].place;
        bodies.push_back(placed(locators[i].base(), plan.bodies[i].anchor, place.at, place.angles));
      }
      return near_array(joined(bodies)) + place.offset;
    }
    const auto [i, name] = owner_of(scene, locators, place.at);
    plan.bodies[i].pressed = true;
    return world(i, locators[i].landmark(name)) + place.offset;
  };
  std::ranges::transform(scene.target->boxes, std::back_inserter(plan.targets), position_of);
  std::ranges::transform(scene.target->points, std::back_inserter(plan.targets), position_of);
  for (const TargetLineSpec& line : scene.target->lines) {
    std::vector<Vector3> points;
    std::ranges::transform(line.points, std::back_inserter(points), position_of);
    add_along(points, std::max(line.width, SkinStrokes::kLongest), plan.targets);
  }
  if (scene.target->mask) {
    require(scene.bodies.size() == 1, "target.mask_file: the scene has {} bodies, a mask needs the only one",
            scene.bodies.size());
    const MaskedPart part = masked_part(scene.bodies.front(), *scene.target->mask);
    plan.mask = part.box;
    plan.bodies.front().pressed = true;
    std::ranges::transform(part.places, std::back_inserter(plan.targets),
                           [&](const Vector3& own) { return world(0, own); });
  }
  Vector3 mean = Vector3::Zero();
  for (const Vector3& centre : plan.targets) {
    mean += centre / static_cast<double>(plan.targets.size());
  }
  for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
    plan.bodies[i].kept_about = plan.to_own(scene, i, mean);
  }
  return plan;
}

EdgeSizing sizing_of(const Scene& scene, const BodyPlan& plan, std::size_t body, const EdgeSpec& edge,
                     KeptBodies* kept) {
  const BodySpec& spec = scene.bodies[body];
  std::vector<SizingZone> zones;
  if (edge.near_target) {
    if (plan.targets.empty()) {
      throw InputError(called(scene.bodies[body]) + ".edge_mm.near_target needs a target, the scene has none");
    }
    for (const Vector3& centre : plan.targets) {
      zones.push_back({plan.to_own(scene, body, centre), *edge.near_target, edge.within});
    }
  }
  if (!edge.near.empty()) {
    Locator locator(spec, kept);
    for (const auto& [landmark, length] : edge.near) {
      if (scene.bodies.size() == 1 || locator.has(landmark)) {
        zones.push_back({locator.landmark(landmark), length, edge.within});
      }
    }
  }
  double far = edge.far;
  if (const auto* hand = std::get_if<HandShape>(&spec.shape); hand != nullptr && hand->forearm > 0 && edge.graded()) {
    far = std::min(kForearmEdge * far, kMostHandEdge);
    zones.push_back(hand_zone(hand->length, edge.far));
  }
  return EdgeSizing(far, std::move(zones), edge.growth);
}

std::optional<EdgeSizing> world_sizing(const Scene& scene, const BodyPlan& plan) {
  if (scene.bodies.size() != 1 || !scene.bodies.front().edge) {
    return std::nullopt;
  }
  const EdgeSizing own = sizing_of(scene, plan, 0, *scene.bodies.front().edge);
  std::vector<SizingZone> zones = own.zones();
  for (SizingZone& zone : zones) {
    zone.centre = to_world(scene.bodies.front().place, plan.bodies.front().anchor, zone.centre);
  }
  return EdgeSizing(own.far(), std::move(zones), own.growth());
}

PlacedBodies build_bodies(const Scene& scene, const BodyPlan& plan, const BodyEdges& edges, Extent extent,
                          KeptBodies* kept) {
  std::vector<Body> bodies;
  std::vector<std::size_t> numbers;  // of them
  std::vector<int> owner;
  std::vector<unsigned char> skin;
  std::vector<PlacedBodies::Whole> whole;
  for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
    const BodySpec& spec = scene.bodies[i];
    std::optional<EdgeSpec> own = edges.edge != nullptr ? *edges.edge : spec.edge;
    std::optional<EdgeSizing> sizing;
    if (own) {
      own->far = std::min(own->far, edges.coarsest);
      sizing = sizing_of(scene, plan, i, *own, kept);
    }
    const bool part = spec.keep_within && extent == Extent::kSolved;
    const auto make = [&] {
      MeshedBody made{meshed(spec, own ? &*own : nullptr, sizing ? &*sizing : nullptr, kept), {}, {}};
      require_closed_surface(made.body.mesh, called(spec));
      made.skin.assign(static_cast<std::size_t>(made.body.mesh.face_count()), 1);
      if (part) {
        keep_part(scene, plan, i, sizing.value_or(EdgeSizing(made.body.mesh.mean_edge())), made);
      }
      return made;
    };
    const auto place = [&](const MeshedBody& made) {
      const auto world = [&](const Body& body) {
        return placed(body, plan.bodies[i].anchor, spec.place.at, spec.place.angles);
      };
      if (made.whole) {
        whole.push_back({static_cast<int>(i), world({*made.whole, {}}).mesh});
      }
      if (!made.skin.empty()) {
        owner.insert(owner.end(), made.skin.size(), static_cast<int>(i));
        skin.insert(skin.end(), made.skin.begin(), made.skin.end());
        bodies.push_back(world(made.body));
        numbers.push_back(i);
      }
    };
    if (kept != nullptr) {
      place(kept->get(fmt::format("{} {}", extent == Extent::kSolved ? "solver" : "evaluation", i),
                      meshing_key(spec, sizing, part ? &plan.bodies[i].kept_about : nullptr, plan.bodies[i].pressed),
                      make));
    } else {
      place(make());
    }
  }
  if (bodies.empty()) {
    const RigidMotion own_frame = plan.own_frame(scene, 0);
    refuse_far_target(scene, plan, 0, {own_frame(whole.front().mesh.vertices()), whole.front().mesh.triangles()});
  }
  PlacedBodies all{
      {joined(bodies), joined_landmarks(scene, bodies, numbers)}, std::move(owner), std::move(skin), std::move(whole)};
  require_apart(scene, all.body.mesh, all.owner);
  return all;
}

}  // namespace touchfield
