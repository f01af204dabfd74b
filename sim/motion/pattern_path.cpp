#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>
#include <set>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "sim/core/require.h"
#include "sim/core/text.h"
#include "sim/core/units.h"
#include "sim/felt/skin_patch.h"
#include "sim/mesh/query/face_tree.h"
#include "sim/motion/pattern.h"

namespace touchfield {

namespace {

constexpr double kTurn = 2.0 * std::numbers::pi;
constexpr double kWhole = 1e-9;           // how near a product of rates is to a whole number, relative
constexpr double kShortestPath = 0.1e-3;  // [m]

bool is_whole(double x) { return std::abs(x - std::round(x)) <= kWhole * std::max(1.0, x); }

struct Rate {
  std::string key;
  double hz;
  Eigen::Index places;  // that it visits in turn, or 0
};

/// Those of the path and the amplitude, the path's first.
std::vector<Rate> rates_of(const PatternSpec& spec) {
  std::vector<Rate> rates;
  if (const auto* circle = std::get_if<CirclePath>(&spec.path)) {
    rates.push_back({"pattern.circle.hz", circle->hz, 0});
  } else if (const auto* line = std::get_if<LinePath>(&spec.path)) {
    rates.push_back({"pattern.line.hz", line->hz, 0});
  } else if (const auto* points = std::get_if<PointsPath>(&spec.path)) {
    rates.push_back({"pattern.points.hz", points->hz, static_cast<Eigen::Index>(points->at.size())});
  }
  if (spec.amplitude) {
    rates.push_back({"pattern.amplitude.hz", spec.amplitude->hz, 0});
  }
  return rates;
}

double path_hz(const PatternSpec& spec) { return rates_of(spec).front().hz; }

constexpr double kFrozen = 2;     // frames per period, and fewer: they show another rate, or none
constexpr double kFewFrames = 6;  // fewer are said

void require_frames(const PatternSpec& spec) {
  for (const Rate& rate : rates_of(spec)) {
    const double frames = spec.frames_hz / rate.hz;
    require(
        rate.places == 0 || frames >= static_cast<double>(rate.places) * (1.0 - kWhole),
        "{} = {:.6g}: at frames_per_second = {:.6g} a period has {:.3g} frames for {} places, so some are left out; "
        "{:.6g} frames per second have one for each",
        rate.key, rate.hz, spec.frames_hz, frames, rate.places, static_cast<double>(rate.places) * rate.hz);
    require(
        rate.places > 0 || frames > kFrozen * (1.0 + kWhole),
        "{} = {:.6g} must be below half of frames_per_second = {:.6g}: frames would show another rate, or none; give "
        "a lower hz, or frames_per_second: {:.6g} or more",
        rate.key, rate.hz, spec.frames_hz, kFewFrames * rate.hz);
  }
}

/// The shortest time of whole periods and whole frames; without frames if there is none.
PatternClock whole_clock(const PatternSpec& spec) {
  const double hz = path_hz(spec);
  for (double periods = 1; periods * spec.frames_hz / hz <= kMostPatternFrames; ++periods) {
    const double frames = periods * spec.frames_hz / hz;
    const double sines = spec.amplitude ? periods * spec.amplitude->hz / hz : 1.0;
    if (frames >= 2 && is_whole(frames) && is_whole(sines)) {
      return {.frames = static_cast<int>(std::round(frames)), .rate = spec.frames_hz};
    }
  }
  return {};
}

/// "; 0.02 would fit": the time of whole periods and frames that is nearest to the scene's.
std::string fitting_seconds(const PatternSpec& spec) {
  const PatternClock whole = whole_clock(spec);
  if (whole.frames == 0) {
    return "; no time would fit these rates";
  }
  return fmt::format("; {:.6g} would fit",
                     std::max(1.0, std::round(*spec.seconds / whole.seconds())) * whole.seconds());
}

Vector3 place_of(const PatternPlace& place, const Body& body) {
  const auto* name = std::get_if<std::string>(&place);
  return name == nullptr ? std::get<Vector3>(place) : position(body.mesh, find_landmark(body, *name));
}

/// The path in space, by the share of a period that has passed, 0 to 1.
class PathInSpace {
 public:
  /// skin, strokes   of the model's mesh, outlive this
  PathInSpace(const PatternSpec& spec, const Model& model, const FaceTree& skin, const SkinStrokes& strokes)
      : strokes_(strokes) {
    if (const auto* circle = std::get_if<CirclePath>(&spec.path)) {
      key_ = "pattern.circle";
      add(circle->at, ".at", model.body);
      set_circle(circle->radius, model.body.mesh, skin);
    } else if (const auto* line = std::get_if<LinePath>(&spec.path)) {
      key_ = "pattern.line";
      add(line->from, ".from", model.body);
      add(line->to, ".to", model.body);
      is_line_ = true;
    } else if (const auto* points = std::get_if<PointsPath>(&spec.path)) {
      key_ = "pattern.points";
      for (std::size_t i = 0; i < points->at.size(); ++i) {
        add(points->at[i], fmt::format(".at[{}]", i), model.body);
      }
    }
    require_length();
  }

  SkinPoint on_skin(double share) const { return strokes_.on_skin(at(share), key_); }

  Vector3 at(double share) const {
    if (is_line_) {
      return places_[0] + (1.0 - std::abs(2.0 * share - 1.0)) * (places_[1] - places_[0]);
    }
    if (is_circle_) {
      return places_[0] + radius_ * (std::cos(kTurn * share) * right_ + std::sin(kTurn * share) * up_);
    }
    // By a hair later than rounding could make of the first instant of a place.
    const auto count = static_cast<double>(places_.size());
    return places_[static_cast<std::size_t>(std::min(count - 1.0, std::floor(share * count + kWhole)))];
  }

 private:
  void add(const PatternPlace& place, const std::string& key, const Body& body) {
    places_.push_back(place_of(place, body));
    const Vector3 at = strokes_.on_skin(places_.back(), key_ + key).at;
    first_ = places_.size() == 1 ? at : first_;
    longest_ = std::max(longest_, (at - first_).norm());
  }

  /// Places that are one stand for a slip.
  void require_length() const {
    require(
        places_.empty() || longest_ >= kShortestPath,
        "{}: the path is {:.3g} mm long on the skin, so the spot would stand still; it must be {:g} mm or more. Give "
        "places that differ; a radius, and points, are in millimetres",
        key_, longest_ / kMillimetre, kShortestPath / kMillimetre);
  }

  /// The plane has the area-weighted normal of the skin within the circle, on the side of its middle.
  void set_circle(double radius, const TriangleMesh& mesh, const FaceTree& skin) {
    is_circle_ = true;
    radius_ = radius;
    longest_ = 2.0 * radius;
    const SkinPoint middle = skin.nearest(places_[0]);
    const Vector3 side = mesh.normals().col(middle.face);
    std::vector<Eigen::Index> within;
    skin.centroids_within(middle.at, radius, within);
    Vector3 normal = mesh.areas()(middle.face) * side;
    for (const Eigen::Index face : within) {
      const Vector3 n = mesh.normals().col(face);
      normal += n.dot(side) > 0 ? Vector3(mesh.areas()(face) * n) : Vector3(Vector3::Zero());
    }
    normal.normalize();
    const Eigen::Matrix3d axes = axes_about(normal);
    right_ = axes.col(0);
    up_ = axes.col(1);
  }

  const SkinStrokes& strokes_;
  std::string key_;
  std::vector<Vector3> places_;
  Vector3 first_ = Vector3::Zero();  // of them, on the skin
  double longest_ = 0;               // distance of places on the skin, or the circle's diameter
  bool is_line_ = false;
  bool is_circle_ = false;
  double radius_ = 0;
  Vector3 right_ = Vector3::Zero();
  Vector3 up_ = Vector3::Zero();
};

double period_share(const PatternSpec& spec, const PatternClock& clock, Eigen::Index frame) {
  const double turns = path_hz(spec) * clock.time(frame);
  const double share = turns - std::floor(turns + kWhole);
  return std::max(0.0, share);
}

/// The disc on the skin, whose mesh is checked.
Target disc(const PatternSpec& spec, const Model& model, const SkinStrokes& strokes, const Vector3& at,
            double pressure) {
  const TriangleMesh& mesh = model.body.mesh;
  const TargetBox round = strokes.disc(at, spec.diameter, 1.0, "pattern.diameter_mm");
  Target spot = make_target(mesh, {round}, TargetProfile::kUniform, pressure);
  const Eigen::VectorXd areas = spot.areas(mesh.areas());
  double edges = 0.0;
  for (Eigen::Index i = 0; i < spot.size(); ++i) {
    edges += areas(i) / areas.sum() * mesh.local_edge(spot.faces[static_cast<std::size_t>(i)]);
  }
  require(model.fixed->scene.solve.allow_coarse_mesh || model.fixed->wave.wavelength() >= kFewestSolved * edges,
          "pattern: the mesh has {:.2g} edges per wavelength at the spot at {}, it must have at least {}; give shorter "
          "body.edge_mm there (edge_mm.near, or a target box along the path)",
          model.fixed->wave.wavelength() / edges, place_text(at), kFewestSolved);
  return spot;
}

}  // namespace

PatternClock pattern_clock(const PatternSpec& spec) {
  require_frames(spec);
  PatternClock clock = whole_clock(spec);
  if (spec.seconds) {
    const double frames = *spec.seconds * spec.frames_hz;
    require(is_whole(frames) && frames >= 2 && frames <= kMostPatternFrames,
            "pattern.seconds = {:.6g} are {:.6g} frames at frames_per_second = {:.6g}; they must be a whole number of "
            "2 to {} frames{}",
            *spec.seconds, frames, spec.frames_hz, kMostPatternFrames,
            frames <= kMostPatternFrames ? fitting_seconds(spec) : "");
    clock = {.frames = static_cast<int>(std::round(frames)), .rate = spec.frames_hz};
  }
  require(clock.frames > 0,
          "pattern: no time of at most {} frames is a whole number of frames at frames_per_second = {:.6g} and "
          "of periods of every hz; give seconds, or rates with a common period",
          kMostPatternFrames, spec.frames_hz);
  require(clock.seconds() <= kLongestPattern,
          "pattern: {} frames at frames_per_second = {:.6g} take {:.6g} s; a pattern must repeat within {:g} s",
          clock.frames, spec.frames_hz, clock.seconds(), kLongestPattern);
  return clock;
}

std::vector<std::string> clock_warnings(const PatternSpec& spec, const PatternClock& clock) {
  std::vector<std::string> warnings;
  for (const Rate& rate : rates_of(spec)) {
    const double frames = clock.rate / rate.hz;
    if (rate.places == 0 && frames < kFewFrames * (1.0 - kWhole)) {
      warnings.push_back(fmt::format(
          "few_frames: {} = {:.6g} has {:.3g} frames per period; below {:g} the steps are coarse. frames_per_second: "
          "{:.6g} has {:g}",
          rate.key, rate.hz, frames, kFewFrames, kFewFrames * rate.hz, kFewFrames));
    }
    const double periods = clock.seconds() * rate.hz;
    if (!is_whole(periods)) {
      warnings.push_back(
          fmt::format("part_period: pattern.seconds = {:.6g} has {:.4g} periods of {} = {:.6g}, so the "
                      "pattern jumps at each repeat{}",
                      clock.seconds(), periods, rate.key, rate.hz, fitting_seconds(spec)));
    }
  }
  return warnings;
}

double wanted_share(const PatternSpec& spec, double time) {
  return spec.amplitude ? 1.0 - 0.5 * spec.amplitude->depth * (1.0 - std::cos(kTurn * spec.amplitude->hz * time)) : 1.0;
}

std::vector<PatternPoint> pattern_points(const PatternSpec& spec, const Model& model) {
  require(
      model.fixed->cut.empty(),
      "pattern: body.keep_within_mm cuts the body, and the figures of a pattern count its whole skin; leave it out");
  const FaceTree skin(model.body.mesh);
  const SkinStrokes strokes(model.body.mesh);
  const PathInSpace path(spec, model, skin, strokes);
  std::vector<PatternPoint> points;
  const auto add = [&](std::string name, const Vector3& x) {
    const SkinPoint at = skin.nearest(x);
    points.push_back({std::move(name), at.at, at.face});
  };
  for (const std::string& landmark : spec.watch) {
    add(landmark, place_of(landmark, model.body));
  }
  if (std::holds_alternative<CirclePath>(spec.path)) {
    add("start", path.at(0.0));
    add("opposite", path.at(0.5));
  } else if (std::holds_alternative<LinePath>(spec.path)) {
    add("from", path.at(0.0));
    add("to", path.at(0.5));
  } else if (const auto* places = std::get_if<PointsPath>(&spec.path)) {
    for (std::size_t i = 0; i < places->at.size(); ++i) {
      const auto* name = std::get_if<std::string>(&places->at[i]);
      add(fmt::format("{}{}", i + 1, name == nullptr ? "" : "_" + *name),
          path.at(static_cast<double>(i) / static_cast<double>(places->at.size())));
    }
  } else {
    add("target", model.body.mesh.centroids().col(central_face(model.body.mesh, build_target(model))));
  }
  return points;
}

PatternSpots pattern_spots(const PatternSpec& spec, const PatternClock& clock, const std::vector<PatternPoint>& points,
                           const Model& model) {
  const TriangleMesh& mesh = model.body.mesh;
  std::vector<Target> wanted;  // of each column
  std::vector<Eigen::Index> middles;
  if (std::holds_alternative<std::monostate>(spec.path)) {
    wanted.push_back(build_target(model));
    if (spec.pressure) {
      wanted.front().amplitudes *= *spec.pressure / wanted.front().amplitudes.maxCoeff();
    }
    middles.push_back(central_face(mesh, wanted.front()));
  } else {
    const FaceTree skin(mesh);
    const SkinStrokes strokes(mesh);
    const PathInSpace path(spec, model, skin, strokes);
    const double pressure = spec.pressure ? *spec.pressure : wanted_pressure(model);
    for (Eigen::Index k = 0; k < clock.frames; ++k) {
      const SkinPoint at = path.on_skin(period_share(spec, clock, k));
      Target spot = disc(spec, model, strokes, at.at, pressure);
      middles.push_back(*std::ranges::min_element(
          spot.faces, {}, [&](Eigen::Index face) { return (mesh.centroids().col(face) - at.at).squaredNorm(); }));
      wanted.push_back(std::move(spot));
    }
  }
  std::set<Eigen::Index> all;
  std::ranges::transform(points, std::inserter(all, all.end()), &PatternPoint::face);
  for (const Target& target : wanted) {
    all.insert(target.faces.begin(), target.faces.end());
  }
  PatternSpots result{.faces = {all.begin(), all.end()}, .amplitudes = {}, .shares = {}, .middle = {}};
  const auto row_of = [&](Eigen::Index face) {
    return std::ranges::lower_bound(result.faces, face) - result.faces.begin();
  };
  result.amplitudes.setZero(static_cast<Eigen::Index>(all.size()), static_cast<Eigen::Index>(wanted.size()));
  result.shares = result.amplitudes;
  for (std::size_t k = 0; k < wanted.size(); ++k) {
    for (std::size_t i = 0; i < wanted[k].faces.size(); ++i) {
      const auto row = row_of(wanted[k].faces[i]);
      result.amplitudes(row, static_cast<Eigen::Index>(k)) = wanted[k].amplitudes(static_cast<Eigen::Index>(i));
      result.shares(row, static_cast<Eigen::Index>(k)) = wanted[k].shares(static_cast<Eigen::Index>(i));
    }
    result.middle.push_back(row_of(middles[k]));
    result.boxes.push_back(wanted[k].boxes);
    result.box.push_back(wanted[k].box);
  }
  return result;
}

}  // namespace touchfield
