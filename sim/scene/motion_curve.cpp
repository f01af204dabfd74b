#include "sim/scene/motion_curve.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace touchfield {

namespace {

constexpr double kTurn = 2.0 * std::numbers::pi;

/// Slope at the end of a chord of length h, from it and the chord beyond.
double end_slope(double h, double chord, double next_h, double next_chord) {
  const double slope = ((2.0 * h + next_h) * chord - h * next_chord) / (h + next_h);
  if (slope * chord <= 0.0) {
    return 0.0;
  }
  return chord * next_chord < 0.0 && std::abs(slope) > 3.0 * std::abs(chord) ? 3.0 * chord : slope;
}

std::vector<double> monotone_slopes(const std::vector<std::array<double, 2>>& keys) {
  const std::size_t n = keys.size();
  std::vector<double> slopes(n, 0.0);
  if (n < 2) {
    return slopes;
  }
  std::vector<double> h(n - 1);
  std::vector<double> chord(n - 1);
  for (std::size_t i = 0; i + 1 < n; ++i) {
    h[i] = keys[i + 1][0] - keys[i][0];
    chord[i] = (keys[i + 1][1] - keys[i][1]) / h[i];
  }
  if (n == 2) {
    return {chord[0], chord[0]};
  }
  for (std::size_t i = 1; i + 1 < n; ++i) {
    if (chord[i - 1] * chord[i] > 0.0) {
      const double before = 2.0 * h[i] + h[i - 1];
      const double after = h[i] + 2.0 * h[i - 1];
      slopes[i] = (before + after) / (before / chord[i - 1] + after / chord[i]);
    }
  }
  slopes.front() = end_slope(h[0], chord[0], h[1], chord[1]);
  slopes.back() = end_slope(h[n - 2], chord[n - 2], h[n - 3], chord[n - 3]);
  return slopes;
}

}  // namespace

MotionCurve::MotionCurve(MotionLaw law, double own) : law_(std::move(law)), own_(own) {
  if (const auto* through = std::get_if<KeysLaw>(&law_)) {
    slopes_ = monotone_slopes(through->keys);
  }
}

double MotionCurve::operator()(double seconds) const {
  return std::visit([&](const auto& law) { return at(law, seconds); }, law_);
}

double MotionCurve::at(const SineLaw& law, double seconds) const {
  return law.about.value_or(own_) + law.amplitude * std::sin(kTurn * law.hz * seconds + law.phase);
}

double MotionCurve::at(const RateLaw& law, double seconds) const { return own_ + law.rate * seconds; }

double MotionCurve::at(const KeysLaw& law, double seconds) const {
  const auto& keys = law.keys;
  const auto after =
      std::ranges::upper_bound(keys, seconds, {}, [](const std::array<double, 2>& key) { return key[0]; });
  if (after == keys.begin()) {
    return keys.front()[1];
  }
  if (after == keys.end()) {
    return keys.back()[1];
  }
  const auto& [from, first] = *(after - 1);
  const auto& [to, last] = *after;
  const auto i = static_cast<std::size_t>(after - keys.begin());
  const double h = to - from;
  const double s = (seconds - from) / h;
  const double r = 1.0 - s;
  const double value = r * r * ((1.0 + 2.0 * s) * first + s * h * slopes_[i - 1]) +
                       s * s * ((1.0 + 2.0 * r) * last - r * h * slopes_[i]);
  return std::clamp(value, std::min(first, last), std::max(first, last));  // of rounding
}

std::vector<double> MotionCurve::turns(double seconds) const {
  std::vector<double> times = {0.0};
  if (const auto* through = std::get_if<KeysLaw>(&law_)) {
    for (const auto& [time, value] : through->keys) {
      if (time > 0.0 && time < seconds) {
        times.push_back(time);
      }
    }
  } else if (const auto* sine = std::get_if<SineLaw>(&law_)) {
    // The first highest and the first lowest point; later ones are as high and low.
    const double quarter = 0.25 - sine->phase / kTurn;  // of a period, a turn later or earlier too
    for (const double turn : {quarter - std::floor(quarter), quarter + 0.5 - std::floor(quarter + 0.5)}) {
      if (turn > 0.0 && turn < seconds * sine->hz) {
        times.push_back(turn / sine->hz);
      }
    }
    std::ranges::sort(times);
  }
  times.push_back(seconds);
  return times;
}

}  // namespace touchfield
