#pragma once

#include <vector>

#include "sim/mesh/query/face_tree.h"
#include "sim/mesh/topology.h"
#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// Smooth functions on a surface, known at the centroids of a fine mesh, at the centroids of another mesh of it.
///
/// At each point the nearest face is taken that has a normal within 60 degrees of the point's. A complete quadratic in
/// the coordinates of its plane is fitted by weighted least squares. It is fitted to that face and the faces that share
/// a vertex with it. If these are fewer than 9, the faces that share a vertex with them are added. Faces with normals
/// more than 60 degrees from the face's are left out. Otherwise the far side of a thin part or the skin beyond a sharp
/// edge would mix in. Where the faces do not determine a quadratic, the fit is linear. Where they do not determine a
/// linear function either, it is constant. Its value is taken at the point of the skin nearest to the given point.
///
/// accuracy   third order in the edge length on smooth surfaces, if the points lie off the skin by no more than its
///            sagitta; exact for quadratics on planes
class SurfaceFit {
 public:
  explicit SurfaceFit(const TriangleMesh& mesh);

  /// points    3 x J [m]
  /// normals   3 x J, unit, of the surface at the points
  /// values    M x S, at the centroids
  /// returns   J x S
  /// throws    InputError if the sizes do not match, or no face looks within 60 degrees of a point's normal
  Eigen::MatrixXcd at(const Points& points, const Points& normals, const Eigen::MatrixXcd& values) const;

 private:
  /// The sum over faces of weight times value is the fitted value.
  struct Stencil {
    std::vector<Eigen::Index> faces;
    std::vector<double> weights;
  };

  void gather(Eigen::Index face, std::vector<Eigen::Index>& faces) const;
  void weigh(const Vector3& x, const Vector3& normal, Stencil& stencil) const;

  TriangleMesh mesh_;
  FaceTree tree_;
  FacesRound round_;
};

/// Signed distances over some area of a skin [m].
struct SkinDistance {
  double area = 0;  // that it is about [m2]; 0: nothing, and all below are 0
  double mean = 0;
  double rms = 0;
  double p95 = 0;   // 95 % of the area has no larger magnitude
  double most = 0;  // largest magnitude
};

/// The distance from the centroid x of each face of `from` to the nearest point y of the faces of `to` [m]. Only faces
/// of `to` count that look the same way within 90 degrees. A finger is thus not taken for the one beside it or for its
/// own back. With n the normal of the face, the distance is positive if n . (y - x) > 0. `to` then lies outside of
/// `from` there. NaN where no face looks that way.
///
/// accuracy   exact at the centroids; some microseconds per face
Eigen::VectorXd signed_distances(const TriangleMesh& from, const TriangleMesh& to);

/// Area-weighted numbers of distances at the faces of a mesh of which keep[f] holds; empty keeps all.
///
/// distances   M; those that are NaN are left out
SkinDistance skin_distance(const TriangleMesh& mesh, const Eigen::VectorXd& distances, const std::vector<bool>& keep);

}  // namespace touchfield
