#include "sim/run/vtk_files.h"

#include <vtkCellData.h>
#include <vtkDataArray.h>
#include <vtkIdList.h>
#include <vtkImageData.h>
#include <vtkInformation.h>
#include <vtkMultiBlockDataSet.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkStringArray.h>
#include <vtkXMLDataElement.h>
#include <vtkXMLDataParser.h>
#include <vtkXMLImageDataReader.h>
#include <vtkXMLMultiBlockDataReader.h>
#include <vtkXMLPolyDataReader.h>

#include "tests/support/felt_support.h"
#include "tests/support/motion_support.h"
#include "tests/support/output_support.h"
#include "tests/support/testing.h"

namespace touchfield::vtk_files_test {

template <class Reader>
vtkNew<Reader> read_vtk(const std::string& path) {
  vtkNew<Reader> reader;
  reader->SetFileName(path.c_str());
  reader->Update();
  EXPECT_EQ(reader->GetErrorCode(), 0U);
  return reader;
}

/// One array must be there, double, and hold exactly the values of the function.
template <class Function>
void expect_values(vtkFieldData* data, const std::string& name, Eigen::Index n, const Function& expected) {
  SCOPED_TRACE(name);
  vtkDataArray* array = data->GetArray(name.c_str());
  ASSERT_NE(array, nullptr);
  EXPECT_EQ(array->GetDataType(), VTK_DOUBLE);
  ASSERT_EQ(array->GetNumberOfTuples(), n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const double value = array->GetTuple1(i);
    if (std::isnan(expected(i))) {
      EXPECT_TRUE(std::isnan(value)) << i;
    } else {
      EXPECT_EQ(value, expected(i)) << i;
    }
  }
}

void expect_pressure(vtkFieldData* data, const std::string& method, const Eigen::VectorXcd& p) {
  expect_values(data, method + "_abs_pa", p.size(), [&](Eigen::Index i) { return std::abs(p(i)); });
  expect_values(data, method + "_re_pa", p.size(), [&](Eigen::Index i) { return p(i).real(); });
  expect_values(data, method + "_im_pa", p.size(), [&](Eigen::Index i) { return p(i).imag(); });
}

void expect_points(vtkPointSet* data, const Points& expected) {
  ASSERT_EQ(data->GetNumberOfPoints(), expected.cols());
  for (Eigen::Index i = 0; i < expected.cols(); ++i) {
    for (int c = 0; c < 3; ++c) EXPECT_EQ(data->GetPoint(i)[c], expected(c, i)) << i;
  }
}

/// Where the file came from, as field data: all that /provenance of run.h5 says, and the scene.
void expect_provenance(vtkDataObject* data, const RunData& run) {
  const Provenance& from = run.provenance;
  const std::vector<std::pair<std::string, std::string>> expected = {{"version", from.version},
                                                                     {"revision", from.revision},
                                                                     {"compiler", from.compiler},
                                                                     {"flags", from.flags},
                                                                     {"machine", from.machine},
                                                                     {"threads", std::to_string(from.threads)},
                                                                     {"seeds", from.seeds},
                                                                     {"command_line", from.command_line},
                                                                     {"start", from.start},
                                                                     {"blas_core", from.blas_core},
                                                                     {"instruction_level", from.instruction_level},
                                                                     {"card", from.card},
                                                                     {"end", from.end},
                                                                     {"scene_hash", from.scene_hash},
                                                                     {"scene", run.scene},
                                                                     {"solved_skin", to_string(run.solved_skin)}};
  for (const auto& [name, text] : expected) {
    SCOPED_TRACE(name);
    auto* array = vtkStringArray::SafeDownCast(data->GetFieldData()->GetAbstractArray(name.c_str()));
    ASSERT_NE(array, nullptr);
    ASSERT_EQ(array->GetNumberOfValues(), 1);
    EXPECT_EQ(array->GetValue(0), text);
  }
  EXPECT_EQ(data->GetFieldData()->GetNumberOfArrays(), static_cast<int>(expected.size()));
}

/// What ParaView 5.11 of Debian 12 can open: inline binary, not the appended mode that is VTK's default.
void expect_inline_binary(const std::string& path) {
  EXPECT_THAT(read_bytes(path), AllOf(HasSubstr("format=\"binary\""), HasSubstr("vtkZLibDataCompressor"),
                                      Not(HasSubstr("format=\"appended\"")), Not(HasSubstr("AppendedData"))));
}

TEST(SurfaceVtp, HoldsMeshTargetAndPressures) {
  const TemporaryDirectory directory("with space \xc3\xa4");
  const std::string path = directory.file("surface.vtp");
  const RunData run = full_run();
  write_surface_vtp(path, run);
  EXPECT_EQ(directory.entries(), 1U);
  expect_inline_binary(path);
  const auto reader = read_vtk<vtkXMLPolyDataReader>(path);
  vtkPolyData* surface = reader->GetOutput();
  expect_points(surface, run.mesh.vertices());
  const Eigen::Index faces = run.mesh.face_count();
  ASSERT_EQ(surface->GetNumberOfCells(), faces);
  for (Eigen::Index f = 0; f < faces; ++f) {
    vtkNew<vtkIdList> corners;
    surface->GetCellPoints(f, corners);
    ASSERT_EQ(corners->GetNumberOfIds(), 3);
    for (int c = 0; c < 3; ++c) EXPECT_EQ(corners->GetId(c), run.mesh.triangles()(c, f));
  }
  vtkCellData* data = surface->GetCellData();
  expect_values(data, "target_pa", faces, [](Eigen::Index f) {
    return f == 3 ? 1000.0 : f == 4 ? 0.25 * 2000.0 : f == 10 ? 0.5 * 1e-3 : 0.0;
  });
  for (const MethodResult& result : run.methods) {
    expect_pressure(data, result.name, result.pressure);
    expect_values(data, result.name + "_phase_rad", faces,
                  [&](Eigen::Index f) { return std::arg(result.pressure(f)); });
  }
  EXPECT_EQ(data->GetNumberOfArrays(), 1 + 2 * 4);
  expect_provenance(surface, run);
}

TEST(EvaluationVtp, HoldsTheEvaluationMeshItsTargetAndPressures) {
  const TemporaryDirectory directory;
  const std::string path = directory.file("evaluation.vtp");
  RunData run = full_run();
  run.methods.push_back(made_up_method("not_evaluated", run, 1.5));
  write_evaluation_vtp(path, run);
  expect_inline_binary(path);
  const auto reader = read_vtk<vtkXMLPolyDataReader>(path);
  vtkPolyData* surface = reader->GetOutput();
  expect_points(surface, run.evaluation_model->mesh.vertices());
  ASSERT_EQ(surface->GetNumberOfCells(), 80);
  vtkCellData* data = surface->GetCellData();
  expect_values(data, "target_pa", 80, [](Eigen::Index f) {
    return f == 5 ? 1e-3 : f == 6 ? 0.75 * 7.0 : f == 17 ? 1000.0 : f == 18 ? 0.5 * 2000.0 : 0.0;
  });
  for (const std::size_t method : {0U, 1U}) {
    expect_pressure(data, run.methods[method].name, run.methods[method].evaluation_pressure);
  }
  const Eigen::VectorXd& radiation = run.methods[0].radiation;
  expect_values(data, run.methods[0].name + "_radiation_pa", 80, [&](Eigen::Index f) { return radiation(f); });
  EXPECT_EQ(data->GetNumberOfArrays(), 1 + 2 * 4 + 1);
  expect_provenance(surface, run);
}

TEST(FeltVtp, HoldsWhatEveryMethodDoesToEverySkin) {
  const TemporaryDirectory directory;
  const std::string path = directory.file("felt.vtp");
  const Felt felt = made_up_felt({{"one", 10.0}, {"two", 5.0}});
  write_felt_vtp(path, felt);
  const auto reader = read_vtk<vtkXMLPolyDataReader>(path);
  expect_points(reader->GetOutput(), felt.mesh.vertices());
  vtkCellData* data = reader->GetOutput()->GetCellData();
  EXPECT_EQ(data->GetNumberOfArrays(), 2 * (1 + 3 * 2));
  EXPECT_STREQ(data->GetScalars()->GetName(), "one_middle_displacement_m");
  const Eigen::Index count = felt.mesh.face_count();
  const Eigen::VectorXd radiation = radiation_on_skin(felt, felt.methods[1]);
  expect_values(data, "two_radiation_rms_pa", count, [&](Eigen::Index f) { return radiation(f); });
  EXPECT_EQ(radiation.array().isNaN().count(), count - felt.patch.size());
  const Eigen::VectorXd soft = map_on_skin(felt, felt.methods[1].skins[0].displacement);
  const Eigen::VectorXd energy = map_on_skin(felt, felt.methods[0].skins[2].energy[2]);
  expect_values(data, "two_soft_displacement_m", count, [&](Eigen::Index f) { return soft(f); });
  expect_values(data, "one_stiff_energy_pc_j_m3", count, [&](Eigen::Index f) { return energy(f); });
  EXPECT_NEAR(soft(felt.patch.face), largest(felt.methods[1].skins[0].displacement), 0.03 * soft(felt.patch.face));
}

TEST(ArrayVtp, IsAVertexAChannel) {
  const TemporaryDirectory directory;
  const std::string path = directory.file("array.vtp");
  RunData run = full_run();
  run.array.device(4) = 7;
  run.provenance.seeds = "sensing=1 paper=7";
  write_array_vtp(path, run);
  expect_inline_binary(path);
  const auto reader = read_vtk<vtkXMLPolyDataReader>(path);
  vtkPolyData* array = reader->GetOutput();
  expect_points(array, run.array.positions);
  EXPECT_EQ(array->GetNumberOfVerts(), 6);
  vtkPointData* data = array->GetPointData();
  vtkDataArray* axes = data->GetArray("axis");
  ASSERT_NE(axes, nullptr);
  ASSERT_EQ(axes->GetNumberOfComponents(), 3);
  for (Eigen::Index n = 0; n < 6; ++n) {
    for (int c = 0; c < 3; ++c) EXPECT_EQ(axes->GetComponent(n, c), run.array.axes(c, n));
    EXPECT_EQ(data->GetArray("device")->GetTuple1(n), run.array.device(n));
    EXPECT_EQ(data->GetArray("channel")->GetTuple1(n), run.array.channel(n));
  }
  for (const MethodResult& result : run.methods) {
    expect_values(data, result.name + "_phase_rad", 6, [&](Eigen::Index n) { return result.solution.phases(n); });
    expect_values(data, result.name + "_amplitude", 6, [&](Eigen::Index n) { return result.solution.amplitudes(n); });
  }
  expect_provenance(array, run);
}

TEST(RunVtm, VtkOpensTheFilesItNamesColouredByTheFirstMethod) {
  const TemporaryDirectory directory;
  const RunData run = full_run();
  write_evaluation_vtp(directory.file("evaluation.vtp"), run);
  write_array_vtp(directory.file("array.vtp"), run);
  write_field_vti(directory.file("side.vti"), run, run.fields[0]);
  write_blocks(directory.file("run.vtm"), {"evaluation.vtp", "array.vtp", "side.vti"});
  const auto reader = read_vtk<vtkXMLMultiBlockDataReader>(directory.file("run.vtm"));
  auto* blocks = vtkMultiBlockDataSet::SafeDownCast(reader->GetOutput());
  ASSERT_NE(blocks, nullptr);
  ASSERT_EQ(blocks->GetNumberOfBlocks(), 3U);
  EXPECT_STREQ(blocks->GetMetaData(1U)->Get(vtkCompositeDataSet::NAME()), "array");
  auto* skin = vtkPolyData::SafeDownCast(blocks->GetBlock(0));
  ASSERT_NE(skin, nullptr);
  EXPECT_EQ(skin->GetNumberOfCells(), run.evaluation_model->mesh.face_count());
  ASSERT_NE(skin->GetCellData()->GetScalars(), nullptr);
  EXPECT_EQ(skin->GetCellData()->GetScalars()->GetName(), run.methods[0].name + "_abs_pa");
}

TEST(FieldVti, KeepsGridMaskAndPressures) {
  const TemporaryDirectory directory;
  const RunData run = full_run();
  for (const FieldResult& field : run.fields) {
    const std::string path = directory.file(field.grid.name + ".vti");
    write_field_vti(path, run, field);
    expect_inline_binary(path);
    const auto reader = read_vtk<vtkXMLImageDataReader>(path);
    vtkImageData* image = reader->GetOutput();
    const Points points = field.grid.points();
    ASSERT_EQ(image->GetNumberOfPoints(), points.cols());
    vtkPointData* data = image->GetPointData();
    ASSERT_NE(data->GetArray("inside"), nullptr);
    for (Eigen::Index i = 0; i < points.cols(); ++i) {
      for (int c = 0; c < 3; ++c) {
        EXPECT_DOUBLE_EQ(image->GetPoint(i)[c], points(c, i)) << i;  // the two add up the same numbers in their own way
      }
      EXPECT_EQ(data->GetArray("inside")->GetTuple1(i), field.inside[static_cast<std::size_t>(i)]);
    }
    for (const auto& [name, pressure] : field.pressure) expect_pressure(data, name, pressure);
    expect_provenance(image, run);
  }
}

TEST(VtkFiles, AFailureIsAnIoErrorThatNamesThePath) {
  const TemporaryDirectory directory;
  const RunData run = full_run();
  const std::string path = directory.file("missing/x.vtp");
  const auto says = AllOf(HasSubstr(path), HasSubstr("No such file or directory"));
  EXPECT_THAT(message_of<IoError>([&] { write_surface_vtp(path, run); }), says);
  EXPECT_THAT(message_of<IoError>([&] { write_field_vti(path, run, run.fields[0]); }), says);
}

TEST(MotionSeries, ListsItsStepsAndTheirTimes) {
  const TemporaryDirectory directory;
  const Motion motion = full_motion();
  std::vector<SeriesStep> steps;
  for (const double time : {0.0, 1.0 / 61, 0.25}) {
    MotionInstant instant{.time = time, .mesh = sheet(6, 4, 0.01), .target = full_run().target};
    instant.pressure = {{"surface", made_up_pressure(48, time)}, {"a", made_up_pressure(48, 2.0)}};
    add_to_series(directory.path(), motion, instant, steps);
  }
  ASSERT_EQ(steps.size(), 3U);
  EXPECT_EQ(directory.entries(), 4U);
  vtkNew<vtkXMLDataParser> parser;
  parser->SetFileName(directory.file("evaluation.pvd").c_str());
  ASSERT_NE(parser->Parse(), 0);
  vtkXMLDataElement* collection = parser->GetRootElement()->GetNestedElement(0);
  EXPECT_STREQ(parser->GetRootElement()->GetAttribute("type"), "Collection");
  ASSERT_EQ(collection->GetNumberOfNestedElements(), 3);
  for (int i = 0; i < 3; ++i) {
    vtkXMLDataElement* step = collection->GetNestedElement(i);
    const SeriesStep& expected = steps[static_cast<std::size_t>(i)];
    EXPECT_EQ(std::stod(step->GetAttribute("timestep")), expected.time);
    EXPECT_EQ(step->GetAttribute("file"), expected.file);
    const auto reader = read_vtk<vtkXMLPolyDataReader>(directory.file(expected.file));
    vtkCellData* data = reader->GetOutput()->GetCellData();
    expect_pressure(data, "surface", made_up_pressure(48, expected.time));
    expect_pressure(data, "a", made_up_pressure(48, 2.0));
    EXPECT_NE(data->GetArray("target_pa"), nullptr);
  }
}

}  // namespace touchfield::vtk_files_test
