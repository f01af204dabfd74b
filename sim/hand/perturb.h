#pragma once

#include <cstdint>

#include "sim/core/types.h"
#include "sim/mesh/query/skin_patches.h"
#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// A smooth random field in space, of zero mean and with the covariance rms^2 exp(-d^2 / (2 L^2)) of points d apart:
///
///   f(x) = rms / sqrt(M) sum_m r_m cos(w_m . x + phi_m)
///
/// It consists of M = 1024 waves. The components of w_m are normal of deviation 1 / L, r_m^2 / 2 is exponential and
/// phi_m uniform. So each wave is the sum of a cosine and a sine with independent normal weights.
///
/// Over the seeds the value at a point is exactly normal and the covariance exact. A difference of two values has a
/// kurtosis of 3 (1 + (1 + rho)^2 / (2 M)), rho their correlation: below 3.006. The covariance of one seed's waves,
/// taken over r and phi, is off by rms^2 (1 - exp(-d^2 / L^2)) / sqrt(2 M) (one deviation). This is 2.2 % of rms^2 at
/// most. The gradient's components have the deviation rms / L.
///
/// source   Rahimi and Recht, Random features for large-scale kernel machines, NIPS 2007; Box and Muller 1958
class RandomField {
 public:
  /// rms           [m]
  /// correlation   L [m], > 0
  /// seed          the same seed gives the same field on every machine, but for the rounding of log and cos
  RandomField(double rms, double correlation, std::uint64_t seed);

  /// n values [m] at 3 x n points [m].
  Eigen::VectorXd at(const Points& points) const;

 private:
  Points wavevectors_;         // 3 x M [rad/m]
  Eigen::ArrayXd phases_;      // [rad]
  Eigen::ArrayXd amplitudes_;  // [m]
};

/// What a sensor makes of a body: its skin displaced along its normals by smooth noise, and the whole moved.
struct SensingNoise {
  double rms = 0;                    // of the displacement over the skin [m], 0 to 3e-3
  double correlation = 5e-3;         // length L over which it decorrelates [m], 1e-3 to 0.1
  Vector3 offset = Vector3::Zero();  // of the whole body [m]
  unsigned seed = 1;
};

/// A perturbed skin, and how much of the noise it carries.
struct Perturbed {
  TriangleMesh mesh;
  double rms;          // of the displacement over the skin, without the offset [m]
  double drawn_rms;    // the same before damping: the seed's own, scattered round the noise's rms
  double damped_area;  // share of the skin (0 to 1) where more than 5 % of the displacement was taken away
};

/// The mesh with its vertices moved along smooth normals, then by the offset. A smooth normal is the mean over the
/// faces round a vertex, weighted by area. The displacement is a random Gaussian field of zero mean. Points of the skin
/// at a distance d in space have the covariance rms^2 exp(-d^2 / (2 L^2)). The field is realised in space
/// (RandomField): the same seed and noise give the same field at the same point, whatever the mesh. So a finer mesh
/// of the body gets the same displacement. On a sphere of radius R, meshes of edge h and h / 2 differ by about 1.5
/// (h / R)^2 rms, because of their normals and radii.
///
/// Neither the mean nor the rms over one skin is forced: that would make the field depend on the body and its mesh. On
/// a body of few L it would also take away much of the field's long waves. Mean and rms scatter from seed to seed as
/// those of any such field. Over a skin of area A >> L^2 the rms scatters by sqrt(pi L^2 / (2 A)) of itself.
///
/// The displacement is damped where the skin would cut itself, turn a face by more than 84 degrees or make it four
/// times as thin. It is also damped where a displacement larger by a fifth would do so. The skin would cut itself in
/// narrow gaps, folds and thin parts tighter than the displacement. Damping works in rounds. Each round takes a quarter
/// of the displacement away at the faces in question, and exp(-s^2 / (2 R^2)) of that quarter at a distance s from
/// them. R is the lesser of L and 10 rms, but two mean edges at least. Beyond 4 R nothing changes.
///
/// mesh      closed, oriented outwards, without self-intersections
/// returns   the same triangles on moved vertices, without self-intersections
/// throws    InputError on a value out of range, a mesh that cuts itself, or if damping takes more than a fifth of the
///           rms away; the message says where, and an rms (found by halving, tried) that would do with this seed, if
///           one was found
Perturbed perturbed(const TriangleMesh& mesh, const SensingNoise& noise);

/// Patches of the same skin, each moved as a whole along its normal by the field at its centre, without damping, then
/// by the offset.
SkinPatches perturbed(SkinPatches patches, const SensingNoise& noise);

}  // namespace touchfield
