#pragma once

#include <array>
#include <cmath>
#include <numbers>

namespace touchfield {

/// Gauss-Legendre, 16 points on -1..1: positive nodes and their weights.
inline constexpr std::array<double, 8> kGaussNode = {
    0.0950125098376374402, 0.2816035507792589132, 0.4580167776572273863, 0.6178762444026437484,
    0.7554044083550030339, 0.8656312023878317439, 0.9445750230732325761, 0.9894009349916499326};
inline constexpr std::array<double, 8> kGaussWeight = {
    0.1894506104550684963, 0.1826034150449235889, 0.1691565193950025382, 0.1495959888165767321,
    0.1246289712555338721, 0.0951585116824927848, 0.0622535239386478929, 0.0271524594117540949};

/// Coefficients in powers of t, the lowest first, of the polynomial through f at Chebyshev's nodes on -1..1.
template <std::size_t kCount, typename Value, typename Function>
std::array<Value, kCount> powers(const Function& f) {
  constexpr auto kNodes = static_cast<double>(kCount);
  const auto angle = [](std::size_t q) { return std::numbers::pi * (static_cast<double>(q) + 0.5) / kNodes; };
  std::array<Value, kCount> at_nodes;
  for (std::size_t q = 0; q < kCount; ++q) {
    at_nodes[q] = f(std::cos(angle(q)));
  }
  std::array<Value, kCount> sum{};
  std::array<double, kCount> now{1.0};  // powers of the Chebyshev polynomial T_c
  std::array<double, kCount> before{};
  for (std::size_t c = 0; c < kCount; ++c) {
    const double twice = c == 0 ? 1.0 : 2.0;
    Value coefficient{};
    for (std::size_t q = 0; q < kCount; ++q) {
      coefficient += twice / kNodes * at_nodes[q] * std::cos(static_cast<double>(c) * angle(q));
    }
    std::array<double, kCount> next{};
    for (std::size_t i = 0; i < kCount; ++i) {
      sum[i] += coefficient * now[i];
      next[i] = (i > 0 ? twice * now[i - 1] : 0.0) - before[i];
    }
    before = now;
    now = next;
  }
  return sum;
}

}  // namespace touchfield
