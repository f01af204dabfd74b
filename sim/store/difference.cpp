#include "sim/store/difference.h"

#include <algorithm>
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

MeshMotion mesh_motion(const Points& a, const Points& b) {
  const Eigen::Matrix4d fit = Eigen::umeyama(a, b, false);
  const Eigen::Matrix3d rotation = fit.topLeftCorner<3, 3>();
  const Vector3 translation = fit.topRightCorner<3, 1>();
  const Points moved = (rotation * a).colwise() + translation;
  return {Vector3(b.rowwise().mean() - a.rowwise().mean()), Eigen::AngleAxisd(rotation).angle(),
          largest_distance(moved, b)};
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

/// The parts of the factors of a response.
std::vector<double> factor_parts(const ChannelResponse& response, Eigen::Index channels) {
  const Eigen::VectorXcd values = response.as_designed() ? Eigen::VectorXcd::Ones(channels) : factors(response);
  std::vector<double> parts;
  for (const Complex& value : values) {
    parts.insert(parts.end(), {value.real(), value.imag()});
  }
  return parts;
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

NumbersDifference compare_numbers(std::span<const double> a, std::span<const double> b) {
  const Pairing<double> pairing(a, b);
  if (!pairing.fault.empty()) {
    return {pairing.identical, kInfinite, pairing.fault};
  }
  double largest = 0.0;
  double difference = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (is_finite(a[i])) {
      largest = std::max({largest, std::abs(a[i]), std::abs(b[i])});
      difference = std::max(difference, std::abs(a[i] - b[i]));
    }
  }
  return {pairing.identical, share(difference, largest), ""};
}

ComplexDifference compare_complex(const Eigen::VectorXcd& a, const Eigen::VectorXcd& b,
                                  const Eigen::VectorXd& weights) {
  const Pairing<Complex> pairing(a, b);
  if (!pairing.fault.empty()) {
    return {pairing.identical, kInfinite, kInfinite, 0.0, pairing.fault};
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
  ComplexDifference result;
  result.identical = pairing.identical;
  if (result.identical) {
    return result;
  }
  result.turn = std::arg(overlap);  // 0 of an overlap of 0
  const Complex back = std::polar(1.0, -result.turn);
  double turned = 0.0;
  double as_is = 0.0;
  for (Eigen::Index i = 0; i < a.size(); ++i) {
    if (is_finite(a(i))) {
      turned += weight(i) * std::norm(b(i) * back - a(i));
      as_is += weight(i) * std::norm(b(i) - a(i));
    }
  }
  result.relative = std::sqrt(share(turned, std::max(size_a, size_b)));
  result.as_is = std::sqrt(share(as_is, std::max(size_a, size_b)));
  return result;
}

PhasesDifference compare_phases(const Eigen::VectorXd& phases_a, const Eigen::VectorXd& amplitudes_a,
                                const Eigen::VectorXd& phases_b, const Eigen::VectorXd& amplitudes_b) {
  const Pairing<double> pairing(phases_a, phases_b);
  PhasesDifference result;
  result.identical = pairing.identical;
  result.fault = pairing.fault;
  if (!result.fault.empty()) {
    result.largest = result.rms = kInfinite;
    return result;
  }
  if (result.identical) {
    return result;
  }
  Complex overlap = 0.0;
  for (Eigen::Index n = 0; n < phases_a.size(); ++n) {
    const double product = amplitudes_a(n) * amplitudes_b(n);
    if (is_finite(product) && is_finite(phases_a(n))) {
      overlap += product * std::polar(1.0, phases_b(n) - phases_a(n));
    }
  }
  result.turn = std::arg(overlap);
  double sum = 0.0;
  Eigen::Index counted = 0;
  for (Eigen::Index n = 0; n < phases_a.size(); ++n) {
    const bool silent = amplitudes_a(n) == 0.0 && amplitudes_b(n) == 0.0;
    if (!silent && is_finite(phases_a(n))) {
      const double difference =
          std::abs(std::remainder(phases_b(n) - phases_a(n) - result.turn, 2.0 * std::numbers::pi));
      result.largest = std::max(result.largest, difference);
      sum += difference * difference;
      ++counted;
    }
  }
  result.rms = counted == 0 ? 0.0 : std::sqrt(sum / static_cast<double>(counted));
  return result;
}

void add_change(std::vector<TextChange>& changes, const std::string& what, const std::string& a, const std::string& b) {
  if (a != b) {
    changes.push_back({what, a, b});
  }
}

MeshDifference compare_meshes(const TriangleMesh& a, const TriangleMesh& b) {
  MeshDifference result;
  result.faces = {a.face_count(), b.face_count()};
  result.vertices = {a.vertex_count(), b.vertex_count()};
  if (a.vertex_count() == b.vertex_count()) {
    result.distance = largest_distance(a.vertices(), b.vertices());
  }
  result.same_triangles = result.distance && a.face_count() == b.face_count() && a.triangles() == b.triangles();
  result.identical = result.same_triangles && compare_numbers(numbers(a.vertices()), numbers(b.vertices())).identical;
  result.relative =
      result.same_triangles ? relative_to_extent(*result.distance, a.vertices(), b.vertices()) : kInfinite;
  if (result.same_triangles && !result.identical) {
    result.motion = mesh_motion(a.vertices(), b.vertices());
  }
  return result;
}

NumbersDifference compare_responses(const ChannelResponse& a, Eigen::Index channels_a, const ChannelResponse& b,
                                    Eigen::Index channels_b) {
  return compare_numbers(factor_parts(a, channels_a), factor_parts(b, channels_b));
}

ArrayDifference compare_arrays(const TransducerArray& a, const TransducerArray& b) {
  ArrayDifference result;
  result.channels = {a.size(), b.size()};
  add_change(result.texts, "kind", kind_text(a), kind_text(b));
  add_change(result.texts, "directivity", directivity_text(a.directivity), directivity_text(b.directivity));
  result.same_numbering = a.size() == b.size() && a.device == b.device && a.channel == b.channel;
  result.amplitudes = compare_numbers(numbers(a.amplitudes), numbers(b.amplitudes));
  result.responses = compare_responses(a.response, a.size(), b.response, b.size());
  if (a.size() == b.size()) {
    result.distance = largest_distance(a.positions, b.positions);
    result.tilt = 2.0 * std::asin(std::min(1.0, 0.5 * largest_distance(a.axes, b.axes)));
  }
  const bool same_kind = result.texts.empty() && result.same_numbering;
  result.identical = same_kind && result.amplitudes.identical && result.responses.identical &&
                     compare_numbers(numbers(a.positions), numbers(b.positions)).identical &&
                     compare_numbers(numbers(a.axes), numbers(b.axes)).identical;
  result.relative = same_kind ? std::max({relative_to_extent(*result.distance, a.positions, b.positions), *result.tilt,
                                          result.amplitudes.relative, result.responses.relative})
                              : kInfinite;
  return result;
}

TargetDifference compare_targets(const std::optional<Target>& a, const std::optional<Target>& b) {
  const Target none;
  const Target& target_a = a ? *a : none;
  const Target& target_b = b ? *b : none;
  const std::vector<double> shared_a = shared_amplitudes(target_a, target_b);
  const std::vector<double> shared_b = shared_amplitudes(target_b, target_a);
  const auto shared = static_cast<Eigen::Index>(shared_a.size());
  TargetDifference result;
  result.faces = {target_a.size(), target_b.size()};
  result.only_faces = {target_a.size() - shared, target_b.size() - shared};
  result.amplitudes = compare_numbers(shared_a, shared_b);
  const bool same_faces = target_a.faces == target_b.faces;
  result.identical = same_faces && target_a.box == target_b.box && result.amplitudes.identical;
  result.relative = same_faces ? result.amplitudes.relative : kInfinite;
  return result;
}

}  // namespace touchfield
