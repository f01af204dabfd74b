#include "sim/acoustics/nonlinearity.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "sim/acoustics/incident_field.h"

namespace touchfield {

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
