#pragma once

#include <vector>

#include "sim/acoustics/transducer_array.h"
#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// Distance, in square roots of the area, from which one point stands for a face, as in the scheme itself: the static
/// kernel's integral is then within about 1 %.
inline constexpr double kFarDistance = 5.0;

/// The field off the skin.
struct FieldValues {
  Eigen::MatrixXcd pressure;          // J x S [Pa]
  std::vector<unsigned char> inside;  // J: 1 inside the body
};

/// What the boundary integral gives at any point, inside the body too (there it should vanish),
///
///   p(x) = G(x) q + sum_f p_f int_f dg/dn_y (x, y) dS_y
///
/// one point a face at five face sizes (square root of the area) or more, the integral over the face nearer by. The
/// error is that of a constant pressure on each face; one edge length or more from the skin it is about that of the
/// surface pressure itself.
///
/// points     3 x J [m]
/// surface    M x S [Pa]: pressures on the faces, one column a solution
/// drive      N x S: the drives that caused them
/// returns    the integral as it is, and which points have a solid angle of more than 2 pi, i.e. lie inside
FieldValues boundary_integral(const TriangleMesh& mesh, const TransducerArray& array, const Wave& wave,
                              const Points& points, const Eigen::MatrixXcd& surface, const Eigen::MatrixXcd& drive);

/// The same with 0 at the points inside the body.
FieldValues evaluate_field(const TriangleMesh& mesh, const TransducerArray& array, const Wave& wave,
                           const Points& points, const Eigen::MatrixXcd& surface, const Eigen::MatrixXcd& drive);

/// The same of what is known but for the faces nearer to a point than kFarDistance, whose integrals are added.
///
/// far       J x S [Pa]: the incident field and the other faces
/// winding   J: the other faces' solid angle over 4 pi, negative where they are seen from behind
/// near      J: how many faces are so near
FieldValues with_near_faces(const TriangleMesh& mesh, const Wave& wave, const Points& points,
                            const Eigen::MatrixXcd& surface, Eigen::MatrixXcd far, const Eigen::VectorXd& winding,
                            const std::vector<int>& near);

}  // namespace touchfield
