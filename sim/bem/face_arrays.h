#pragma once

#include "sim/bem/pair_loops.h"
#include "sim/core/types.h"
#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// A mesh's faces as one array a quantity, for the loops over pairs.
template <typename Real>
struct FaceArrays {
  /// scale    units of length a metre
  /// origin   of the places [m]
  explicit FaceArrays(const TriangleMesh& mesh, double scale = 1.0, const Vector3& origin = Vector3::Zero());

  using Values = Eigen::Matrix<Real, Eigen::Dynamic, 1>;
  Values x, y, z;        // centroids
  Values nx, ny, nz;     // unit normals
  Eigen::VectorXd area;  // in double

  Eigen::Index size() const { return area.size(); }
  PairPoint<Real> point(Eigen::Index i) const { return {x(i), y(i), z(i), nx(i), ny(i), nz(i)}; }

  /// The faces from `first` on.
  PairSources<Real> sources(Eigen::Index first = 0) const {
    return {x.data() + first,  y.data() + first,  z.data() + first,
            nx.data() + first, ny.data() + first, nz.data() + first};
  }
};

/// Half wavelengths per metre, the unit of lengths in the loops over pairs.
double half_wavelengths(const Complex& wavenumber);

/// What the loops need of a wavenumber k + i alpha [1/m] and a coupling gamma [m] in that unit.
template <typename Real>
PairConstants<Real> pair_constants(const Complex& wavenumber, double gamma);

}  // namespace touchfield
