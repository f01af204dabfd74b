#include "sim/run/vtk_files.h"

#include <complex>
#include <filesystem>

#include <fmt/format.h>
#include <vtkCellArray.h>
#include <vtkCellData.h>
#include <vtkDoubleArray.h>
#include <vtkIdList.h>
#include <vtkImageData.h>
#include <vtkIntArray.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkStringArray.h>
#include <vtkUnsignedCharArray.h>
#include <vtkXMLImageDataWriter.h>
#include <vtkXMLPolyDataWriter.h>

#include "sim/core/errors.h"
#include "sim/core/files.h"
#include "sim/core/require.h"
#include "sim/run/felt_file.h"
#include "sim/run/motion_file.h"

namespace touchfield {

namespace {

void set_points(vtkPoints* points, const Points& columns) {
  points->SetDataTypeToDouble();
  points->SetNumberOfPoints(columns.cols());
  for (Eigen::Index i = 0; i < columns.cols(); ++i) {
    points->SetPoint(i, columns.col(i).data());
  }
}

/// Adds values 0..n-1 of a function as one array.
template <class Array, class Function>
void add_array(vtkFieldData* data, const std::string& name, Eigen::Index n, const Function& value) {
  vtkNew<Array> array;
  array->SetName(name.c_str());
  array->SetNumberOfValues(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    array->SetValue(i, value(i));
  }
  data->AddArray(array);
}

void add_pressure(vtkFieldData* data, const std::string& method, const Eigen::VectorXcd& p, bool with_phase) {
  add_array<vtkDoubleArray>(data, method + "_abs_pa", p.size(), [&](Eigen::Index i) { return std::abs(p(i)); });
  add_array<vtkDoubleArray>(data, method + "_re_pa", p.size(), [&](Eigen::Index i) { return p(i).real(); });
  add_array<vtkDoubleArray>(data, method + "_im_pa", p.size(), [&](Eigen::Index i) { return p(i).imag(); });
  if (with_phase) {
    add_array<vtkDoubleArray>(data, method + "_phase_rad", p.size(), [&](Eigen::Index i) { return std::arg(p(i)); });
  }
}

void add_text(vtkFieldData* data, const std::string& name, const std::string& text) {
  vtkNew<vtkStringArray> array;
  array->SetName(name.c_str());
  array->InsertNextValue(text);
  data->AddArray(array);
}

/// Result: a Run, a Motion or a Felt.
template <class Result>
void add_provenance(vtkFieldData* data, const Result& result) {
  for (const ProvenanceField& field : provenance_fields()) {
    add_text(data, field.name, result.provenance.*field.value);
  }
  add_text(data, "threads", fmt::to_string(result.provenance.threads));
  add_text(data, "scene", result.scene);
  if constexpr (!std::is_same_v<Result, Felt>) {
    add_text(data, "solved_skin", to_string(result.solved_skin));
  }
}

/// Inline binary with zlib: ParaView 5.11 of Debian 12 cannot open the appended mode that is VTK's default.
template <class Writer, class Result, class Data>
void write_vtk(const std::string& path, const Result& result, Data* data) {
  add_provenance(data->GetFieldData(), result);
  vtkNew<Writer> writer;
  writer->SetInputData(data);
  writer->SetDataModeToBinary();
  writer->SetCompressorTypeToZLib();
  writer->WriteToOutputStringOn();
  if (writer->Write() != 1) {
    throw IoError(fmt::format("{}: VTK could not encode it", path));
  }
  write_atomically(path, {writer->GetOutputString()});
}

void set_faces(vtkPolyData* surface, const TriangleMesh& mesh) {
  vtkNew<vtkPoints> points;
  set_points(points, mesh.vertices());
  surface->SetPoints(points);
  vtkNew<vtkCellArray> faces;
  for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
    faces->InsertNextCell({mesh.triangles()(0, f), mesh.triangles()(1, f), mesh.triangles()(2, f)});
  }
  surface->SetPolys(faces);
}

/// A vertex a channel, with where it looks and what it is wired to.
vtkNew<vtkPolyData> channels_of(const TransducerArray& array) {
  vtkNew<vtkPolyData> channels;
  vtkNew<vtkPoints> points;
  set_points(points, array.positions);
  channels->SetPoints(points);
  vtkNew<vtkCellArray> vertices;
  for (vtkIdType n = 0; n < array.size(); ++n) {
    vertices->InsertNextCell({n});
  }
  channels->SetVerts(vertices);
  vtkPointData* data = channels->GetPointData();
  vtkNew<vtkDoubleArray> axes;
  axes->SetName("axis");
  axes->SetNumberOfComponents(3);
  axes->SetNumberOfTuples(array.size());
  for (Eigen::Index n = 0; n < array.size(); ++n) {
    axes->SetTuple(n, array.axes.col(n).data());
  }
  data->AddArray(axes);
  add_array<vtkIntArray>(data, "device", array.size(), [&](Eigen::Index n) { return array.device(n); });
  add_array<vtkIntArray>(data, "channel", array.size(), [&](Eigen::Index n) { return array.channel(n); });
  return channels;
}

using NamedPressures = std::vector<std::pair<std::string, Eigen::VectorXcd>>;
using NamedRadiation = std::vector<std::pair<std::string, Eigen::VectorXd>>;

/// Means over the faces at each vertex, weighted by area.
Eigen::VectorXd at_vertices(const TriangleMesh& mesh, const Eigen::VectorXd& of_faces) {
  Eigen::VectorXd sums = Eigen::VectorXd::Zero(mesh.vertex_count());
  Eigen::VectorXd areas = sums;
  for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
    for (int c = 0; c < 3; ++c) {
      sums(mesh.triangles()(c, f)) += mesh.areas()(f) * of_faces(f);
      areas(mesh.triangles()(c, f)) += mesh.areas()(f);
    }
  }
  return (areas.array() > 0).select(sums.array() / areas.array(), 0.0);
}

/// Viewers colour by |p| of the first method until the user says otherwise.
void show_first(vtkDataSetAttributes* data, const NamedPressures& pressures) {
  if (!pressures.empty()) {
    data->SetActiveScalars((pressures.front().first + "_abs_pa").c_str());
  }
}

/// Of the methods that have one.
NamedPressures pressures_of(const Run& run, Eigen::VectorXcd MethodResult::*pressure) {
  NamedPressures pressures;
  for (const MethodResult& result : run.methods) {
    if ((result.*pressure).size() != 0) {
      pressures.emplace_back(result.name, result.*pressure);
    }
  }
  return pressures;
}

/// Radiation pressures of the methods that have one.
NamedRadiation radiation_of(const Run& run) {
  NamedRadiation radiation;
  for (const MethodResult& result : run.methods) {
    if (result.radiation.size() != 0) {
      radiation.emplace_back(result.name, result.radiation);
    }
  }
  return radiation;
}

/// Pressures of methods on a mesh; `owner`: the body of each face, empty if there is one.
template <class Result>
void write_skin_vtp(const std::string& path, const Result& from, const TriangleMesh& mesh,
                    const std::vector<int>& owner, const std::optional<Target>& target, const NamedPressures& pressures,
                    const NamedRadiation& radiation = {}) {
  vtkNew<vtkPolyData> surface;
  set_faces(surface, mesh);
  if (!owner.empty()) {
    add_array<vtkIntArray>(surface->GetCellData(), "body", mesh.face_count(),
                           [&](Eigen::Index f) { return owner[static_cast<std::size_t>(f)]; });
  }
  if (target) {
    const Eigen::VectorXd wanted = wanted_pressure(*target, mesh.face_count());
    add_array<vtkDoubleArray>(surface->GetCellData(), "target_pa", wanted.size(),
                              [&](Eigen::Index f) { return wanted(f); });
  }
  for (const auto& [method, pressure] : pressures) {
    add_pressure(surface->GetCellData(), method, pressure, true);
    const Eigen::VectorXd means = at_vertices(mesh, pressure.cwiseAbs());
    add_array<vtkDoubleArray>(surface->GetPointData(), method + "_abs_pa", means.size(),
                              [&](Eigen::Index v) { return means(v); });
  }
  for (const auto& [method, values] : radiation) {
    add_array<vtkDoubleArray>(surface->GetCellData(), method + "_radiation_pa", values.size(),
                              [&values = values](Eigen::Index f) { return values(f); });
  }
  show_first(surface->GetPointData(), pressures);
  show_first(surface->GetCellData(), pressures);
  write_vtk<vtkXMLPolyDataWriter>(path, from, surface.GetPointer());
}

}  // namespace

void write_surface_vtp(const std::string& path, const Run& run) {
  check_run(run);
  write_skin_vtp(path, run, run.mesh, run.owner, run.target, pressures_of(run, &MethodResult::pressure),
                 run.evaluation_model ? NamedRadiation() : radiation_of(run));
}

void write_evaluation_vtp(const std::string& path, const Run& run) {
  check_run(run);
  require(run.evaluation_model, "{}: the evaluation '{}' has no model of its own", path, run.evaluation);
  write_skin_vtp(path, run, run.evaluation_model->mesh, {}, run.evaluation_model->target,
                 pressures_of(run, &MethodResult::evaluation_pressure), radiation_of(run));
}

void write_felt_vtp(const std::string& path, const Felt& felt) {
  vtkNew<vtkPolyData> surface;
  set_faces(surface, felt.mesh);
  vtkCellData* data = surface->GetCellData();
  const auto add = [&](const std::string& name, const Eigen::VectorXd& values) {
    add_array<vtkDoubleArray>(data, name, values.size(), [&](Eigen::Index f) { return values(f); });
  };
  for (const FeltMethod& method : felt.methods) {
    add(method.name + "_radiation_rms_pa", radiation_on_skin(felt, method));
    for (const SkinVibration& skin : method.skins) {
      if (skin.has_mechanics) {
        const std::string name = method.name + "_" + skin.skin;
        add(name + "_displacement_m", map_on_skin(felt, skin.displacement));
        add(fmt::format("{}_energy_{}_j_m3", name, kReceptorNames.back()), map_on_skin(felt, skin.energy.back()));
      }
    }
  }
  data->SetActiveScalars((felt.methods.front().name + "_middle_displacement_m").c_str());
  write_vtk<vtkXMLPolyDataWriter>(path, felt, surface.GetPointer());
}

void write_array_vtp(const std::string& path, const Run& run) {
  check_run(run);
  const auto channels = channels_of(run.array);
  vtkPointData* data = channels->GetPointData();
  for (const MethodResult& result : run.methods) {
    add_array<vtkDoubleArray>(data, result.name + "_phase_rad", run.array.size(),
                              [&](Eigen::Index n) { return result.solution.phases(n); });
    add_array<vtkDoubleArray>(data, result.name + "_amplitude", run.array.size(),
                              [&](Eigen::Index n) { return result.solution.amplitudes(n); });
  }
  write_vtk<vtkXMLPolyDataWriter>(path, run, channels.GetPointer());
}

void write_array_vtp(const std::string& path, const Motion& motion) {
  write_vtk<vtkXMLPolyDataWriter>(path, motion, channels_of(motion.array).GetPointer());
}

void write_field_vti(const std::string& path, const Run& run, const FieldResult& field) {
  check_field(field);
  const FieldGrid& grid = field.grid;
  vtkNew<vtkImageData> image;
  image->SetOrigin(grid.origin.data());
  image->SetSpacing(grid.spacing.data());
  image->SetDimensions(grid.count.data());
  vtkPointData* data = image->GetPointData();
  add_array<vtkUnsignedCharArray>(data, "inside", grid.size(),
                                  [&](Eigen::Index i) { return field.inside[static_cast<std::size_t>(i)]; });
  for (const auto& [name, pressure] : field.pressure) {
    add_pressure(data, name, pressure, false);
  }
  show_first(data, field.pressure);
  write_vtk<vtkXMLImageDataWriter>(path, run, image.GetPointer());
}

void write_blocks(const std::string& path, const std::vector<std::string>& files) {
  std::string text =
      "<?xml version=\"1.0\"?>\n<VTKFile type=\"vtkMultiBlockDataSet\" version=\"1.0\" "
      "byte_order=\"LittleEndian\">\n <vtkMultiBlockDataSet>\n";
  for (std::size_t i = 0; i < files.size(); ++i) {
    text += fmt::format("  <DataSet index=\"{}\" name=\"{}\" file=\"{}\"/>\n", i,
                        markup_text(std::filesystem::path(files[i]).stem().string()), markup_text(files[i]));
  }
  write_atomically(path, {text, " </vtkMultiBlockDataSet>\n</VTKFile>\n"});
}

void write_series(const std::string& path, const std::vector<SeriesStep>& steps) {
  std::string text =
      "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\" byte_order=\"LittleEndian\">\n"
      " <Collection>\n";
  for (const SeriesStep& step : steps) {
    text += fmt::format("  <DataSet timestep=\"{}\" group=\"\" part=\"0\" file=\"{}\"/>\n", step.time,
                        markup_text(step.file));
  }
  write_atomically(path, {text, " </Collection>\n</VTKFile>\n"});
}

void add_to_series(const std::string& directory, const Motion& motion, const MotionInstant& instant,
                   std::vector<SeriesStep>& steps) {
  check_instant(instant);
  const std::filesystem::path folder = directory;
  steps.push_back({instant.time, fmt::format("evaluation_{:04}.vtp", steps.size() + 1)});
  write_skin_vtp(folder / steps.back().file, motion, instant.mesh, {}, instant.target, instant.pressure);
  write_series(folder / "evaluation.pvd", steps);
}

}  // namespace touchfield
