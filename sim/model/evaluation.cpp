#include "sim/model/evaluation.h"

#include <cmath>

#include "sim/mesh/query/face_tree.h"
#include "sim/mesh/query/surface_fit.h"

namespace touchfield {

EvaluationComparison::EvaluationComparison(const TriangleMesh& mesh, const TriangleMesh& evaluation,
                                           std::optional<int> splits, std::vector<unsigned char> skin)
    : mesh_(mesh), evaluation_(evaluation), splits_(splits) {
  for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
    if (skin.empty() || skin[static_cast<std::size_t>(f)] != 0) {
      counted_.push_back(f);
    }
  }
}

Eigen::MatrixXcd EvaluationComparison::at_centroids(const Eigen::MatrixXcd& evaluated) const {
  Eigen::MatrixXcd p = Eigen::MatrixXcd::Zero(mesh_.face_count(), evaluated.cols());
  if (!splits_) {
    p(counted_, Eigen::all) =
        SurfaceFit(evaluation_)
            .at(mesh_.centroids()(Eigen::all, counted_), mesh_.normals()(Eigen::all, counted_), evaluated);
    return p;
  }
  for (const Eigen::Index f : counted_) {
    Eigen::Index middle = f;
    for (int i = 0; i < *splits_; ++i) {
      middle = 4 * middle + 3;  // split_faces: the middle of a face's four
    }
    p.row(f) = evaluated.row(middle);
  }
  return p;
}

Eigen::VectorXd EvaluationComparison::differences(const Eigen::MatrixXcd& own,
                                                  const Eigen::MatrixXcd& evaluated) const {
  const Eigen::MatrixXcd p = at_centroids(evaluated);
  const Eigen::VectorXd areas = mesh_.areas()(counted_);
  Eigen::VectorXd result(own.cols());
  for (Eigen::Index s = 0; s < own.cols(); ++s) {
    result(s) = relative_difference(areas, own(counted_, s), p(counted_, s));
  }
  return result;
}

std::vector<unsigned char> target_surroundings(const TriangleMesh& mesh,
                                               const std::vector<Eigen::Index>& target_faces) {
  std::vector<unsigned char> near(static_cast<std::size_t>(mesh.face_count()), 0);
  const FaceTree tree(mesh);
  std::vector<Eigen::Index> found;
  for (const Eigen::Index f : target_faces) {
    tree.centroids_within(mesh.centroids().col(f), kTargetReach, found);
    for (const Eigen::Index i : found) {
      near[static_cast<std::size_t>(i)] = 1;
    }
  }
  return near;
}

double relative_difference(const Eigen::VectorXd& areas, const Eigen::VectorXcd& a, const Eigen::VectorXcd& b) {
  return std::sqrt(areas.dot((a - b).cwiseAbs2()) / areas.dot(b.cwiseAbs2()));
}

}  // namespace touchfield
