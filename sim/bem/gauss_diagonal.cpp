#include "sim/bem/gauss_diagonal.h"

#include <numbers>

#include "sim/bem/face_arrays.h"
#include "sim/bem/pair_loops.h"

namespace touchfield {

Eigen::VectorXd gauss_diagonal(const TriangleMesh& mesh) {
  const FaceArrays faces(mesh);
  const PairSources<double> sources = faces.sources();
  Eigen::VectorXd diagonal(faces.size());
#pragma omp parallel for schedule(static)
  for (Eigen::Index i = 0; i < faces.size(); ++i) {
    const double sum = static_sum(faces.point(i), sources, faces.area.data(), static_cast<int>(faces.size()));
    diagonal(i) = 1.0 + sum / (4.0 * std::numbers::pi);
  }
  return diagonal;
}

}  // namespace touchfield
