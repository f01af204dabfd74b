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
  /// A spectrum times a function of the radius.
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
    const auto bessel = [](int order, double x) { return order == 0 ? ::j0(x) : ::j1(x); };
    cut_.resize(static_cast<Index>(squares.size()), nodes_.size());
    for (Index row = 0; row < cut_.rows(); ++row) {
      const double a = step * std::sqrt(static_cast<double>(squares[static_cast<std::size_t>(row)]));
      for (Index column = 0; column < cut_.cols(); ++column) {
        const double b = nodes_(column);
        const double lommel =
            kCut * (a * bessel(1, a * kCut) * bessel(0, b * kCut) - b * bessel(0, a * kCut) * bessel(1, b * kCut)) /
            (a * a - b * b);
        cut_(row, column) = lommel * b * weights(column);
      }
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

/// The surface, then the receptors' depths.
std::vector<double> receptor_depths() {
  std::vector<double> depths = {0.0};
  depths.insert(depths.end(), kReceptorDepths.begin(), kReceptorDepths.end());
  return depths;
}

SkinVibration silent(const TissueModel& skin, Index lines, Index points) {
  SkinVibration sum;
  sum.skin = skin.name;
  sum.has_mechanics = skin.layers.has_value();
  const Eigen::MatrixXd zero = Eigen::MatrixXd::Zero(SkinVibration::kSide, SkinVibration::kSide);
  sum.displacement = zero;
  sum.velocity = zero;
  sum.weighted.fill(zero);
  if (sum.has_mechanics) {
    sum.energy.fill(zero);
  }
  sum.at_points.setZero(lines, points);
  return sum;
}

/// Adds the squares of a line; at_points is of this line alone.
class LineAdder {
 public:
  LineAdder(const FlatPlane& plane, const TissueModel& skin, const std::vector<Eigen::MatrixXcd>& points)
      : plane_(plane), skin_(skin), points_(points) {}

  void add(double hz, const Eigen::MatrixXcd& spectrum, Index line, SkinVibration& sum) const {
    const double omega = kTurn * hz;
    Eigen::MatrixXcd moved = spectrum;
    if (skin_.layers) {
      const std::vector<SkinWaves> waves = skin_waves(*skin_.layers, omega, plane_.nodes(), receptor_depths());
      const Eigen::MatrixXcd tables = plane_.cut(at_nodes(waves));
      moved = plane_.times(spectrum, tables.col(0));
      for (std::size_t d = 0; d < kReceptorDepths.size(); ++d) {
        const Index first = 1 + 3 * static_cast<Index>(d);
        sum.energy[d] += 0.5 * waves[d + 1].modulus * strain_squares(spectrum, tables.middleCols<3>(first));
      }
    }
    const Eigen::MatrixXd squares = plane_.map(moved).cwiseAbs2();
    sum.displacement += 0.5 * squares;
    sum.velocity += 0.5 * omega * omega * squares;
    for (std::size_t c = 0; c < kTouchChannels.size(); ++c) {
      if (const std::optional<double> threshold = relative_threshold(kTouchChannels[c], hz)) {
        sum.weighted[c] += 0.5 * std::pow(10.0, -*threshold / 10.0) * squares;
      }
    }
    for (std::size_t p = 0; p < points_.size(); ++p) {
      sum.at_points(line, static_cast<Index>(p)) = points_[p].cwiseProduct(moved).sum();
    }
  }

 private:
  /// The displacement, then of each depth e_xx / k^2, e_zz, e_xz / k of a wave along x.
  Eigen::MatrixXcd at_nodes(const std::vector<SkinWaves>& waves) const {
    const Eigen::ArrayXd& k = plane_.nodes();
    Eigen::MatrixXcd values(k.size(), 1 + 3 * static_cast<Index>(kReceptorDepths.size()));
    values.col(0) = waves.front().inwards;
    for (std::size_t d = 1; d < waves.size(); ++d) {
      const Index first = 3 * static_cast<Index>(d) - 2;
      values.col(first) = waves[d].e_xx / (k * k);
      values.col(first + 1) = waves[d].e_zz;
      values.col(first + 2) = waves[d].e_xz / k;
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

void merge(const SkinVibration& part, SkinVibration& sum) {
  sum.displacement += part.displacement;
  sum.velocity += part.velocity;
  sum.at_points += part.at_points;
  for (std::size_t c = 0; c < sum.weighted.size(); ++c) {
    sum.weighted[c] += part.weighted[c];
  }
  for (std::size_t d = 0; sum.has_mechanics && d < sum.energy.size(); ++d) {
    sum.energy[d] += part.energy[d];
  }
}

/// Roots of the squares, and nothing off the patch.
void finish(SkinVibration& sum) {
  const double middle = 0.5 * (SkinVibration::kSide - 1);
  const auto leave_out = [middle](Eigen::MatrixXd& map) {
    for (Index i = 0; i < map.rows(); ++i) {
      for (Index j = 0; j < map.cols(); ++j) {
        if (std::hypot(static_cast<double>(i) - middle, static_cast<double>(j) - middle) > middle) {
          map(i, j) = std::numeric_limits<double>::quiet_NaN();
        }
      }
    }
  };
  std::ranges::for_each(sum.energy, leave_out);
  std::vector<Eigen::MatrixXd*> squares = {&sum.displacement, &sum.velocity};
  for (Eigen::MatrixXd& weighted : sum.weighted) {
    squares.push_back(&weighted);
  }
  for (Eigen::MatrixXd* map : squares) {
    *map = map->cwiseSqrt();
    leave_out(*map);
  }
}

}  // namespace

PressureLines modulated_lines(const Eigen::VectorXd& radiation, double hz) {
  PressureLines lines{.hz = {hz, 2.0 * hz}, .pressure = Eigen::MatrixXcd(radiation.size(), 2)};
  lines.pressure << 0.5 * radiation, 0.125 * radiation;
  return lines;
}

PressureLines frame_lines(const Eigen::MatrixXd& radiation, double rate, double highest) {
  constexpr double kLeast = 1e-8;
  const Index frames = radiation.cols();
  const auto count = static_cast<double>(frames);
  const auto lines = static_cast<Index>(std::floor(highest * count / rate * (1.0 + 1e-12)));
  Eigen::MatrixXcd series(frames, lines);
  for (Index m = 1; m <= lines; ++m) {
    const double turn = std::numbers::pi * static_cast<double>(m) / count;
    for (Index f = 0; f < frames; ++f) {
      series(f, m - 1) = 2.0 / count * std::sin(turn) / turn *
                         std::polar(1.0, turn + kTurn * static_cast<double>((f * m) % frames) / count);
    }
  }
  const Eigen::MatrixXcd all = radiation * series;
  const Eigen::VectorXd squares = all.cwiseAbs2().colwise().sum();
  std::vector<Index> kept;
  PressureLines found;
  for (Index m = 0; m < lines; ++m) {
    if (squares(m) > kLeast * squares.maxCoeff()) {
      kept.push_back(m);
      found.hz.push_back(static_cast<double>(m + 1) * rate / count);
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
  std::vector<SkinVibration> parts(skins.size() * kParts);
#pragma omp parallel for schedule(dynamic)
  for (Index part = 0; part < static_cast<Index>(parts.size()); ++part) {
    const TissueModel& skin = skins[static_cast<std::size_t>(part / kParts)];
    SkinVibration& sum = parts[static_cast<std::size_t>(part)];
    sum = silent(skin, count, static_cast<Index>(points.size()));
    const LineAdder adder(plane, skin, at_points);
    for (Index line = part % kParts; line < count; line += kParts) {
      const auto at = static_cast<std::size_t>(line);
      adder.add(lines.hz[at], spectra[at], line, sum);
    }
  }
  std::vector<SkinVibration> all;
  for (std::size_t s = 0; s < skins.size(); ++s) {
    all.push_back(std::move(parts[s * kParts]));
    for (std::size_t part = 1; part < kParts; ++part) {
      merge(parts[s * kParts + part], all.back());
    }
    finish(all.back());
  }
  return all;
}

MapPeak peak_of(const Eigen::MatrixXd& map) {
  MapPeak peak{};
  peak.value = map.maxCoeff<Eigen::PropagateNumbers>(&peak.row, &peak.column);
  return peak;
}

double half_area(const Eigen::MatrixXd& map) {
  const double half = 0.5 * peak_of(map).value;
  const double rim = 0.5 * (SkinVibration::kSide - 1) - 1.0;
  Index cells = 0;
  for (Index i = 0; i < map.rows(); ++i) {
    for (Index j = 0; j < map.cols(); ++j) {
      if (map(i, j) >= half) {
        ++cells;
        const double middle = rim + 1.0;
        if (std::hypot(static_cast<double>(i) - middle, static_cast<double>(j) - middle) > rim) {
          return std::numeric_limits<double>::quiet_NaN();
        }
      }
    }
  }
  return static_cast<double>(cells) * SkinVibration::kStep * SkinVibration::kStep;
}

double map_at(const Eigen::MatrixXd& map, const Eigen::Vector2d& place) {
  const Eigen::Array2d steps = (place.array() + SkinPatch::kReach) / SkinVibration::kStep;
  const Eigen::Array2d low = steps.floor().max(0.0).min(SkinVibration::kSide - 2.0);
  const Eigen::Array2d part = steps - low;
  if ((part < 0.0).any() || (part > 1.0).any()) {
    return std::numeric_limits<double>::quiet_NaN();
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
