#include "sim/store/value_difference.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <complex>
#include <cstdint>
#include <limits>
#include <numbers>

#include <fmt/format.h>

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

}  // namespace touchfield
