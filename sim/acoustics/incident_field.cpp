#include "sim/acoustics/incident_field.h"

#include <cmath>

#include <Eigen/Geometry>

#include "sim/core/errors.h"

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

/// sum over channels n of channel(n, j) q_n at every point j.
template <typename Channel>
Eigen::MatrixXcd summed(const TransducerArray& array, const Points& points, const Eigen::MatrixXcd& drive,
                        const Channel& channel) {
  Eigen::MatrixXcd sums(points.cols(), drive.cols());
  const Eigen::MatrixXcd by_channel = drive.transpose();  // the inner loop reads a contiguous column
#pragma omp parallel for schedule(static)
  for (Eigen::Index j = 0; j < points.cols(); ++j) {
    auto sum = sums.row(j);
    sum.setZero();
    for (Eigen::Index n = 0; n < array.size(); ++n) {
      sum += channel(n, j) * by_channel.col(n).transpose();
    }
  }
  return sums;
}

}  // namespace

Eigen::MatrixXcd incident_matrix(const TransducerArray& array, const Wave& wave, const Points& points) {
  Eigen::MatrixXcd g(points.cols(), array.size());
#pragma omp parallel for schedule(static)
  for (Eigen::Index n = 0; n < array.size(); ++n) {
    for (Eigen::Index j = 0; j < points.cols(); ++j) {
      g(j, n) = channel_pressure(array, wave, n, points.col(j));
    }
  }
  return g;
}

Eigen::MatrixXcd incident_derivative_matrix(const TransducerArray& array, const Wave& wave, const Points& points,
                                            const Points& directions) {
  Eigen::MatrixXcd g(points.cols(), array.size());
#pragma omp parallel for schedule(static)
  for (Eigen::Index n = 0; n < array.size(); ++n) {
    for (Eigen::Index j = 0; j < points.cols(); ++j) {
      g(j, n) = channel_derivative(array, wave, n, points.col(j), directions.col(j));
    }
  }
  return g;
}

Eigen::MatrixXcd incident_pressure(const TransducerArray& array, const Wave& wave, const Points& points,
                                   const Eigen::MatrixXcd& drive) {
  return summed(array, points, drive,
                [&](Eigen::Index n, Eigen::Index j) { return channel_pressure(array, wave, n, points.col(j)); });
}

Eigen::MatrixXcd incident_derivative(const TransducerArray& array, const Wave& wave, const Points& points,
                                     const Points& directions, const Eigen::MatrixXcd& drive) {
  return summed(array, points, drive, [&](Eigen::Index n, Eigen::Index j) {
    return channel_derivative(array, wave, n, points.col(j), directions.col(j));
  });
}

}  // namespace touchfield
