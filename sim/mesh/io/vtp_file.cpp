#include <algorithm>
#include <string>

#include <fmt/format.h>
#include <vtkCallbackCommand.h>
#include <vtkCellArray.h>
#include <vtkCommand.h>
#include <vtkIdList.h>
#include <vtkNew.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkXMLPolyDataReader.h>
#include <vtkXMLPolyDataWriter.h>

#include "sim/core/errors.h"
#include "sim/mesh/io/isolated_surface.h"

namespace touchfield {

namespace {

/// For each cell how many corners it has, and these.
void send_cells(const Emit& emit, vtkCellArray* cells) {
  const vtkIdType count = cells->GetNumberOfCells();
  send_number(emit, count);
  vtkNew<vtkIdList> corners;
  for (vtkIdType c = 0; c < count; ++c) {
    cells->GetCellAtId(c, corners);
    send_number(emit, corners->GetNumberOfIds());
    send_numbers(emit, corners->GetPointer(0), static_cast<std::size_t>(corners->GetNumberOfIds()));
  }
}

/// In the process of its own.
void send_vtp(const Emit& emit, const std::string& content, const std::string& name) {
  std::string problem;
  vtkNew<vtkCallbackCommand> heard;
  heard->SetClientData(&problem);
  heard->SetCallback([](vtkObject* /*caller*/, unsigned long /*event*/, void* found, void* text) {
    auto& first = *static_cast<std::string*>(found);
    if (first.empty() && text != nullptr) {
      first = static_cast<const char*>(text);
    }
  });
  vtkNew<vtkXMLPolyDataReader> reader;
  reader->AddObserver(vtkCommand::ErrorEvent, heard);
  reader->ReadFromInputStringOn();
  reader->SetInputString(content);
  reader->Update();
  vtkPolyData* surface = reader->GetOutput();
  if (!problem.empty() || reader->GetErrorCode() != 0 || surface == nullptr) {
    std::replace(problem.begin(), problem.end(), '\n', ' ');
    const std::size_t said = problem.find("): ");  // behind VTK's own place
    throw InputError(fmt::format("{}: VTK cannot read it as PolyData: {}", name,
                                 problem.substr(said == std::string::npos ? 0 : said + 3, 200)));
  }
  send_number(emit, surface->GetNumberOfPoints());
  for (vtkIdType i = 0; i < surface->GetNumberOfPoints(); ++i) {
    send_numbers(emit, surface->GetPoint(i), 3);
  }
  send_cells(emit, surface->GetPolys());
  send_cells(emit, surface->GetStrips());
}

}  // namespace

FileSurface parse_vtp(const std::string& content, const std::string& name) {
  return isolated_surface(content, name, [&](const Emit& emit) { send_vtp(emit, content, name); });
}

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
