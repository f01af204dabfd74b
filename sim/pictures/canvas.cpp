#include "sim/pictures/canvas.h"

#include <algorithm>
#include <array>
#include <map>

#include <vtkActor.h>
#include <vtkActor2D.h>
#include <vtkCamera.h>
#include <vtkCellArray.h>
#include <vtkCellData.h>
#include <vtkImageData.h>
#include <vtkImageMapper.h>
#include <vtkNew.h>
#include <vtkPNGWriter.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkPolyDataMapper.h>
#include <vtkPolyDataMapper2D.h>
#include <vtkProperty.h>
#include <vtkProperty2D.h>
#include <vtkRenderWindow.h>
#include <vtkRenderer.h>
#include <vtkTextActor.h>
#include <vtkTextProperty.h>
#include <vtkUnsignedCharArray.h>
#include <vtkWindowToImageFilter.h>

#include "sim/core/version.h"
#include "sim/store/vtk_points.h"

namespace touchfield {

namespace {

constexpr Colour kInk = {25, 25, 25};
constexpr double kAmbient = 0.7;  // the share of a face's colour that shading leaves alone

std::array<double, 3> fractions(const Colour& colour) {
  return {colour[0] / 255.0, colour[1] / 255.0, colour[2] / 255.0};
}

vtkNew<vtkActor> skin(const TriangleMesh& mesh, const std::vector<Colour>& colours) {
  vtkNew<vtkPolyData> data;
  vtkNew<vtkPoints> points;
  set_points(points, mesh.vertices());
  data->SetPoints(points);
  vtkNew<vtkCellArray> faces;
  vtkNew<vtkUnsignedCharArray> values;
  values->SetNumberOfComponents(3);
  for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
    faces->InsertNextCell({mesh.triangles()(0, f), mesh.triangles()(1, f), mesh.triangles()(2, f)});
    values->InsertNextTypedTuple(colours[static_cast<std::size_t>(f)].data());
  }
  data->SetPolys(faces);
  data->GetCellData()->SetScalars(values);
  vtkNew<vtkPolyDataMapper> mapper;
  mapper->SetInputData(data);
  mapper->SetColorModeToDirectScalars();
  vtkNew<vtkActor> actor;
  actor->SetMapper(mapper);
  actor->GetProperty()->SetInterpolationToFlat();
  actor->GetProperty()->SetAmbient(kAmbient);
  actor->GetProperty()->SetDiffuse(1.0 - kAmbient);
  actor->GetProperty()->SetSpecular(0.0);
  return actor;
}

vtkNew<vtkActor> lines(const Points& vertices, const Eigen::Matrix2Xi& edges, const Colour& colour) {
  vtkNew<vtkPolyData> data;
  vtkNew<vtkPoints> points;
  set_points(points, vertices);
  data->SetPoints(points);
  vtkNew<vtkCellArray> cells;
  for (Eigen::Index e = 0; e < edges.cols(); ++e) {
    cells->InsertNextCell({edges(0, e), edges(1, e)});
  }
  data->SetLines(cells);
  vtkNew<vtkPolyDataMapper> mapper;
  mapper->SetInputData(data);
  mapper->SetRelativeCoincidentTopologyLineOffsetParameters(-2.0, -2.0);  // in front of the faces they bound
  mapper->SetResolveCoincidentTopologyToPolygonOffset();
  vtkNew<vtkActor> actor;
  actor->SetMapper(mapper);
  actor->GetProperty()->LightingOff();
  actor->GetProperty()->SetColor(fractions(colour).data());
  actor->GetProperty()->SetLineWidth(2.0F);
  return actor;
}

}  // namespace

/// The window, with the panels below and flat drawing above, and the texts beside them.
struct Canvas::Scene {
  vtkNew<vtkRenderWindow> window;
  vtkNew<vtkRenderer> paper;
  vtkNew<vtkRenderer> overlay;
  std::map<std::string, std::string> texts;
};

Canvas::Canvas(int width, int height) : scene_(std::make_unique<Scene>()) {
  vtkRenderWindow* window = scene_->window;
  window->SetOffScreenRendering(1);
  window->SetSize(width, height);
  window->SetDPI(72);  // so that a font's size is in pixels
  window->SetMultiSamples(4);
  window->SetNumberOfLayers(2);
  scene_->paper->SetBackground(1.0, 1.0, 1.0);
  window->AddRenderer(scene_->paper);
  scene_->overlay->SetLayer(1);
  window->AddRenderer(scene_->overlay);
  const BuildInfo build = build_info();
  describe("Software", "touchfield " + build.version);
  describe("Source", build.revision);
}

Canvas::~Canvas() = default;

void Canvas::text(double x, double y, const std::string& text, const TextStyle& style) {
  vtkNew<vtkTextActor> actor;
  actor->SetInput(text.c_str());
  actor->SetPosition(x, y);
  vtkTextProperty* property = actor->GetTextProperty();
  property->SetFontSize(style.size);
  property->SetBold(style.bold);
  property->SetOrientation(style.angle);
  property->SetColor(fractions(kInk).data());
  property->SetVerticalJustificationToCentered();
  switch (style.align) {
    case Align::kLeft:
      property->SetJustificationToLeft();
      break;
    case Align::kCentre:
      property->SetJustificationToCentered();
      break;
    case Align::kRight:
      property->SetJustificationToRight();
      break;
  }
  scene_->overlay->AddActor2D(actor);
}

void Canvas::line(const Eigen::Vector2d& from, const Eigen::Vector2d& to, const Colour& colour, double width) {
  vtkNew<vtkPoints> points;
  points->InsertNextPoint(from.x(), from.y(), 0.0);
  points->InsertNextPoint(to.x(), to.y(), 0.0);
  vtkNew<vtkCellArray> cells;
  cells->InsertNextCell({0, 1});
  vtkNew<vtkPolyData> data;
  data->SetPoints(points);
  data->SetLines(cells);
  vtkNew<vtkPolyDataMapper2D> mapper;
  mapper->SetInputData(data);
  vtkNew<vtkActor2D> actor;
  actor->SetMapper(mapper);
  actor->GetProperty()->SetColor(fractions(colour).data());
  actor->GetProperty()->SetLineWidth(static_cast<float>(width));
  scene_->overlay->AddActor2D(actor);
}

void Canvas::polygon(const std::vector<Eigen::Vector2d>& corners, const Colour& colour) {
  vtkNew<vtkPoints> points;
  vtkNew<vtkCellArray> cells;
  cells->InsertNextCell(static_cast<int>(corners.size()));
  for (const Eigen::Vector2d& corner : corners) {
    cells->InsertCellPoint(points->InsertNextPoint(corner.x(), corner.y(), 0.0));
  }
  vtkNew<vtkPolyData> data;
  data->SetPoints(points);
  data->SetPolys(cells);
  vtkNew<vtkPolyDataMapper2D> mapper;
  mapper->SetInputData(data);
  vtkNew<vtkActor2D> actor;
  actor->SetMapper(mapper);
  actor->GetProperty()->SetColor(fractions(colour).data());
  scene_->overlay->AddActor2D(actor);
}

void Canvas::frame(const PixelBox& box, const Colour& colour, double width) {
  const Eigen::Vector2d low(box.x, box.y);
  const Eigen::Vector2d high(box.x + box.width, box.y + box.height);
  line({low.x(), low.y()}, {high.x(), low.y()}, colour, width);
  line({high.x(), low.y()}, {high.x(), high.y()}, colour, width);
  line({high.x(), high.y()}, {low.x(), high.y()}, colour, width);
  line({low.x(), high.y()}, {low.x(), low.y()}, colour, width);
}

void Canvas::image(const PixelBox& box, const std::function<Colour(int, int)>& colour) {
  vtkNew<vtkImageData> data;
  data->SetDimensions(box.width, box.height, 1);
  data->AllocateScalars(VTK_UNSIGNED_CHAR, 3);
  for (int j = 0; j < box.height; ++j) {
    for (int i = 0; i < box.width; ++i) {
      const Colour value = colour(i, j);
      std::copy(value.begin(), value.end(), static_cast<unsigned char*>(data->GetScalarPointer(i, j, 0)));
    }
  }
  vtkNew<vtkImageMapper> mapper;
  mapper->SetInputData(data);
  mapper->SetColorWindow(255.0);  // 0..255 as they are
  mapper->SetColorLevel(127.5);
  vtkNew<vtkActor2D> actor;
  actor->SetMapper(mapper);
  actor->SetPosition(box.x, box.y);
  scene_->overlay->AddActor2D(actor);
}

void Canvas::surface(const SkinView& view, const TriangleMesh& mesh, const std::vector<Colour>& colours,
                     const Eigen::Matrix2Xi& edges, const Colour& edge_colour) {
  const int* size = scene_->window->GetSize();
  const PixelBox& panel = view.panel;
  vtkNew<vtkRenderer> renderer;
  renderer->SetBackground(1.0, 1.0, 1.0);
  renderer->SetViewport(static_cast<double>(panel.x) / size[0], static_cast<double>(panel.y) / size[1],
                        static_cast<double>(panel.x + panel.width) / size[0],
                        static_cast<double>(panel.y + panel.height) / size[1]);
  renderer->AddActor(skin(mesh, colours));
  renderer->AddActor(lines(mesh.vertices(), edges, edge_colour));
  const double reach = (mesh.vertices().colwise() - view.centre).colwise().norm().maxCoeff();
  const Vector3 eye = view.centre - 2.0 * reach * view.direction;
  vtkCamera* camera = renderer->GetActiveCamera();
  camera->ParallelProjectionOn();
  camera->SetFocalPoint(view.centre.data());
  camera->SetPosition(eye.data());
  camera->SetViewUp(view.up.data());
  camera->SetParallelScale(0.5 * panel.height * view.scale);
  renderer->ResetCameraClippingRange();
  scene_->window->AddRenderer(renderer);
}

void Canvas::describe(const std::string& name, const std::string& text) { scene_->texts[name] = text; }

std::string Canvas::png() {
  scene_->window->Render();
  vtkNew<vtkWindowToImageFilter> grab;
  grab->SetInput(scene_->window);
  grab->ReadFrontBufferOff();
  vtkNew<vtkPNGWriter> writer;
  writer->SetInputConnection(grab->GetOutputPort());
  writer->WriteToMemoryOn();
  for (const auto& [name, text] : scene_->texts) {
    writer->AddText(name.c_str(), text.c_str());
  }
  writer->Write();
  vtkUnsignedCharArray* bytes = writer->GetResult();
  return {reinterpret_cast<const char*>(bytes->GetPointer(0)), static_cast<std::size_t>(bytes->GetNumberOfValues())};
}

}  // namespace touchfield
