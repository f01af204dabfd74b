#pragma once

#include <array>
#include <vector>

#include "sim/acoustics/medium.h"
#include "sim/core/rigid_motion.h"
#include "sim/core/types.h"
#include "sim/core/units.h"
#include "solvers/phase/surface.h"

namespace touchfield {

/// What real channels make of their drives: channel n radiates gain_n exp(i phase_n) times what it was designed to.
/// Both empty: every channel is as designed.
struct ChannelResponse {
  Eigen::VectorXd gain;   // N, >= 0; 0: dead
  Eigen::VectorXd phase;  // N [rad]

  bool as_designed() const { return gain.size() == 0; }
};

/// gain_n exp(i phase_n) of a response that is not as designed.
Eigen::VectorXcd factors(const ChannelResponse& response);

/// One response after the other: gains multiply, phases add. Sizes are the same, or one is as designed.
ChannelResponse product(const ChannelResponse& first, const ChannelResponse& second);

/// Gains and phases are normal, independent from channel to channel. Channel n gets the same three numbers whatever the
/// tolerances and N are, so that larger tolerances with one seed are the same array made worse. A gain below 0 becomes
/// 0.
///
/// seed   the same seed gives the same numbers on every machine, but for the rounding of log, cos and sin
ChannelResponse random_response(Eigen::Index channels, const ChannelTolerances& tolerances, unsigned seed);

/// Directivity and its slope at one angle.
struct DirectivityValue {
  double value;
  double slope;  // d value / d theta [1/rad]
};

/// How strongly a transducer radiates at an angle from its axis, relative to the axis.
///
///   omni      1
///   piston    2 J1(x)/x, x = k b sin(theta), b the radius
///   t4010a1   natural cubic spline in theta through measured values at 0, 10, ... 90 degrees, mirrored past 90
///
/// source: t4010a1: the AUTD3 library's table for that transducer
class Directivity {
 public:
  enum class Kind { kOmni, kPiston, kT4010a1 };

  static Directivity omni();
  /// k [rad/m] and radius b [m], both > 0; throws InputError otherwise
  static Directivity piston(double k, double radius);
  static Directivity t4010a1();

  Kind kind() const { return kind_; }
  /// k b of a piston.
  double ka() const { return ka_; }

  /// cos_theta in -1..1 (values beyond by rounding are clamped).
  double value(double cos_theta) const;
  /// theta in 0..pi.
  DirectivityValue at(double theta) const;

  static constexpr int kIntervals = 9;  // of t4010a1, each kInterval wide
  static constexpr double kInterval = 10.0 * kDegree;
  /// Its pieces, kIntervals x {c0, c1, c2, c3} of c0 + c1 t + c2 t^2 + c3 t^3, t in rad from the interval's begin; null
  /// for the other kinds.
  const double* spline() const { return kind_ == Kind::kT4010a1 ? spline_.front().data() : nullptr; }

 private:
  explicit Directivity(Kind kind, double ka = 0.0);

  Kind kind_;
  double ka_;  // k b of a piston
  std::array<std::array<double, 4>, kIntervals> spline_{};
};

/// Source strength of the AUTD3's transducer, P0 in p = P0 d exp(ikr)/r: peak pressure times distance [Pa m].
/// source: the AUTD3 library, 275.574 Pa mm times 200 / (4 pi)
inline constexpr double kAutd3SourceStrength = 4.386;
/// Distance of its transducers on a unit [m].
inline constexpr double kAutd3Pitch = 10.16e-3;

/// The channels a run can drive.
///
/// A transducer n at full drive radiates p(x) = amplitude_n d(theta) exp(i k r)/r. A plane wave is one channel with
/// p(x) = amplitude exp(i k axis.x). Either is multiplied by the channel's response.
struct TransducerArray {
  enum class Kind { kTransducers, kPlaneWave };

  Kind kind = Kind::kTransducers;
  Points positions;            // 3 x N [m]
  Points axes;                 // 3 x N unit vectors; of a plane wave: its direction of travel
  Eigen::VectorXd amplitudes;  // N: level P0 [Pa m]; of a plane wave [Pa]
  Directivity directivity = Directivity::omni();
  Eigen::VectorXi device;   // N: unit number from 0
  Eigen::VectorXi channel;  // N: number on its unit from 0
  ChannelResponse response{};

  Eigen::Index size() const { return positions.cols(); }
};

/// Where transducers sit, before strengths: positions and axes, unit and channel numbers.
struct ArrayLayout {
  Points positions;
  Points axes;
  Eigen::VectorXi device;
  Eigen::VectorXi channel;
};

/// count_x x count_y transducers in the plane z = 0, centred on the origin, emitting along +z, x fastest.
/// throws   InputError if a count is below 1 or the pitch [m] is not positive
ArrayLayout grid_layout(int count_x, int count_y, double pitch);

/// One AUTD3 unit: 18 x 14 at the pitch [m] without the cells (1,1), (2,1), (16,1), counted x fastest with the holes
/// skipped: 249 transducers; transducer 0 at the origin, emitting along +z. Board 192.0 x 151.4 mm.
ArrayLayout autd3_unit(double pitch);

/// count_x x count_y AUTD3 units edge to edge, the boards' common centre at the origin.
ArrayLayout autd3_tiles(int count_x, int count_y, double pitch);

/// The open-hardware 16 x 16 array at 10.5 mm, centred on the origin.
ArrayLayout sonicsurface_layout();

/// The same layout moved: x -> rotation x + translation.
ArrayLayout transformed(const ArrayLayout& layout, const Eigen::Matrix3d& rotation, const Vector3& translation);

/// Layouts one after another; devices are numbered on.
ArrayLayout joined(const std::vector<ArrayLayout>& layouts);

/// An array of equal transducers.
/// level             drive of a transducer at full, 0 < level <= 1
/// source_strength   P0 [Pa m], > 0
/// throws            InputError on a value out of range, on no transducer, or on an axis that is not of unit length
TransducerArray make_array(const ArrayLayout& layout, const Directivity& directivity, double level,
                           double source_strength);

/// The same transducers moved: x -> rotation x + shift.
/// throws   std::logic_error on a plane wave, which has no place
TransducerArray moved(const TransducerArray& array, const RigidMotion& motion);

/// One channel: a plane wave of the given amplitude [Pa] along the unit vector `direction`, phase 0 at the origin.
TransducerArray plane_wave(const Vector3& direction, double amplitude);

}  // namespace touchfield
