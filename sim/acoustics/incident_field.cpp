#include "sim/acoustics/incident_field.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <type_traits>

#include <Eigen/Geometry>

#include "sim/acoustics/source_loops.h"
#include "solvers/linear/blas_product.h"
#include "solvers/linear/instruction_level.h"

namespace touchfield {

namespace {

/// exp(i kappa s) for the complex wavenumber kappa = k + i alpha.
Complex phase_factor(const Complex& wavenumber, double s) {
  return std::polar(std::exp(-wavenumber.imag() * s), wavenumber.real() * s);
}

/// Incident pressure of channel n at x and unit drive.
Complex channel_pressure(const TransducerArray& array, const Wave& wave, Eigen::Index n, const Vector3& x) {
  if (array.kind == TransducerArray::Kind::kPlaneWave) {
    return array.amplitudes(n) * phase_factor(wave.wavenumber(), array.axes.col(n).dot(x));
  }
  const Vector3 offset = x - array.positions.col(n);
  const double r = offset.norm();
  const double directivity = array.directivity.value(array.axes.col(n).dot(offset) / r);
  return (array.amplitudes(n) * directivity / r) * phase_factor(wave.wavenumber(), r);
}

/// Its derivative along a direction.
Complex channel_derivative(const TransducerArray& array, const Wave& wave, Eigen::Index n, const Vector3& x,
                           const Vector3& direction) {
  const Complex ik = Complex(0, 1) * wave.wavenumber();
  if (array.kind == TransducerArray::Kind::kPlaneWave) {
    return ik * array.axes.col(n).dot(direction) * channel_pressure(array, wave, n, x);
  }
  const Vector3 offset = x - array.positions.col(n);
  const double r = offset.norm();
  const Vector3 radial = offset / r;
  const Vector3 axis = array.axes.col(n);
  const double sin_theta = axis.cross(radial).norm();
  const double cos_theta = axis.dot(radial);
  const DirectivityValue d = array.directivity.at(std::atan2(sin_theta, cos_theta));
  // grad theta = (cos(theta) radial - axis) / (r sin(theta)). On the axis a slope is not defined (a spline's need not
  // vanish there); its mean over all sides is zero.
  const double theta_slope = sin_theta > 1e-12 ? (cos_theta * radial - axis).dot(direction) / (r * sin_theta) : 0.0;
  const Complex radial_slope = (ik - 1.0 / r) * radial.dot(direction) * d.value;
  return (array.amplitudes(n) / r) * phase_factor(wave.wavenumber(), r) * (radial_slope + d.slope * theta_slope);
}

constexpr Eigen::Index kPanel = 32;  // points: the values of 1,500 channels stay in the second cache

template <typename Real>
using Values = Eigen::Matrix<std::complex<Real>, Eigen::Dynamic, Eigen::Dynamic>;

template <typename Real>
SourceLoop<Real> loop_of() {
  const SourceLoops& loops = source_loops(instruction_level());
  if constexpr (std::is_same_v<Real, double>) {
    return loops.exact;
  } else {
    return loops.single;
  }
}

/// The pressures of all channels at a point, or their derivatives along a direction, by the loop over them where that
/// knows the array, else one by one.
template <typename Real>
class ChannelValues {
 public:
  ChannelValues(const TransducerArray& array, const Wave& wave, const Points& points) : array_(array), wave_(wave) {
    constexpr double kLargestPhase = std::is_same_v<Real, double> ? 1e5 : 1e4;  // of the loop over transducers
    const bool known = array.kind != TransducerArray::Kind::kPlaneWave &&
                       array.directivity.kind() != Directivity::Kind::kPiston && wave.wavenumber().imag() == 0.0;
    if (!known || array.size() == 0 || points.cols() == 0) {
      return;
    }
    const double reach = points.colwise().norm().maxCoeff() + array.positions.colwise().norm().maxCoeff();
    fast_ = wave.k() * reach < kLargestPhase;
    places_ = array.positions.transpose().cast<Real>();
    axes_ = array.axes.transpose().cast<Real>();
    amplitudes_ = array.amplitudes.cast<Real>();
    if (const double* spline = array.directivity.spline()) {
      spline_ = Eigen::Map<const Eigen::VectorXd>(spline, 4 * Directivity::kIntervals).cast<Real>();
    }
  }

  /// direction   null for the pressures
  /// values      N
  void at(const Vector3& x, const Vector3* direction, std::complex<Real>* values) const {
    if (!fast_) {
      for (Eigen::Index n = 0; n < array_.size(); ++n) {
        values[n] =
            static_cast<std::complex<Real>>(direction != nullptr ? channel_derivative(array_, wave_, n, x, *direction)
                                                                 : channel_pressure(array_, wave_, n, x));
      }
      return;
    }
    using Place = Eigen::Matrix<Real, 3, 1>;
    const SourceWave<Real> shared{static_cast<Real>(wave_.k()), spline_.size() > 0 ? spline_.data() : nullptr,
                                  Directivity::kIntervals, static_cast<Real>(Directivity::kInterval)};
    const SourceArrays<Real> sources{places_.col(0).data(), places_.col(1).data(), places_.col(2).data(),
                                     axes_.col(0).data(),   axes_.col(1).data(),   axes_.col(2).data(),
                                     amplitudes_.data()};
    const Place point = x.cast<Real>();
    const Place along = direction != nullptr ? Place(direction->cast<Real>()) : Place::Zero();
    static const SourceLoop<Real> loop = loop_of<Real>();
    loop(shared, point.data(), direction != nullptr ? along.data() : nullptr, sources, static_cast<int>(array_.size()),
         reinterpret_cast<Real*>(values));
  }

 private:
  const TransducerArray& array_;
  const Wave& wave_;
  bool fast_ = false;
  Eigen::Matrix<Real, Eigen::Dynamic, 3> places_;
  Eigen::Matrix<Real, Eigen::Dynamic, 3> axes_;
  Eigen::Vector<Real, Eigen::Dynamic> amplitudes_;
  Eigen::Vector<Real, Eigen::Dynamic> spline_;
};

/// Calls take(begin, values), values N x count, on panels of points, each filled by fill(j, column).
template <typename Real, typename Fill, typename Take>
void for_panels(const TransducerArray& array, const Points& points, const Fill& fill, const Take& take) {
  const Eigen::Index panels = (points.cols() + kPanel - 1) / kPanel;
#pragma omp parallel
  {
    Values<Real> values(array.size(), kPanel);
#pragma omp for schedule(static)
    for (Eigen::Index panel = 0; panel < panels; ++panel) {
      const Eigen::Index begin = panel * kPanel;
      const Eigen::Index count = std::min(kPanel, points.cols() - begin);
      for (Eigen::Index j = 0; j < count; ++j) {
        fill(begin + j, values.col(j).data());
      }
      take(begin, count, values);
    }
  }
}

/// sum over channels n of the value n at point j times c_n q_n, at every point j: values of a panel of points meet all
/// drives in one product, in the precision of Real.
template <typename Real, typename Fill>
Eigen::MatrixXcd summed(const TransducerArray& array, const Points& points, const Eigen::MatrixXcd& drive,
                        const Fill& fill) {
  using Matrix = Values<Real>;
  Eigen::MatrixXcd sums = Eigen::MatrixXcd::Zero(points.cols(), drive.cols());
  if (drive.size() == 0) {
    return sums;
  }
  const Matrix q = array.response.as_designed()
                       ? Matrix(drive.cast<std::complex<Real>>())
                       : Matrix((factors(array.response).asDiagonal() * drive).cast<std::complex<Real>>());
  for_panels<double>(array, points, fill, [&](Eigen::Index begin, Eigen::Index count, const Eigen::MatrixXcd& values) {
    Matrix products(kPanel, q.cols());
    if constexpr (std::is_same_v<Real, double>) {
      multiply(Op::kTransposed, values.leftCols(count), Op::kPlain, q, products.topRows(count));
    } else {
      const Matrix rounded = values.leftCols(count).cast<std::complex<Real>>();
      multiply(Op::kTransposed, rounded, Op::kPlain, q, products.topRows(count));
    }
    sums.middleRows(begin, count) = products.topRows(count).template cast<Complex>();
  });
  return sums;
}

template <typename Fill>
Eigen::MatrixXcd summed(const TransducerArray& array, const Points& points, const Eigen::MatrixXcd& drive,
                        const Fill& fill, bool single) {
  return single ? summed<float>(array, points, drive, fill) : summed<double>(array, points, drive, fill);
}

/// The values of all channels at every point times c_n, points by channels.
template <typename Real, typename Fill>
Values<Real> matrix_of(const TransducerArray& array, const Points& points, const Fill& fill) {
  Values<Real> g(points.cols(), array.size());
  for_panels<Real>(array, points, fill, [&](Eigen::Index begin, Eigen::Index count, const Values<Real>& values) {
    g.middleRows(begin, count) = values.leftCols(count).transpose();
  });
  if (!array.response.as_designed()) {
    g *= factors(array.response).template cast<std::complex<Real>>().asDiagonal();
  }
  return g;
}

/// Fills in the pressures, or their derivatives along directions, at a point.
template <typename Real = double>
auto pressures_at(const TransducerArray& array, const Wave& wave, const Points& points) {
  return [&points, channels = ChannelValues<Real>(array, wave, points)](Eigen::Index j, std::complex<Real>* values) {
    channels.at(points.col(j), nullptr, values);
  };
}
template <typename Real = double>
auto derivatives_at(const TransducerArray& array, const Wave& wave, const Points& points, const Points& directions) {
  return [&points, &directions, channels = ChannelValues<Real>(array, wave, points)](Eigen::Index j,
                                                                                     std::complex<Real>* values) {
    const Vector3 direction = directions.col(j);
    channels.at(points.col(j), &direction, values);
  };
}

}  // namespace

const SourceLoops& source_loops(InstructionLevel level) {
#ifdef __x86_64__
  static constexpr const SourceLoops* kLevels[] = {&generic::kSourceLoops, &v2::kSourceLoops, &v3::kSourceLoops,
                                                   &v4::kSourceLoops};
  return *kLevels[static_cast<std::size_t>(level)];
#else
  return generic::kSourceLoops;
#endif
}

Eigen::MatrixXcd incident_matrix(const TransducerArray& array, const Wave& wave, const Points& points) {
  return matrix_of<double>(array, points, pressures_at(array, wave, points));
}

Eigen::MatrixXcf incident_matrix_single(const TransducerArray& array, const Wave& wave, const Points& points) {
  return matrix_of<float>(array, points, pressures_at<float>(array, wave, points));
}

Eigen::MatrixXcd incident_derivative_matrix(const TransducerArray& array, const Wave& wave, const Points& points,
                                            const Points& directions) {
  return matrix_of<double>(array, points, derivatives_at(array, wave, points, directions));
}

Eigen::MatrixXcf incident_derivative_matrix_single(const TransducerArray& array, const Wave& wave, const Points& points,
                                                   const Points& directions) {
  return matrix_of<float>(array, points, derivatives_at<float>(array, wave, points, directions));
}

Eigen::MatrixXcd incident_pressure(const TransducerArray& array, const Wave& wave, const Points& points,
                                   const Eigen::MatrixXcd& drive, bool single) {
  return summed(array, points, drive, pressures_at(array, wave, points), single);
}

Eigen::MatrixXcd incident_derivative(const TransducerArray& array, const Wave& wave, const Points& points,
                                     const Points& directions, const Eigen::MatrixXcd& drive, bool single) {
  return summed(array, points, drive, derivatives_at(array, wave, points, directions), single);
}

double shock_distance_share(const TransducerArray& array, const Wave& wave, const Eigen::VectorXcd& drive,
                            const Vector3& from, const Vector3& to, int points) {
  const double step = (to - from).norm() / points;
  if (step == 0.0) {
    return 0.0;
  }
  const Eigen::RowVectorXd shares = (Eigen::RowVectorXd::LinSpaced(points, 0.5, points - 0.5)) / points;
  const Points way = ((to - from) * shares).colwise() + from;
  const Medium& medium = wave.medium();
  const double pressures = incident_pressure(array, wave, way, drive).cwiseAbs().sum();
  return kNonlinearityOfAir * wave.k() / (medium.density * medium.sound_speed * medium.sound_speed) * step * pressures;
}

Vector3 wave_front_begin(const TransducerArray& array, const Wave& wave, const Vector3& to) {
  if (array.kind == TransducerArray::Kind::kPlaneWave) {
    throw std::logic_error("a plane wave has no centre");
  }
  const Vector3 centre = array.positions.rowwise().mean();
  const Vector3 way = to - centre;
  const double length = way.norm();
  if (length == 0.0) {
    return to;
  }
  // The way leaves the sphere of a wavelength about a transducer where s solves |centre + s way - x_n| = wavelength.
  double begin = 0.0;
  for (Eigen::Index n = 0; n < array.size(); ++n) {
    const Vector3 offset = array.positions.col(n) - centre;
    const double along = offset.dot(way) / length;
    const double half_chord_2 = std::pow(wave.wavelength(), 2) - (offset.squaredNorm() - along * along);
    if (half_chord_2 > 0.0) {
      begin = std::max(begin, along + std::sqrt(half_chord_2));
    }
  }
  return begin < length ? Vector3(centre + begin / length * way) : to;
}

double plane_wave_harmonic(int n, double sigma) {
  const double x = n * sigma;
  return x > 0.0 ? 2.0 * ::jn(n, x) / x : (n == 1 ? 1.0 : 0.0);
}

}  // namespace touchfield
