#pragma once

#include <memory>
#include <mutex>
#include <vector>

#include "sim/bem/face_sums.h"
#include "sim/bem/grid_convolution.h"
#include "sim/bem/grid_points.h"
#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// FaceSums of large bodies, in time that grows with the faces and the volume of the box round them. The
/// kernel is split (kernel_split.h): its local part is summed over the faces within reach, its smooth part goes through
/// a grid. Faces meet the grid by a window: charges by its values, dipoles by its slopes along the normals, and what is
/// read from the grid likewise.
template <typename Real>
class GridSum : public FaceSums {
 public:
  /// wavenumber   k + i alpha [1/m]; 0: the static kernels
  /// gamma        eta = i gamma [m]; of the layers that have it
  GridSum(const TriangleMesh& mesh, const Complex& wavenumber, double gamma, const GridSpec& spec);

  Eigen::Index size() const override { return faces_.size(); }
  Eigen::MatrixXcd apply(Layer layer, const Eigen::MatrixXcd& x) const override;
  Eigen::MatrixXcd apply_transpose(Layer layer, const Eigen::MatrixXcd& x) const override;

 private:
  using Values = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;
  void add_local(Layer layer, const Values& re, const Values& im, Values& sum_re, Values& sum_im) const;
  void add_smooth(Layer layer, const Values& re, const Values& im, Values& sum_re, Values& sum_im) const;
  Eigen::MatrixXcd sums(Layer layer, const Eigen::MatrixXcd& sources) const;

  GridSpec spec_;
  double gamma_;
  LocalKernel<Real> local_;
  Eigen::VectorXd area_;     // by face [m2]
  mutable std::mutex busy_;  // the grid holds one product at a time
  mutable GridConvolution<Real> convolution_;
  GridPoints<Real> faces_;
};

/// In single precision where the grid's choice allows it.
std::unique_ptr<const FaceSums> make_grid_sums(const TriangleMesh& mesh, const Complex& wavenumber, double gamma,
                                               const GridSpec& spec);

/// The smooth part of the double layer at points that are no centroids, sum over f of A_f d(chi * g)/dn (x_j, x_f) x_f:
/// the local part is the caller's.
///
/// points    3 x J [m], J > 0
/// x         M x S
/// returns   J x S
Eigen::MatrixXcd smooth_double_layer(const TriangleMesh& mesh, const Complex& wavenumber, const GridSpec& spec,
                                     const Points& points, const Eigen::MatrixXcd& x);

extern template class GridSum<float>;
extern template class GridSum<double>;

}  // namespace touchfield
