#include "sim/felt/skin_vibration.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>

#include "sim/bem/polynomials.h"

namespace touchfield {

namespace {

using Eigen::Index;

constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();
constexpr double kTurn = 2.0 * std::numbers::pi;
constexpr double kCut = 30e-3;     // of K in space: more than the patch's diameter [m]
constexpr double kPeriod = 56e-3;  // no image of the patch is nearer to it than kCut [m]

/// Nodes and weights of an integral over wavenumbers that resolves waves of any length: panels of half an octave, none
/// wider than the patch allows.
void radial_nodes(double finest, Eigen::ArrayXd& nodes, Eigen::ArrayXd& weights) {
  constexpr double kWidest = 256.0;  // [rad/m]
  std::vector<double> k;
  std::vector<double> w;
  double to = 0.0;
  for (double from = 0.0; from < finest; from = to) {
    to = std::min({finest, from == 0.0 ? 1.0 : std::numbers::sqrt2 * from, from + kWidest});
    for (std::size_t q = 0; q < kGaussNode.size(); ++q) {
      for (const double side : {-1.0, 1.0}) {
        k.push_back(0.5 * (from + to) + 0.5 * (to - from) * side * kGaussNode[q]);
        w.push_back(0.5 * (to - from) * kGaussWeight[q]);
      }
    }
  }
  nodes = Eigen::ArrayXd::Map(k.data(), static_cast<Index>(k.size()));
  weights = Eigen::ArrayXd::Map(w.data(), static_cast<Index>(w.size()));
}

/// exp(i k x) of places and wavenumbers.
Eigen::MatrixXcd waves_at(const Eigen::VectorXd& places, const Eigen::VectorXd& k) {
  return (std::complex<double>(0.0, 1.0) * (places * k.transpose())).array().exp();
}

/// The flat patch in wavenumbers: a square of multiples of 2 pi / kPeriod along both axes.
class FlatPlane {
 public:
  FlatPlane(const SkinPatch& patch, double finest) {
    const double step = kTurn / kPeriod;
    const auto half = static_cast<Index>(finest / step);
    k_ = step * Eigen::VectorXd::LinSpaced(2 * half + 1, static_cast<double>(-half), static_cast<double>(half));
    scale_ = 1.0 / (kPeriod * kPeriod);
    weights_ = patch.areas.cwiseProduct(patch.fade);
    faces_x_ = waves_at(patch.places.row(0).transpose(), k_);
    faces_y_ = waves_at(patch.places.row(1).transpose(), k_).conjugate();
    const Eigen::VectorXd map = Eigen::VectorXd::LinSpaced(SkinVibration::kSide, -SkinPatch::kReach, SkinPatch::kReach);
    for (std::size_t power = 0; power < map_.size(); ++power) {
      map_[power] = waves_at(map, k_) * k_.array().pow(static_cast<double>(power)).matrix().asDiagonal();
    }
    set_radii(half, step, finest);
  }

  const Eigen::VectorXd& k() const { return k_; }
  const Eigen::ArrayXd& nodes() const { return nodes_; }

  /// P(k) of a pressure on the faces.
  Eigen::MatrixXcd spectrum(const Eigen::VectorXcd& pressure) const {
    return scale_ * faces_x_.adjoint() * (weights_.cwiseProduct(pressure).asDiagonal() * faces_y_);
  }
  /// Columns of functions of |k| at the nodes, cut off in space, on the distinct radii of the square.
  Eigen::MatrixXcd cut(const Eigen::MatrixXcd& at_nodes) const { return cut_ * at_nodes; }
  Eigen::MatrixXcd times(const Eigen::MatrixXcd& spectrum, const Eigen::VectorXcd& by_radius) const {
    return by_radius(radius_.reshaped()).reshaped(spectrum.rows(), spectrum.cols()).cwiseProduct(spectrum);
  }
  /// k_x^a k_y^b times a spectrum, in space, on the grid of the maps.
  Eigen::MatrixXcd map(const Eigen::MatrixXcd& spectrum, std::size_t a = 0, std::size_t b = 0) const {
    return map_[a] * spectrum * map_[b].transpose();
  }

 private:
  /// The transform of J_0's integral up to the cut, by Lommel: int_0^T J_0(a r) J_0(b r) r dr.
  void set_radii(Index half, double step, double finest) {
    std::vector<Index> squares;
    for (Index i = 0; i <= half; ++i) {
      for (Index j = 0; j <= i; ++j) {
        squares.push_back(i * i + j * j);
      }
    }
    std::ranges::sort(squares);
    squares.erase(std::unique(squares.begin(), squares.end()), squares.end());
    radius_.resize(k_.size(), k_.size());
    for (Index i = 0; i < k_.size(); ++i) {
      for (Index j = 0; j < k_.size(); ++j) {
        const Index square = (i - half) * (i - half) + (j - half) * (j - half);
        radius_(i, j) = static_cast<int>(std::ranges::lower_bound(squares, square) - squares.begin());
      }
    }
    Eigen::ArrayXd weights;
    radial_nodes(finest, nodes_, weights);
    const auto count = static_cast<Index>(squares.size());
    const Eigen::ArrayXd a =
        step * Eigen::Map<const Eigen::Array<Index, Eigen::Dynamic, 1>>(squares.data(), count).cast<double>().sqrt();
    const auto order_0 = [](double k) { return ::j0(k * kCut); };
    const auto order_1 = [](double k) { return ::j1(k * kCut); };
    const Eigen::ArrayXd a_0 = a.unaryExpr(order_0);
    const Eigen::ArrayXd a_1 = a.unaryExpr(order_1);
    cut_.resize(count, nodes_.size());
    for (Index column = 0; column < cut_.cols(); ++column) {
      const double b = nodes_(column);
      cut_.col(column) = kCut * (a * a_1 * order_0(b) - b * a_0 * order_1(b)) / (a * a - b * b) * b * weights(column);
    }
  }

  Eigen::VectorXd k_;
  double scale_ = 0.0;
  Eigen::VectorXd weights_;
  Eigen::MatrixXcd faces_x_, faces_y_;
  std::array<Eigen::MatrixXcd, 3> map_;  // by the power of k
  Eigen::MatrixXi radius_;               // number of each wavenumber's radius
  Eigen::ArrayXd nodes_;
  Eigen::MatrixXd cut_;
};

/// Which points of a map are within kReach less some steps.
Eigen::Array<bool, Eigen::Dynamic, Eigen::Dynamic> on_disc(double less = 0.0) {
  constexpr double kMiddle = 0.5 * (SkinVibration::kSide - 1);
  const Eigen::ArrayXd squares = Eigen::ArrayXd::LinSpaced(SkinVibration::kSide, -kMiddle, kMiddle).square();
  return (squares.replicate(1, SkinVibration::kSide) + squares.transpose().replicate(SkinVibration::kSide, 1)).sqrt() <=
         kMiddle - less;
}

/// The surface, then the receptors' depths.
std::vector<double> receptor_depths() {
  std::vector<double> depths = {0.0};
  depths.insert(depths.end(), kReceptorDepths.begin(), kReceptorDepths.end());
  return depths;
}

/// The squares of lines on a skin, a column per map: u, du/dt, W at each depth, u weighted for each channel.
class LineSums {
 public:
  LineSums(const FlatPlane& plane, const TissueModel& skin, const std::vector<Eigen::MatrixXcd>& points)
      : plane_(plane), skin_(skin), points_(points) {}

  static Eigen::MatrixXd zero() {
    return Eigen::MatrixXd::Zero(SkinVibration::kSide * SkinVibration::kSide, 2 + kDepths + kTouchChannels.size());
  }

  /// Adds a line, and returns what it is at the points.
  Eigen::VectorXcd add(double hz, const Eigen::MatrixXcd& spectrum, Eigen::MatrixXd& sums) const {
    const double omega = kTurn * hz;
    Eigen::MatrixXcd moved = spectrum;
    if (skin_.layers) {
      const std::vector<SkinWaves> waves = skin_waves(*skin_.layers, omega, plane_.nodes(), receptor_depths());
      const Eigen::MatrixXcd tables = plane_.cut(at_nodes(waves));
      moved = plane_.times(spectrum, tables.col(0));
      for (Index d = 0; d < kDepths; ++d) {
        sums.col(2 + d) += 0.5 * waves[static_cast<std::size_t>(d) + 1].modulus *
                           strain_squares(spectrum, tables.middleCols<3>(1 + 3 * d)).reshaped();
      }
    }
    const Eigen::VectorXd squares = 0.5 * plane_.map(moved).cwiseAbs2().reshaped();
    sums.col(0) += squares;
    sums.col(1) += omega * omega * squares;
    Index column = 2 + kDepths;
    for (const TouchChannel channel : kTouchChannels) {
      if (const std::optional<double> threshold = relative_threshold(channel, hz)) {
        sums.col(column) += std::pow(10.0, -*threshold / 10.0) * squares;
      }
      ++column;
    }
    Eigen::VectorXcd at_points(static_cast<Index>(points_.size()));
    std::ranges::transform(points_, at_points.begin(),
                           [&](const auto& point) { return point.cwiseProduct(moved).sum(); });
    return at_points;
  }

  /// The maps of the sums.
  SkinVibration finished(const Eigen::MatrixXd& sums) const {
    SkinVibration all;
    all.skin = skin_.name;
    all.has_mechanics = skin_.layers.has_value();
    const auto map = [&](Index column) -> Eigen::MatrixXd {
      return on_disc().select(sums.col(column).reshaped(SkinVibration::kSide, SkinVibration::kSide), kNothing);
    };
    all.displacement = map(0).cwiseSqrt();
    all.velocity = map(1).cwiseSqrt();
    for (Index d = 0; all.has_mechanics && d < kDepths; ++d) {
      all.energy[static_cast<std::size_t>(d)] = map(2 + d);
    }
    for (std::size_t c = 0; c < all.weighted.size(); ++c) {
      all.weighted[c] = map(2 + kDepths + static_cast<Index>(c)).cwiseSqrt();
    }
    return all;
  }

 private:
  static constexpr Index kDepths = kReceptorDepths.size();

  /// The displacement, then of each depth e_xx / k^2, e_zz, e_xz / k of a wave along x.
  Eigen::MatrixXcd at_nodes(const std::vector<SkinWaves>& waves) const {
    const Eigen::ArrayXd& k = plane_.nodes();
    Eigen::MatrixXcd values(k.size(), 1 + 3 * kDepths);
    values.col(0) = waves.front().inwards;
    for (Index d = 0; d < kDepths; ++d) {
      const SkinWaves& at = waves[static_cast<std::size_t>(d) + 1];
      values.middleCols<3>(1 + 3 * d) << at.e_xx / (k * k), at.e_zz, at.e_xz / k;
    }
    return values;
  }

  /// sum_ij |e_ij|^2 of waves in all directions.
  Eigen::MatrixXd strain_squares(const Eigen::MatrixXcd& spectrum, const Eigen::MatrixXcd& tables) const {
    const Eigen::MatrixXcd along = plane_.times(spectrum, tables.col(0));
    const Eigen::MatrixXcd slanted = plane_.times(spectrum, tables.col(2));
    return plane_.map(along, 2, 0).cwiseAbs2() + plane_.map(along, 0, 2).cwiseAbs2() +
           2.0 * plane_.map(along, 1, 1).cwiseAbs2() + plane_.map(plane_.times(spectrum, tables.col(1))).cwiseAbs2() +
           2.0 * (plane_.map(slanted, 1, 0).cwiseAbs2() + plane_.map(slanted, 0, 1).cwiseAbs2());
  }

  const FlatPlane& plane_;
  const TissueModel& skin_;
  const std::vector<Eigen::MatrixXcd>& points_;
};

}  // namespace

PressureLines modulated_lines(const Eigen::VectorXd& radiation, double hz) {
  PressureLines lines{.hz = {hz, 2.0 * hz}, .pressure = Eigen::MatrixXcd(radiation.size(), 2)};
  lines.pressure << 0.5 * radiation, 0.125 * radiation;
  return lines;
}

Eigen::MatrixXcd held_lines(const Eigen::MatrixXd& values, double rate, double highest) {
  constexpr Index kBlock = 64;  // of lines at once: long signals have many
  const Index frames = values.cols();
  const double turn = kTurn / static_cast<double>(frames);
  Eigen::VectorXcd roots(frames);  // by whole steps, so that long signals lose no digits
  for (Index k = 0; k < frames; ++k) {
    roots(k) = std::polar(2.0 / static_cast<double>(frames), turn * static_cast<double>(k));
  }
  const double spacing = rate / static_cast<double>(frames);
  const auto count = static_cast<Index>(std::floor(highest / spacing * (1.0 + 1e-12)));
  Eigen::MatrixXcd lines(values.rows(), count);
  for (Index first = 0; first < count; first += kBlock) {
    Eigen::MatrixXcd series(frames, std::min(kBlock, count - first));
    for (Index line = 0; line < series.cols(); ++line) {
      const Index m = first + line + 1;
      const double half = 0.5 * turn * static_cast<double>(m);
      const std::complex<double> held = std::polar(m % frames == 0 ? 0.0 : std::sin(half) / half, half);
      for (Index k = 0, step = 0; k < frames; ++k, step = (step + m) % frames) {
        series(k, line) = held * roots(step);
      }
    }
    lines.middleCols(first, series.cols()) = values * series;
  }
  return lines;
}

PressureLines frame_lines(const Eigen::MatrixXd& radiation, double rate, double highest) {
  constexpr double kLeast = 1e-8;
  constexpr double kRounding = 1e-24;
  const double spacing = rate / static_cast<double>(radiation.cols());
  const Eigen::MatrixXcd all = held_lines(radiation, rate, highest);
  const Index count = all.cols();
  const Eigen::VectorXd squares = all.cwiseAbs2().colwise().sum();
  const double least = count == 0 ? 0.0 : std::max(kLeast * squares.maxCoeff(), kRounding * radiation.squaredNorm());
  std::vector<Index> kept;
  PressureLines found;
  for (Index line = 0; line < count; ++line) {
    if (squares(line) > least) {
      kept.push_back(line);
      found.hz.push_back(static_cast<double>(line + 1) * spacing);
    }
  }
  found.pressure = all(Eigen::all, kept);
  return found;
}

std::vector<SkinVibration> skin_vibrations(const SkinPatch& patch, const PressureLines& lines,
                                           const std::vector<TissueModel>& skins, double finest,
                                           const std::vector<Eigen::Vector2d>& points) {
  for (const TissueModel& skin : skins) {  // throws here, not in the loops
    if (skin.layers) {
      skin_waves(*skin.layers, 1.0, Eigen::ArrayXd::Ones(1), receptor_depths());
    }
  }
  const FlatPlane plane(patch, finest);
  const auto count = static_cast<Index>(lines.hz.size());
  std::vector<Eigen::MatrixXcd> spectra(lines.hz.size());
#pragma omp parallel for schedule(dynamic)
  for (Index line = 0; line < count; ++line) {
    spectra[static_cast<std::size_t>(line)] = plane.spectrum(lines.pressure.col(line));
  }
  std::vector<Eigen::MatrixXcd> at_points;
  for (const Eigen::Vector2d& point : points) {
    at_points.push_back(waves_at(point.head<1>(), plane.k()).transpose() * waves_at(point.tail<1>(), plane.k()));
  }
  constexpr Index kParts = 8;  // of the lines of a skin, whatever the number of threads
  const auto skin_count = static_cast<Index>(skins.size());
  std::vector<Eigen::MatrixXd> sums(skins.size() * kParts, LineSums::zero());
  std::vector<Eigen::MatrixXcd> found(skins.size(), Eigen::MatrixXcd(count, static_cast<Index>(points.size())));
#pragma omp parallel for schedule(dynamic)
  for (Index part = 0; part < skin_count * kParts; ++part) {
    const auto s = static_cast<std::size_t>(part / kParts);
    const LineSums adder(plane, skins[s], at_points);
    for (Index line = part % kParts; line < count; line += kParts) {
      const auto at = static_cast<std::size_t>(line);
      found[s].row(line) = adder.add(lines.hz[at], spectra[at], sums[static_cast<std::size_t>(part)]);
    }
  }
  std::vector<SkinVibration> all;
  for (std::size_t s = 0; s < skins.size(); ++s) {
    for (std::size_t part = 1; part < kParts; ++part) {
      sums[s * kParts] += sums[s * kParts + part];
    }
    all.push_back(LineSums(plane, skins[s], at_points).finished(sums[s * kParts]));
    all.back().at_points = std::move(found[s]);
  }
  return all;
}

double largest(const Eigen::MatrixXd& map) { return map.maxCoeff<Eigen::PropagateNumbers>(); }

double half_area(const Eigen::MatrixXd& map) {
  const Eigen::Array<bool, Eigen::Dynamic, Eigen::Dynamic> above = map.array() >= 0.5 * largest(map);
  return (above && !on_disc(1.0)).any()
             ? kNothing
             : static_cast<double>(above.count()) * SkinVibration::kStep * SkinVibration::kStep;
}

double map_at(const Eigen::MatrixXd& map, const Eigen::Vector2d& place) {
  const Eigen::Array2d steps = (place.array() + SkinPatch::kReach) / SkinVibration::kStep;
  const Eigen::Array2d low = steps.floor().max(0.0).min(SkinVibration::kSide - 2.0);
  const Eigen::Array2d part = steps - low;
  if ((part < 0.0).any() || (part > 1.0).any()) {
    return kNothing;
  }
  const auto i = static_cast<Index>(low(0));
  const auto j = static_cast<Index>(low(1));
  return (1.0 - part(0)) * ((1.0 - part(1)) * map(i, j) + part(1) * map(i, j + 1)) +
         part(0) * ((1.0 - part(1)) * map(i + 1, j) + part(1) * map(i + 1, j + 1));
}

double dip_between(const Eigen::MatrixXd& map, const Eigen::Vector2d& from, const Eigen::Vector2d& to) {
  constexpr int kSteps = 100;
  Eigen::VectorXd line(kSteps + 1);
  for (int i = 0; i <= kSteps; ++i) {
    const double share = static_cast<double>(i) / kSteps;
    line(i) = map_at(map, (1.0 - share) * from + share * to);
  }
  return line.minCoeff<Eigen::PropagateNaN>() / std::min(line(0), line(kSteps));
}

}  // namespace touchfield
