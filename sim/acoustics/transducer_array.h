#pragma once

#include <vector>

#include "sim/acoustics/channel_response.h"
#include "sim/acoustics/directivity.h"
#include "sim/acoustics/medium.h"
#include "sim/core/rigid_motion.h"
#include "sim/core/types.h"

namespace touchfield {

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
