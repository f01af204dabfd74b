#pragma once

#include <memory>
#include <mutex>
#include <vector>

#include "sim/bem/face_sums.h"
#include "sim/bem/grid_convolution.h"
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

  Eigen::Index size() const override { return area_.size(); }
  Eigen::MatrixXcd apply(Layer layer, const Eigen::MatrixXcd& x) const override;
  Eigen::MatrixXcd apply_transpose(Layer layer, const Eigen::MatrixXcd& x) const override;

 private:
  using Values = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;
  using Vector = Eigen::Matrix<Real, 3, 1>;

  void sort_faces(const TriangleMesh& mesh);
  int cell(int x, int y, int z) const { return (x * cells_[1] + y) * cells_[2] + z; }
  Vector in_cell(int p) const { return {geometry_(p, 6), geometry_(p, 7), geometry_(p, 8)}; }
  void add_local(Layer layer, const Values& re, const Values& im, Values& sum_re, Values& sum_im) const;
  void add_smooth(Layer layer, const Values& re, const Values& im, Values& sum_re, Values& sum_im) const;
  Eigen::MatrixXcd sums(Layer layer, const Eigen::MatrixXcd& sources) const;

  GridSpec spec_;
  double gamma_;
  LocalKernel<Real> local_;
  std::vector<Real> window_;
  int side_;                        // of a cell, in steps of the grid
  std::array<int, 3> cells_;        // along each axis
  std::vector<int> start_;          // first face of each cell, z side by side
  std::vector<Eigen::Index> face_;  // by place: cell by cell
  Eigen::VectorXd area_;            // by face [m2]
  std::vector<std::ptrdiff_t> first_;
  Eigen::Matrix<Real, Eigen::Dynamic, 9> geometry_;  // by place: place in its step; normal; place in its cell [reach]
  mutable std::mutex busy_;                          // the grid holds one product at a time
  mutable GridConvolution<Real> convolution_;
};

/// In single precision where the grid's choice allows it.
std::unique_ptr<const FaceSums> make_grid_sums(const TriangleMesh& mesh, const Complex& wavenumber, double gamma,
                                               const GridSpec& spec);

extern template class GridSum<float>;
extern template class GridSum<double>;

}  // namespace touchfield
