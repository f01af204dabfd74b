#pragma once

#include <vector>

#include "sim/mesh/query/face_tree.h"
#include "sim/mesh/subset.h"
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

}  // namespace touchfield
