#include "sim/store/difference.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <complex>
#include <cstdint>
#include <numbers>
#include <set>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "sim/store/run_layout.h"

namespace touchfield {

namespace {

bool same_value(const Complex& a, const Complex& b) {
  return touchfield::same_value(a.real(), b.real()) && touchfield::same_value(a.imag(), b.imag());
}

bool is_finite(double value) { return std::isfinite(value); }
bool is_finite(const Complex& value) { return std::isfinite(value.real()) && std::isfinite(value.imag()); }

/// 0 of nothing is 0: two silent runs are alike.
double share(double part, double whole) { return part == 0.0 ? 0.0 : part / whole; }

/// What lists of values have in common, whatever they are: their sizes, which values are the same, which can be
/// subtracted.
template <class Value>
struct Pairing {
  bool identical = true;
  std::string fault;

  template <class List>
  Pairing(const List& a, const List& b) {
    const auto size_a = static_cast<std::size_t>(a.size());
    const auto size_b = static_cast<std::size_t>(b.size());
    if (size_a != size_b) {
      identical = false;
      fault = fmt::format("{} and {} values", size_a, size_b);
      return;
    }
    std::size_t lost = 0;
    for (std::size_t i = 0; i < size_a; ++i) {
      const Value x = a.data()[i];
      const Value y = b.data()[i];
      if (!same_value(x, y)) {
        identical = false;
        lost += is_finite(x) && is_finite(y) ? 0 : 1;
      }
    }
    if (lost > 0) {
      fault = fmt::format("{} of {} values are not finite in one of them", lost, size_a);
    }
  }

  /// The difference where there is nothing to subtract.
  double known() const { return identical ? 0.0 : kInfinite; }
};

/// Diagonal of the points' bounding box [m].
double extent(const Points& points) {
  return points.cols() == 0 ? 0.0 : (points.rowwise().maxCoeff() - points.rowwise().minCoeff()).norm();
}

double largest_distance(const Points& a, const Points& b) {
  return a.cols() == 0 ? 0.0 : (a - b).colwise().norm().maxCoeff();
}

double relative_to_extent(double distance, const Points& a, const Points& b) {
  return distance == 0.0 ? 0.0 : distance / std::max(extent(a), extent(b));
}

/// Below a billionth of a millimetre or of a radian there is nothing but rounding.
double without_rounding(double value) { return std::abs(value) < 1e-12 ? 0.0 : value; }

Value mesh_motion(const Points& a, const Points& b) {
  const Eigen::Matrix4d fit = Eigen::umeyama(a, b, false);
  const Eigen::Matrix3d rotation = fit.topLeftCorner<3, 3>();
  const Vector3 translation = fit.topRightCorner<3, 1>();
  const Points moved = (rotation * a).colwise() + translation;
  const Vector3 shift = (b.rowwise().mean() - a.rowwise().mean()).unaryExpr(&without_rounding);
  return {{"shift_m", std::vector<double>(shift.begin(), shift.end())},
          {"angle_rad", without_rounding(Eigen::AngleAxisd(rotation).angle())},
          {"residual_m", without_rounding(largest_distance(moved, b))}};
}

std::string kind_text(const TransducerArray& array) {
  return array.kind == TransducerArray::Kind::kPlaneWave ? "plane wave" : "transducers";
}

std::string directivity_text(const Directivity& directivity) {
  const std::string name = directivity_name(directivity.kind());
  return directivity.kind() == Directivity::Kind::kPiston ? fmt::format("{}, ka = {:.6g}", name, directivity.ka())
                                                          : name;
}

/// Amplitudes of those faces of a target that another has too.
std::vector<double> shared_amplitudes(const Target& target, const Target& other) {
  const std::set<Eigen::Index> others(other.faces.begin(), other.faces.end());
  std::vector<double> amplitudes;
  for (std::size_t k = 0; k < target.faces.size(); ++k) {
    if (others.contains(target.faces[k])) {
      amplitudes.push_back(target.amplitudes(static_cast<Eigen::Index>(k)));
    }
  }
  return amplitudes;
}

/// What channels make of a drive, real and imaginary parts.
std::vector<double> factor_parts(const TransducerArray& array, const std::optional<ArrayTruth>& truth = {}) {
  const ChannelResponse& response = truth ? truth->response : array.response;
  const Eigen::VectorXcd values = response.as_designed() ? Eigen::VectorXcd::Ones(array.size()) : factors(response);
  std::vector<double> parts;
  for (const Complex& value : values) {
    parts.insert(parts.end(), {value.real(), value.imag()});
  }
  return parts;
}

Value numbers_value(bool identical, double relative, const std::string& fault) {
  return {{"identical", identical}, {"relative", relative}, {"fault", fault}};
}

Value complex_value(bool identical, double relative, double as_it_is, double turn, const std::string& fault) {
  return {
      {"identical", identical}, {"relative", relative}, {"as_it_is", as_it_is}, {"turn_rad", turn}, {"fault", fault}};
}

Value phases_value(bool identical, double largest, double rms, double turn, const std::string& fault) {
  return {{"identical", identical}, {"largest_rad", largest}, {"rms_rad", rms}, {"turn_rad", turn}, {"fault", fault}};
}

}  // namespace

bool same_value(double a, double b) {
  return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b) || (std::isnan(a) && std::isnan(b));
}

double relative_change(double a, double b) {
  if (same_value(a, b)) {
    return 0.0;
  }
  if (!std::isfinite(a) || !std::isfinite(b)) {
    return kInfinite;
  }
  return share(std::abs(a - b), std::max(std::abs(a), std::abs(b)));
}

Value compare_numbers(std::span<const double> a, std::span<const double> b) {
  const Pairing<double> pairing(a, b);
  if (!pairing.fault.empty()) {
    return numbers_value(pairing.identical, kInfinite, pairing.fault);
  }
  double largest = 0.0;
  double difference = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (is_finite(a[i])) {
      largest = std::max({largest, std::abs(a[i]), std::abs(b[i])});
      difference = std::max(difference, std::abs(a[i] - b[i]));
    }
  }
  return numbers_value(pairing.identical, share(difference, largest), "");
}

Value compare_complex(const Eigen::VectorXcd& a, const Eigen::VectorXcd& b, const Eigen::VectorXd& weights) {
  const Pairing<Complex> pairing(a, b);
  if (pairing.identical || !pairing.fault.empty()) {
    return complex_value(pairing.identical, pairing.known(), pairing.known(), 0, pairing.fault);
  }
  const auto weight = [&](Eigen::Index i) { return weights.size() == 0 ? 1.0 : weights(i); };
  double size_a = 0.0;
  double size_b = 0.0;
  Complex overlap = 0.0;
  for (Eigen::Index i = 0; i < a.size(); ++i) {
    if (is_finite(a(i))) {
      size_a += weight(i) * std::norm(a(i));
      size_b += weight(i) * std::norm(b(i));
      overlap += weight(i) * std::conj(a(i)) * b(i);
    }
  }
  const double turn = std::arg(overlap);  // 0 of an overlap of 0
  const Complex back = std::polar(1.0, -turn);
  double turned = 0.0;
  double as_is = 0.0;
  for (Eigen::Index i = 0; i < a.size(); ++i) {
    if (is_finite(a(i))) {
      turned += weight(i) * std::norm(b(i) * back - a(i));
      as_is += weight(i) * std::norm(b(i) - a(i));
    }
  }
  const auto root = [&](double part) { return std::sqrt(share(part, std::max(size_a, size_b))); };
  return complex_value(false, root(turned), root(as_is), turn, "");
}

Value compare_phases(const Eigen::VectorXd& phases_a, const Eigen::VectorXd& amplitudes_a,
                     const Eigen::VectorXd& phases_b, const Eigen::VectorXd& amplitudes_b) {
  const Pairing<double> pairing(phases_a, phases_b);
  if (pairing.identical || !pairing.fault.empty()) {
    return phases_value(pairing.identical, pairing.known(), pairing.known(), 0, pairing.fault);
  }
  Complex overlap = 0.0;
  for (Eigen::Index n = 0; n < phases_a.size(); ++n) {
    const double product = amplitudes_a(n) * amplitudes_b(n);
    if (is_finite(product) && is_finite(phases_a(n))) {
      overlap += product * std::polar(1.0, phases_b(n) - phases_a(n));
    }
  }
  const double turn = std::arg(overlap);
  double largest = 0.0;
  double sum = 0.0;
  Eigen::Index counted = 0;
  for (Eigen::Index n = 0; n < phases_a.size(); ++n) {
    const bool silent = amplitudes_a(n) == 0.0 && amplitudes_b(n) == 0.0;
    if (!silent && is_finite(phases_a(n))) {
      const double difference = std::abs(std::remainder(phases_b(n) - phases_a(n) - turn, 2.0 * std::numbers::pi));
      largest = std::max(largest, difference);
      sum += difference * difference;
      ++counted;
    }
  }
  return phases_value(false, largest, counted == 0 ? 0.0 : std::sqrt(sum / static_cast<double>(counted)), turn, "");
}

Value changes_of(const std::vector<TextChange>& changes) {
  Value::Group group;
  for (const TextChange& change : changes) {
    group.push_back({change.what, std::pair(change.a, change.b)});
  }
  return group;
}

void add_change(Value& changes, const std::string& what, const std::string& a, const std::string& b) {
  if (a != b) {
    changes.add(what, std::pair(a, b));
  }
}

Value compare_meshes(const TriangleMesh& a, const TriangleMesh& b) {
  const bool comparable = a.vertex_count() == b.vertex_count();
  const bool same_triangles = comparable && a.face_count() == b.face_count() && a.triangles() == b.triangles();
  const double distance = comparable ? largest_distance(a.vertices(), b.vertices()) : kInfinite;
  const bool identical =
      same_triangles && compare_numbers(numbers(a.vertices()), numbers(b.vertices()))["identical"].flag();
  return {{"identical", identical},
          {"faces", std::pair(a.face_count(), b.face_count())},
          {"vertices", std::pair(a.vertex_count(), b.vertex_count())},
          {"same_triangles", same_triangles},
          {"largest_distance_m", distance},
          {"relative", same_triangles ? relative_to_extent(distance, a.vertices(), b.vertices()) : kInfinite},
          {"motion", same_triangles && !identical ? mesh_motion(a.vertices(), b.vertices()) : Value()}};
}

Value compare_arrays(const TransducerArray& a, const TransducerArray& b, const std::optional<ArrayTruth>& truth_a,
                     const std::optional<ArrayTruth>& truth_b) {
  const auto levels = [](const std::optional<ArrayTruth>& truth) {
    return fmt::to_string(truth ? truth->phase_levels : 0);
  };
  Value changes = Value::Group();
  add_change(changes, "kind", kind_text(a), kind_text(b));
  add_change(changes, "directivity", directivity_text(a.directivity), directivity_text(b.directivity));
  add_change(changes, "phase_levels", levels(truth_a), levels(truth_b));
  const bool comparable = a.size() == b.size();
  const bool same_numbering = comparable && a.device == b.device && a.channel == b.channel;
  const double distance = comparable ? largest_distance(a.positions, b.positions) : kInfinite;
  const double tilt = comparable ? 2.0 * std::asin(std::min(1.0, 0.5 * largest_distance(a.axes, b.axes))) : kInfinite;
  const std::array<Value, 3> parts = {compare_numbers(numbers(a.amplitudes), numbers(b.amplitudes)),
                                      compare_numbers(factor_parts(a), factor_parts(b)),
                                      compare_numbers(factor_parts(a, truth_a), factor_parts(b, truth_b))};
  const bool same_kind = changes.empty() && same_numbering;
  bool identical = same_kind && compare_numbers(numbers(a.positions), numbers(b.positions))["identical"].flag() &&
                   compare_numbers(numbers(a.axes), numbers(b.axes))["identical"].flag();
  double relative = same_kind ? std::max(relative_to_extent(distance, a.positions, b.positions), tilt) : kInfinite;
  for (const Value& part : parts) {
    identical = identical && part["identical"].flag();
    relative = std::max(relative, part["relative"].number());
  }
  return {{"identical", identical},
          {"channels", std::pair(a.size(), b.size())},
          {"changes", changes},
          {"same_numbering", same_numbering},
          {"largest_distance_m", distance},
          {"largest_tilt_rad", tilt},
          {"amplitudes", parts[0]},
          {"responses", parts[1]},
          {"true_responses", parts[2]},
          {"relative", relative}};
}

Value compare_targets(const std::optional<Target>& a, const std::optional<Target>& b) {
  const Target none;
  const Target& target_a = a ? *a : none;
  const Target& target_b = b ? *b : none;
  const std::vector<double> shared_a = shared_amplitudes(target_a, target_b);
  const std::vector<double> shared_b = shared_amplitudes(target_b, target_a);
  const auto shared = static_cast<Eigen::Index>(shared_a.size());
  const Value amplitudes = compare_numbers(shared_a, shared_b);
  const bool same_faces = target_a.faces == target_b.faces;
  return {{"identical", same_faces && target_a.box == target_b.box && amplitudes["identical"].flag()},
          {"faces", std::pair(target_a.size(), target_b.size())},
          {"faces_in_one_alone", std::pair(target_a.size() - shared, target_b.size() - shared)},
          {"amplitudes", amplitudes},
          {"relative", same_faces ? amplitudes["relative"].number() : kInfinite}};
}

}  // namespace touchfield
