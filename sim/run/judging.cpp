#include "sim/run/judging.h"

#include <cmath>

#include "sim/mesh/surface_fit.h"

namespace touchfield {

JudgeComparison::JudgeComparison(const TriangleMesh& mesh, const TriangleMesh& judge, int splits)
    : mesh_(mesh), judge_(judge), splits_(splits) {}

Eigen::MatrixXcd JudgeComparison::at_centroids(const Eigen::MatrixXcd& judged) const {
  if (splits_ == 0) {
    return SurfaceFit(judge_).at(mesh_.centroids(), mesh_.normals(), judged);
  }
  Eigen::MatrixXcd p(mesh_.face_count(), judged.cols());
  for (Eigen::Index f = 0; f < mesh_.face_count(); ++f) {
    Eigen::Index middle = f;
    for (int i = 0; i < splits_; ++i) {
      middle = 4 * middle + 3;  // split_faces: the middle of a face's four
    }
    p.row(f) = judged.row(middle);
  }
  return p;
}

Eigen::VectorXd JudgeComparison::differences(const Eigen::MatrixXcd& own, const Eigen::MatrixXcd& judged) const {
  const Eigen::MatrixXcd p = at_centroids(judged);
  Eigen::VectorXd result(own.cols());
  for (Eigen::Index s = 0; s < own.cols(); ++s) {
    result(s) = relative_difference(mesh_.areas(), own.col(s), p.col(s));
  }
  return result;
}

double relative_difference(const Eigen::VectorXd& areas, const Eigen::VectorXcd& a, const Eigen::VectorXcd& b) {
  return std::sqrt(areas.dot((a - b).cwiseAbs2()) / areas.dot(b.cwiseAbs2()));
}

}  // namespace touchfield
