#include "sim/field/outside_skin.h"

#include "sim/acoustics/incident_field.h"

namespace touchfield {

namespace {

constexpr double kWall = 2.0;  // |p|^2 on skin over |p_inc|^2

}  // namespace

Eigen::VectorXd OutsideSkin::face_weights(const Eigen::VectorXd& areas, const Target& target,
                                          double outside_weight) const {
  Eigen::VectorXd weights = outside_weight * areas;
  if (faces.size() > 0) {
    weights.array() *= faces.array();
  }
  weights(target.faces).setZero();
  return weights;
}

Eigen::VectorXd OutsideSkin::beyond_weights(double outside_weight) const {
  return kWall * outside_weight * beyond.areas;
}

Eigen::MatrixXcf OutsideSkin::beyond_pressure_single(const Wave& wave) const {
  return incident_matrix_single(array, wave, beyond.centres());
}

Eigen::MatrixXcd OutsideSkin::beyond_rows(const Wave& wave, double outside_weight) const {
  return beyond_weights(outside_weight).cwiseSqrt().asDiagonal() * incident_matrix(array, wave, beyond.centres());
}

Eigen::VectorXd OutsideSkin::misfit_weights(FaceWeights weights, const Eigen::VectorXd& areas,
                                            Eigen::Index rows) const {
  Eigen::VectorXd all = row_weights(weights, areas, rows);
  if (faces.size() > 0) {
    all.head(faces.size()).array() *= faces.array();
  }
  return all;
}

Eigen::MatrixXcd OutsideSkin::beyond_gram(FaceWeights weights, const Wave& wave, double mean_area) const {
  if (beyond.empty()) {
    return {};
  }
  return weighted_gram(incident_matrix(array, wave, beyond.centres()),
                       weights == FaceWeights::kArea ? Eigen::VectorXd(beyond.areas / mean_area) : beyond.faces);
}

}  // namespace touchfield
