#include "sim/mesh/remesh/isosurface.h"

#include <vtkCellArray.h>
#include <vtkFloatArray.h>
#include <vtkFlyingEdges3D.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkSignedCharArray.h>

namespace touchfield {

namespace {

template <class Array, class Value>
Isosurface contoured(const NodeGrid& grid, const std::vector<Value>& values) {
  vtkNew<Array> scalars;
  constexpr int kNotItsOwn = 1;  // the array neither changes nor frees them
  scalars->SetArray(const_cast<Value*>(values.data()), static_cast<vtkIdType>(values.size()), kNotItsOwn);
  vtkNew<vtkImageData> image;
  image->SetDimensions(grid.count.data());
  image->SetOrigin(grid.origin.data());
  image->SetSpacing(grid.spacing, grid.spacing, grid.spacing);
  image->GetPointData()->SetScalars(scalars);
  vtkNew<vtkFlyingEdges3D> contour;
  contour->SetInputData(image);
  contour->SetValue(0, 0.0);
  contour->ComputeNormalsOff();
  contour->ComputeScalarsOff();
  contour->Update();
  vtkPolyData* surface = contour->GetOutput();

  Isosurface result;
  result.points.resize(3, surface->GetNumberOfPoints());
  for (vtkIdType i = 0; i < surface->GetNumberOfPoints(); ++i) {
    surface->GetPoint(i, result.points.col(i).data());
  }
  result.triangles.resize(3, surface->GetNumberOfPolys());
  vtkIdType count = 0;
  const vtkIdType* corners = nullptr;
  Eigen::Index f = 0;
  vtkCellArray* polygons = surface->GetPolys();
  for (polygons->InitTraversal(); polygons->GetNextCell(count, corners) != 0; ++f) {
    // The contour's normals point to lower values, that is inwards.
    result.triangles.col(f) << static_cast<int>(corners[0]), static_cast<int>(corners[2]), static_cast<int>(corners[1]);
  }
  return result;
}

}  // namespace

Isosurface isosurface(const NodeGrid& grid, const std::vector<float>& values) {
  return contoured<vtkFloatArray>(grid, values);
}

Isosurface isosurface(const NodeGrid& grid, const std::vector<signed char>& values) {
  return contoured<vtkSignedCharArray>(grid, values);
}

}  // namespace touchfield
