#pragma once

#include <array>
#include <cmath>
#include <numbers>

namespace touchfield {

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
