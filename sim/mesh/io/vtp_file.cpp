#include <string>

#include <vtkCellArray.h>
#include <vtkNew.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkXMLPolyDataWriter.h>

#include "sim/core/errors.h"
#include "sim/mesh/io/mesh_files.h"

namespace touchfield {

std::string as_vtp(const TriangleMesh& mesh, double unit) {
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  for (const auto& vertex : mesh.vertices().colwise()) {
    points->InsertNextPoint(vertex.x() / unit, vertex.y() / unit, vertex.z() / unit);
  }
  vtkNew<vtkCellArray> faces;
  for (const auto& triangle : mesh.triangles().colwise()) {
    faces->InsertNextCell({triangle(0), triangle(1), triangle(2)});
  }
  vtkNew<vtkPolyData> surface;
  surface->SetPoints(points);
  surface->SetPolys(faces);
  // Inline binary: ParaView 5.11 of Debian 12 cannot open the appended mode that is the writer's default.
  vtkNew<vtkXMLPolyDataWriter> writer;
  writer->SetInputData(surface);
  writer->SetDataModeToBinary();
  writer->SetCompressorTypeToZLib();
  writer->WriteToOutputStringOn();
  if (writer->Write() != 1) {
    throw IoError("the mesh could not be encoded as VTP");
  }
  return writer->GetOutputString();
}

}  // namespace touchfield
