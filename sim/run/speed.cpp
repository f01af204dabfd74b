#include "sim/run/speed.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <exception>
#include <limits>

#include <fmt/format.h>
#include <omp.h>

#include "sim/bem/layer_sum.h"
#include "solvers/linear/dense_lu.h"

namespace touchfield {

namespace {

template <typename Work>
double seconds_of(const Work& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace

double product_seconds(const TriangleMesh& mesh, const Wave& wave) {
  constexpr Eigen::Index kTimedPairs = 30'000'000;
  const Eigen::Index rows = std::min({mesh.face_count(), Eigen::Index{1024}, kTimedPairs / mesh.face_count() + 1});
  const LayerSum<float> sum(mesh, wave.wavenumber(), 0.0);
  const Eigen::MatrixXcd x = Eigen::MatrixXcd::Ones(mesh.face_count(), 1);
  sum.apply_head(Layer::kDouble, x, std::min<Eigen::Index>(rows, 16));  // wakes the threads
  double seconds = std::numeric_limits<double>::infinity();
  for (int trial = 0; trial < 3; ++trial) {  // the fastest: others wait for a thread
    seconds = std::min(seconds, seconds_of([&] { sum.apply_head(Layer::kDouble, x, rows); }));
  }
  constexpr double kPairs = 0.55;  // time by pairs over time row by row
  return kPairs * seconds * static_cast<double>(mesh.face_count()) / static_cast<double>(rows);
}

Speed speed_of(const std::function<void()>& work, double operations) {
  constexpr int kTrials = 2;       // the first one also wakes the threads
  constexpr double kGuess = 1e10;  // of a core of about 2015 in double precision
  std::string fault = "it took no time";
  try {
    double fastest = std::numeric_limits<double>::infinity();
    for (int trial = 0; trial < kTrials; ++trial) {
      fastest = std::min(fastest, seconds_of(work));
    }
    const double flops = operations / fastest;
    if (std::isfinite(flops) && flops > 0) {
      return {flops, ""};
    }
  } catch (const std::exception& error) {
    fault = error.what();
  }
  return {kGuess * omp_get_max_threads(),
          fmt::format("this machine's speed could not be measured ({}): times are guesses", fault)};
}

namespace {

Speed measure_lu(Eigen::Index size) {
  // Entries of length one without a pattern, and a diagonal that outweighs its row: far from singular.
  Eigen::MatrixXcd matrix(size, size);
  for (Eigen::Index j = 0; j < size; ++j) {
    for (Eigen::Index i = 0; i < size; ++i) {
      matrix(i, j) = std::polar(1.0, static_cast<double>((i * i + 3 * i * j) % 997));
    }
    matrix(j, j) += 2.0 * static_cast<double>(size);
  }
  return speed_of([&] { const DenseLu lu(matrix); }, 8.0 / 3.0 * std::pow(static_cast<double>(size), 3));
}

template <int kHalvings>
const Speed& speed_at(double rows) {
  constexpr double kSize = kTimedRows / (1 << kHalvings);
  if constexpr (kHalvings < 3) {
    if (rows <= 0.75 * kSize) {
      return speed_at<kHalvings + 1>(rows);
    }
  }
  static const Speed speed = measure_lu(static_cast<Eigen::Index>(kSize));  // a sweep asks for every case
  return speed;
}

}  // namespace

const Speed& measured_speed(double rows) { return speed_at<0>(rows); }

}  // namespace touchfield
