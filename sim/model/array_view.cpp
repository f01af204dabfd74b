#include "sim/model/array_view.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <variant>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/text.h"
#include "sim/core/units.h"
#include "sim/mesh/query/clearance.h"
#include "sim/model/clear_transducers.h"
#include "sim/model/meshed_body.h"

namespace touchfield {

namespace {

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
  std::vector<BoxView> views;
  for (std::size_t b = 0; b < model.boxes.size(); ++b) {
    double area = 0.0;
    Vector3 centre = Vector3::Zero();
    Vector3 normal = Vector3::Zero();
    std::vector<double> on_body(model.posture.bodies.size(), 0.0);
    for (std::size_t i = 0; i < target.faces.size(); ++i) {
      if (target.box[i] == static_cast<int>(b)) {
        const Index f = target.faces[i];
        area += mesh.areas()(f);
        centre += mesh.areas()(f) * mesh.centroids().col(f);
        normal += mesh.areas()(f) * mesh.normals().col(f);
        on_body[static_cast<std::size_t>(model.fixed->owner[static_cast<std::size_t>(f)])] += mesh.areas()(f);
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
