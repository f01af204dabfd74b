#include "sim/pictures/figures.h"

#include "sim/field/target.h"
#include "sim/pictures/picture_parts.h"
#include "sim/pictures/skin_picture.h"
#include "tests/support/output_support.h"
#include "tests/support/picture_support.h"
#include "tests/support/testing.h"

namespace touchfield::figures_test {

std::set<std::string> names_in(const std::string& directory) {
  std::set<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(directory)) {
    names.insert(entry.path().filename().string());
  }
  return names;
}

/// A sheet with a pressure that differs on every face, 100 to 800 Pa, so that the colours end at 800 Pa.
RunData graded_run() {
  RunData run = bare_run(sheet(6, 4, 0.01));
  run.methods.push_back(made_up_method("graded", run, 0.5));
  Eigen::VectorXcd& p = run.methods[0].pressure;
  for (Eigen::Index f = 0; f < p.size(); ++f) {
    p(f) = std::polar(100.0 + 700.0 * static_cast<double>(f) / static_cast<double>(p.size() - 1), 0.3);
  }
  return run;
}

/// The colour of a value that is smooth over the faces, in the middle of one.
Colour smooth_colour(const RunData& run, const Eigen::VectorXd& values, Eigen::Index face, double top) {
  const Eigen::MatrixXd corners = vertex_means(run.mesh, values.transpose());
  return skin_colour(corners(0, run.mesh.triangles().col(face)).mean() / top);
}

/// The picture of panel i of an overview: its pixel at a point of the skin.
Colour at(const Picture& picture, const OverviewPart& part, int i, const Vector3& x) {
  SkinView view = part.view;
  view.panel = part.grid.panel(i);
  return picture.at(view.pixel(x));
}

TEST(Figures, TheSkinHasTheColoursOfItsPressureAtItsPlace) {
  const TemporaryDirectory directory("with space \xc3\xa4");
  const RunData run = graded_run();
  ASSERT_THAT(draw_figures(directory.path(), run), ElementsAre(directory.file("overview.png")));
  const Picture picture(directory.file("overview.png"));
  ASSERT_EQ(picture.width(), 1200);
  ASSERT_EQ(picture.height(), 900);
  const std::vector<OverviewPart> parts = overview_parts(run);
  ASSERT_EQ(parts.size(), 1U);
  for (Eigen::Index f = 0; f < run.mesh.face_count(); ++f) {
    SCOPED_TRACE(f);
    expect_colour(at(picture, parts[0], 0, run.mesh.centroids().col(f)),
                  smooth_colour(run, run.methods[0].pressure.cwiseAbs(), f, 800.0));
  }
  expect_colour(picture.at(5, 450), {255, 255, 255});
}

TEST(Figures, RadiationPressureIsShownWhereAllMethodsHaveIt) {
  RunData run = graded_run();
  const Eigen::Index faces = run.mesh.face_count();
  run.radiation_per_square = 2e-6;
  run.methods[0].radiation = Eigen::VectorXd::LinSpaced(faces, -2.0, 5.0);
  run.methods.push_back(run.methods[0]);
  run.methods[1].name = "other";
  const TemporaryDirectory directory;
  const auto drawn = [&] {
    draw_figures(directory.path(), run);
    return Picture(directory.file("overview.png"));
  };
  const OverviewPart part = overview_parts(run).front();
  const Picture picture = drawn();
  for (Eigen::Index f = 0; f < faces; ++f) {
    SCOPED_TRACE(f);
    expect_colour(at(picture, part, 1, run.mesh.centroids().col(f)),
                  smooth_colour(run, run.methods[0].radiation, f, 5.0));
  }

  const auto shows_sound = [&] {
    const Eigen::Index face = faces - 1;
    expect_colour(at(drawn(), part, 0, run.mesh.centroids().col(face)),
                  smooth_colour(run, run.methods[0].pressure.cwiseAbs(), face, 800.0));
  };
  // With an evaluation of another skin that not all methods have, P is not of the skin that is drawn.
  run.evaluation = "edge";
  run.evaluation_model = EvaluationModel{.scheme = "chief", .mesh = run.mesh, .target = std::nullopt};
  shows_sound();
  run.evaluation = "none";
  run.evaluation_model.reset();
  run.methods[1].radiation.resize(0);
  shows_sound();
}

TEST(Figures, WhatIsWantedEndsAtTheTargetsBorder) {
  const TemporaryDirectory directory;
  RunData run = graded_run();
  const std::vector<Eigen::Index> faces = {20, 21};  // one square
  run.target =
      Target{.faces = faces, .amplitudes = Eigen::Vector2d(800, 400), .box = {0, 0}, .shares = Eigen::Vector2d(1, 1)};
  draw_figures(directory.path(), run);
  EXPECT_EQ(names_in(directory.path()), (std::set<std::string>{"overview.png"}));
  const std::vector<OverviewPart> parts = overview_parts(run);
  ASSERT_EQ(parts.size(), 2U);  // the whole, and the target's surroundings
  const Picture picture(directory.file("overview.png"));
  for (const OverviewPart& part : parts) {
    const auto middle = [&](Eigen::Index face) -> Vector3 { return run.mesh.centroids().col(face); };
    expect_colour(at(picture, part, 0, middle(20)), skin_colour(1.0));
    expect_colour(at(picture, part, 0, middle(21)), skin_colour(0.5));
    expect_colour(at(picture, part, 0, middle(23)), skin_colour(0.0));
    expect_colour(at(picture, part, 1, middle(20)), smooth_colour(run, run.methods[0].pressure.cwiseAbs(), 20, 800.0));
    // The outline: green on the lower side of the square.
    const Colour line = at(picture, part, 0, run.mesh.corner(20, 0) + Vector3(0.004, 0, 0));
    EXPECT_GT(line[1], line[0] + 40);
    EXPECT_GT(line[1], line[2] + 20);
  }
}

TEST(Figures, PlanesAreDrawnAndCubesAreNot) {
  const TemporaryDirectory directory;
  RunData run = full_run();
  run.methods.resize(1);
  run.methods[0].pressure.resize(0);
  run.target.reset();
  run.transfers.clear();
  for (FieldResult& field : run.fields) field.pressure.resize(1);
  FieldResult& plane = run.fields[0];  // 5 x 1 x 4 points
  Eigen::VectorXcd p(20);
  for (Eigen::Index i = 0; i < p.size(); ++i) p(i) = std::polar(100.0 + 25.0 * static_cast<double>(i), 1.0);
  plane.pressure[0].second = p;
  plane.inside.assign(static_cast<std::size_t>(p.size()), 0);
  plane.inside[0] = 1;
  run.methods.push_back(run.methods[0]);
  run.methods[1].name = "weak";
  plane.pressure.emplace_back("weak", 0.1 * p);
  draw_figures(directory.path(), run);
  EXPECT_EQ(names_in(directory.path()), (std::set<std::string>{"field_side.png"}));
  const Picture picture(directory.file("field_side.png"));
  const PlaneView view = plane_view(plane.grid, 2);
  const PixelBox box = view.grids[0].panel(0);
  // 100 + 25 * 19 = 575 Pa at most, so the colours end at 600.
  for (int z = 0; z < 4; ++z) {
    for (int x = 0; x < 5; ++x) {
      SCOPED_TRACE(5 * z + x);
      const Colour found = picture.at(box.x + box.width * (2 * x + 1) / 10, box.y + box.height * (2 * z + 1) / 8);
      if (x + z == 0) {
        expect_colour(found, {190, 190, 190});
      } else {
        expect_colour(found, viridis(std::abs(p(5 * z + x)) / 600.0));
      }
    }
  }
  // The other method at the upper right, 57.5 of 60 Pa, and its level against the 600 Pa of the first.
  const auto upper_right = [&](const PixelBox& panel) {
    return picture.at(panel.x + panel.width * 9 / 10, panel.y + panel.height * 7 / 8);
  };
  expect_colour(upper_right(view.grids[0].panel(1)), viridis(57.5 / 60.0));
  expect_colour(upper_right(view.grids[1].panel(1)), viridis(1.0 + 20.0 * std::log10(57.5 / 600.0) / 40.0));
}

TEST(Figures, EveryPictureSaysWhichRunItShows) {
  const TemporaryDirectory directory;
  RunData run = full_run();
  run.name = "width_5mm";
  const std::vector<std::string> files = draw_figures(directory.path(), run);
  ASSERT_EQ(files.size(), 2U);  // overview and the plane
  for (const std::string& file : files) {
    SCOPED_TRACE(file);
    const Picture picture(file);
    EXPECT_EQ(picture.text("Software"), "touchfield 0.1.0");
    EXPECT_EQ(picture.text("Source"), "0123456789ab");
    EXPECT_EQ(picture.text("Description"), "width_5mm");
    EXPECT_EQ(picture.text("Scene hash"), "abc");
  }
}

TEST(Figures, PressureThatIsNoNumberIsBlueUpToItsFace) {
  const TemporaryDirectory directory;
  RunData run = graded_run();
  run.methods[0].pressure(5) = std::numeric_limits<double>::quiet_NaN();
  draw_figures(directory.path(), run);
  const Picture picture(directory.file("overview.png"));
  const OverviewPart part = overview_parts(run)[0];
  expect_colour(at(picture, part, 0, run.mesh.centroids().col(5)), kNoSkinValue);
  expect_colour(at(picture, part, 0, run.mesh.centroids().col(4)),
                smooth_colour(run, run.methods[0].pressure.cwiseAbs(), 4, 800.0));
}

// The ends and the middle of the published map (its entries 0, 255, and the mean of 127 and 128).
TEST(ColourMap, IsViridis) {
  expect_colour(viridis(0.0), {68, 1, 84});
  expect_colour(viridis(0.5), {33, 145, 140});
  expect_colour(viridis(1.0), {253, 231, 37});
  EXPECT_EQ(viridis(-1.0), viridis(0.0));
  EXPECT_EQ(viridis(7.0), viridis(1.0));
  EXPECT_EQ(viridis(std::numeric_limits<double>::quiet_NaN()), kNoValue);
}

// A box about the middle of a flat sheet cuts it along a rectangle as large as itself, though it holds other faces.
TEST(SkinPicture, TheOutlineIsWhereABoxMeetsTheSkin) {
  const TriangleMesh mesh = sheet(6, 4, 0.01);
  const Vector3 middle = 0.5 * (mesh.vertices().rowwise().minCoeff() + mesh.vertices().rowwise().maxCoeff());
  const TargetBox box{middle, {0.023, 0.011, 0.004}};
  const Points lines = target_outline(mesh, make_target(mesh, {box}, TargetProfile::kUniform, 1.0));
  double length = 0.0;
  for (Eigen::Index e = 0; e < lines.cols(); e += 2) {
    const Vector3 a = lines.col(e) - middle;
    const Vector3 b = lines.col(e + 1) - middle;
    length += (b - a).norm();
    for (const Vector3& end : {a, b}) {
      const bool on_side = std::abs(std::abs(end.x()) - 0.0115) < 1e-12 || std::abs(std::abs(end.y()) - 0.0055) < 1e-12;
      EXPECT_TRUE(on_side) << end.transpose();
    }
  }
  EXPECT_NEAR(length, 2.0 * (0.023 + 0.011), 1e-12);
}

double outline_length(const TriangleMesh& mesh, const std::vector<TargetBox>& boxes) {
  const Points lines = target_outline(mesh, make_target(mesh, boxes, TargetProfile::kUniform, 1.0));
  double length = 0.0;
  for (Eigen::Index e = 0; e < lines.cols(); e += 2) length += (lines.col(e) - lines.col(e + 1)).norm();
  return length;
}

TEST(SkinPicture, TheOutlinePartsTwoPressures) {
  const TriangleMesh mesh = sheet(120, 80, 0.5e-3);
  const Vector3 middle = 0.5 * (mesh.vertices().rowwise().minCoeff() + mesh.vertices().rowwise().maxCoeff());
  const SkinStrokes skin(mesh);
  const TargetBox disc = skin.disc(middle, 10e-3, 1.0, "one");
  const double circle = M_PI * 10e-3;
  EXPECT_NEAR(outline_length(mesh, {disc}), circle, 0.02 * circle);
  // Two discs of one radius apart: a third of each circle lies within the other.
  TargetBox other = skin.disc(middle + Vector3(5e-3, 0, 0), 10e-3, 1.0, "two");
  EXPECT_NEAR(outline_length(mesh, {disc, other}), 2.0 * circle * 2 / 3, 0.03 * circle);
  other.level = 0.5;
  EXPECT_NEAR(outline_length(mesh, {disc, other}), circle * 5 / 3, 0.03 * circle);
}

}  // namespace touchfield::figures_test
