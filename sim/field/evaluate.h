#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "sim/acoustics/transducer_array.h"
#include "sim/bem/grid_spec.h"
#include "sim/core/types.h"
#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// Distance, in square roots of the area, from which one point stands for a face, as in the scheme itself. The static
/// kernel's integral is then within about 1 %.
inline constexpr double kFarDistance = 5.0;

/// The field off the skin.
struct FieldValues {
  Eigen::MatrixXcd pressure;          // J x S [Pa]
  std::vector<unsigned char> inside;  // J: 1 inside the body
};

/// Accuracy of sums over faces by a grid, for choose_grid. The field's difference from sums pair by pair is 2e-5 to
/// 3e-5 of its size (rms). It is 2e-4 at the worst of some 10,000 points.
inline constexpr double kFieldTolerance = 3e-5;

/// The box round points that ask for a field [m], how many they are, and the solutions.
struct FieldPoints {
  Vector3 low = Vector3::Zero();
  Vector3 high = Vector3::Zero();
  double count = 0;
  double columns = 0;
};

FieldPoints field_points(const Points& points, Eigen::Index columns);

/// How the sums over faces are taken where it is faster: pair by pair, or by a grid round the body and the points.
struct FieldSums {
  std::optional<GridChoice> grid;
  double pairs = 0;  // of points and faces that take as long
};
/// faces   how many the mesh is to have; 0: those that it has
FieldSums choose_field_sums(const TriangleMesh& mesh, const Wave& wave, const FieldPoints& points, double faces = 0);

/// The value of the boundary integral at any point, inside the body too (there it should vanish):
///
///   p(x) = G(x) q + sum_f p_f int_f dg/dn_y (x, y) dS_y
///
/// A face has one point at five face sizes (square root of the area) or more. Nearer by, the integral over the face is
/// taken. The error is that of a constant pressure on each face. One edge length or more from the skin it is about that
/// of the surface pressure itself. Large bodies and many points go through a grid (choose_field_sums).
///
/// points     3 x J [m]
/// surface    M x S [Pa]: pressures on the faces, one column per solution
/// drive      N x S: the drives that caused them
/// returns    the integral as it is, and which points have a solid angle of more than 2 pi, i.e. lie inside
FieldValues boundary_integral(const TriangleMesh& mesh, const TransducerArray& array, const Wave& wave,
                              const Points& points, const Eigen::MatrixXcd& surface, const Eigen::MatrixXcd& drive);

/// The same with 0 at the points inside the body. A point on the skin (FaceTree::touched) is not inside and has the
/// pressure of its face.
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

/// A regular grid of points, x fastest. A plane has one count of 1.
struct FieldGrid {
  std::string name;
  Vector3 origin;            // the first point [m]
  Vector3 spacing;           // [m]
  std::array<int, 3> count;  // points along x, y, z

  Eigen::Index size() const { return static_cast<Eigen::Index>(count[0]) * count[1] * count[2]; }
  /// 3 x size() [m]
  Points points() const;
};

/// Points centre - size/2 ... centre + size/2 at most `spacing` apart on each axis; an axis of size 0 has one point.
FieldGrid centred_grid(const std::string& name, const Vector3& centre, const Vector3& size, double spacing);

}  // namespace touchfield
