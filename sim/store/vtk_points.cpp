#include "sim/store/vtk_points.h"

#include <vtkPoints.h>

namespace touchfield {

void set_points(vtkPoints* points, const Points& columns) {
  points->SetDataTypeToDouble();
  points->SetNumberOfPoints(columns.cols());
  for (Eigen::Index i = 0; i < columns.cols(); ++i) {
    points->SetPoint(i, columns.col(i).data());
  }
}

}  // namespace touchfield
