#pragma once

#include <array>
#include <memory>
#include <mutex>
#include <vector>

#include "sim/bem/grid_convolution.h"
#include "sim/bem/grid_loops.h"
#include "sim/bem/grid_spec.h"
#include "sim/bem/layer_sum.h"
#include "sim/core/types.h"
#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// Points with unit normals that meet a grid by a window (grid_convolution.h), sorted by cells of whole steps. What
/// belongs to a point stands in the order of places, cell by cell.
template <typename Real>
class GridPoints {
 public:
  /// origin, extent   of the box that the grid is made for; it holds the points [m]
  /// grid             which the points meet
  GridPoints(const Points& points, const Points& normals, const Vector3& origin, const Vector3& extent,
             const GridSpec& spec, const GridView<Real>& grid);

  Eigen::Index size() const { return static_cast<Eigen::Index>(number_.size()); }
  Eigen::Index number(Eigen::Index place) const { return number_[static_cast<std::size_t>(place)]; }

  /// Cells along each axis, their side in steps, and the number of one; along z they follow each other.
  const std::array<int, 3>& cells() const { return cells_; }
  int side() const { return side_; }
  int cell(int x, int y, int z) const { return (x * cells_[1] + y) * cells_[2] + z; }
  /// The first place of a cell; that of the cell after the last ends it.
  int first_place(int cell) const { return start_[static_cast<std::size_t>(cell)]; }

  using Vector = Eigen::Matrix<Real, 3, 1>;
  /// By place: from the middle of its cell in units of the reach; unit normal.
  Vector in_cell(int place) const { return {geometry_(place, 6), geometry_(place, 7), geometry_(place, 8)}; }
  Vector normal(int place) const { return {geometry_(place, 3), geometry_(place, 4), geometry_(place, 5)}; }

  /// Adds strengths to the grid.
  void spread(const FaceValues<Real>& values, const GridView<Real>& grid) const;
  /// Writes what the grid has at the points.
  void interpolate(const FaceValues<Real>& values, const GridView<Real>& grid) const;

 private:
  GridFaces<Real> faces() const;
  GridWindow<Real> window() const { return {width_, lanes_, window_.data()}; }

  int width_;
  int lanes_;
  std::vector<Real> window_;
  int side_;
  std::array<int, 3> cells_;
  std::vector<int> start_;
  std::vector<Eigen::Index> number_;
  std::vector<std::ptrdiff_t> first_;
  Eigen::Matrix<Real, Eigen::Dynamic, 9> geometry_;  // by place: place in its step; normal; place in its cell
  Eigen::Matrix<Real, Eigen::Dynamic, 3> slopes_;    // by place: normal over the step
};

extern template class GridPoints<float>;
extern template class GridPoints<double>;

/// FaceSums of large bodies, in time that grows with the faces and the volume of the box round them. The
/// kernel is split (grid_spec.h): its local part is summed over the faces within reach, its smooth part goes through
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
