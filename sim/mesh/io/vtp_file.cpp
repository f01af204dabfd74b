#include <algorithm>
#include <cstdint>
#include <cstring>
#include <string_view>
#include <utility>
#include <vector>

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
#include "sim/core/isolated_work.h"
#include "sim/mesh/io/mesh_files.h"

namespace touchfield {

namespace {

template <class T>
void send(const Emit& emit, const T* values, std::size_t count) {
  emit({reinterpret_cast<const char*>(values), count * sizeof(T)});
}

/// For each cell how many corners it has, and these.
void send_cells(const Emit& emit, vtkCellArray* cells) {
  const std::int64_t count = cells->GetNumberOfCells();
  send(emit, &count, 1);
  vtkNew<vtkIdList> corners;
  for (vtkIdType c = 0; c < count; ++c) {
    cells->GetCellAtId(c, corners);
    const std::int64_t size = corners->GetNumberOfIds();
    send(emit, &size, 1);
    send(emit, corners->GetPointer(0), static_cast<std::size_t>(size));
  }
}

/// In the process of its own: VTK crashes on damaged files.
void send_surface(const Emit& emit, const std::string& content, const std::string& name) {
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
  const std::int64_t points = surface->GetNumberOfPoints();
  send(emit, &points, 1);
  for (vtkIdType i = 0; i < points; ++i) {
    send(emit, surface->GetPoint(i), 3);
  }
  send_cells(emit, surface->GetPolys());
  send_cells(emit, surface->GetStrips());
}

/// What the other process has sent, number by number.
class Reader {
 public:
  Reader(std::string_view bytes, const std::string& name) : bytes_(bytes), name_(name) {}

  template <class T>
  std::vector<T> take(std::int64_t count) {
    if (count < 0 || static_cast<std::uint64_t>(count) > bytes_.size() / sizeof(T)) {
      throw InputError(fmt::format("{}: is damaged: it is cut short", name_));
    }
    std::vector<T> values(static_cast<std::size_t>(count));
    if (!values.empty()) {
      std::memcpy(values.data(), bytes_.data(), values.size() * sizeof(T));
    }
    bytes_.remove_prefix(values.size() * sizeof(T));
    return values;
  }
  std::int64_t number() { return take<std::int64_t>(1).front(); }

 private:
  std::string_view bytes_;
  const std::string& name_;
};

}  // namespace

FileSurface parse_vtp(const std::string& content, const std::string& name) {
  constexpr std::uint64_t kMebibyte = std::uint64_t{1} << 20;
  const WorkLimits limits{.memory = 512 * kMebibyte + 8 * content.size(),
                          .output = sizeof(double) * (3 * kMostFilePoints + 2 * kMostFileFaces + kMostFileCorners),
                          .seconds = 10 + static_cast<int>(content.size() / (20 * kMebibyte))};
  const WorkOutput found =
      isolated(name + ": is damaged: reading it", limits, [&](const Emit& emit) { send_surface(emit, content, name); });
  Reader reader(found.bytes, name);
  FileSurface surface;
  const std::int64_t points = reader.number();
  require_few(points, 0, name);
  const std::vector<double> values = reader.take<double>(3 * points);
  for (std::size_t i = 0; i < values.size(); i += 3) {
    const Vector3 point(values[i], values[i + 1], values[i + 2]);
    if (!point.allFinite()) {
      throw InputError(fmt::format("{}: point {} has a coordinate that is not a finite number ({}, {}, {})", name,
                                   i / 3, point.x(), point.y(), point.z()));
    }
    surface.points.push_back(point);
  }
  std::vector<std::vector<std::int64_t>> polygons;
  const auto for_each_cell = [&](const auto& add) {
    const std::int64_t cells = reader.number();
    require_few(0, cells, name);
    for (std::int64_t cell = 0; cell < cells; ++cell) {
      add(reader.take<std::int64_t>(reader.number()));
    }
  };
  for_each_cell([&](std::vector<std::int64_t> corners) { polygons.push_back(std::move(corners)); });
  for_each_cell([&](const std::vector<std::int64_t>& corners) { add_strip(polygons, corners); });
  add_polygons(surface, polygons, name);
  return surface;
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
