#include "sim/mesh/raster/raster.h"

#include <random>

#include "tests/support/testing.h"
#include "tests/support/threads_support.h"

namespace touchfield::raster_test {

Camera pinhole(int width, int height, double focal, double near = 0.01) {
  Camera camera;
  camera.width = width;
  camera.height = height;
  camera.focal.setConstant(focal);
  camera.centre << 0.5 * width, 0.5 * height;
  camera.near = near;
  return camera;
}

/// One metre is one pixel, and x and y are u and v.
Camera sheet_camera(int width, int height) {
  Camera camera;
  camera.projection = Camera::Projection::kOrthographic;
  camera.width = width;
  camera.height = height;
  camera.focal.setOnes();
  return camera;
}

struct Faces {
  Points vertices;
  Triangles triangles;
};

/// A lattice of columns x rows squares, two faces each, through place(column, row).
template <class Place>
Faces lattice(int columns, int rows, const Place& place) {
  Faces made{Points(3, (columns + 1) * (rows + 1)), Triangles(3, 2 * columns * rows)};
  for (int j = 0; j <= rows; ++j) {
    for (int i = 0; i <= columns; ++i) {
      made.vertices.col(j * (columns + 1) + i) = place(i, j);
    }
  }
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      const int corner = j * (columns + 1) + i;
      const int face = 2 * (j * columns + i);
      made.triangles.col(face) << corner, corner + 1, corner + columns + 1;
      made.triangles.col(face + 1) << corner + columns + 2, corner + 1, corner + columns + 1;
    }
  }
  return made;
}

/// How many of the faces, each drawn alone, hold a pixel.
std::vector<int> coverage(const Camera& camera, const Faces& faces) {
  std::vector<int> count(static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height), 0);
  for (Eigen::Index f = 0; f < faces.triangles.cols(); ++f) {
    const Raster alone = rasterise(camera, faces.vertices, faces.triangles.col(f));
    for (std::size_t pixel = 0; pixel < count.size(); ++pixel) {
      count[pixel] += alone.face[pixel] == Raster::kNothing ? 0 : 1;
    }
  }
  return count;
}

/// The ray through a pixel's middle, at depth 1.
Vector3 ray(const Camera& camera, int column, int row) {
  return {(column + 0.5 - camera.centre.x()) / camera.focal.x(), (row + 0.5 - camera.centre.y()) / camera.focal.y(),
          1.0};
}

template <class Visit>
void for_each_pixel(const Camera& camera, const Visit& visit) {
  for (int row = 0; row < camera.height; ++row) {
    for (int column = 0; column < camera.width; ++column) {
      visit(column, row);
    }
  }
}

// Z = 0.5 + 0.3 X - 0.2 Y on the ray (x, y, 1) Z is Z = 0.5 / (1 - 0.3 x + 0.2 y).
TEST(Raster, ATiltedPlaneHasItsDepthInEveryPixel) {
  const Camera camera = pinhole(97, 61, 80.0);
  const Faces plane = lattice(7, 5, [](int i, int j) {
    const double x = (i - 3.5) * 0.2;
    const double y = (j - 2.5) * 0.2;
    return Vector3(x, y, 0.5 + 0.3 * x - 0.2 * y);
  });
  const Raster raster = rasterise(camera, plane.vertices, plane.triangles);
  for_each_pixel(camera, [&](int column, int row) {
    const Vector3 along = ray(camera, column, row);
    const double depth = 0.5 / (1.0 - 0.3 * along.x() + 0.2 * along.y());
    EXPECT_NEAR(raster.depth[raster.index(column, row)], depth, 1e-13) << column << ", " << row;
  });
}

// Vertices and edges through the very middles of pixels, in all directions.
TEST(Raster, EdgesThroughPixelsAreCoveredOnce) {
  const Camera camera = sheet_camera(24, 20);
  for (const double offset : {0.0, 0.25, 0.5}) {
    const Faces faces = lattice(6, 5, [&](int i, int j) { return Vector3(4 * i + offset, 4 * j + offset, 1); });
    for_each_pixel(camera, [&, count = coverage(camera, faces)](int column, int row) {
      const auto pixel = static_cast<std::size_t>(row * camera.width + column);
      const bool inside = column + 0.5 >= offset && row + 0.5 >= offset;
      EXPECT_EQ(count[pixel], inside ? 1 : 0) << column << ", " << row << ", offset " << offset;
    });
  }
}

TEST(Raster, CrookedLatticesAreCoveredOnce) {
  std::mt19937 generator(7);
  std::uniform_real_distribution<double> jitter(-0.3, 0.3);
  const Camera camera = sheet_camera(32, 32);
  const Faces crooked = lattice(16, 16, [&](int i, int j) {
    const bool rim = i == 0 || j == 0 || i == 16 || j == 16;
    const double size = 2.0;
    return Vector3(size * (i + (rim ? 0 : jitter(generator))), size * (j + (rim ? 0 : jitter(generator))), 1);
  });
  EXPECT_THAT(coverage(camera, crooked), Each(1));
}

// A floor 0.2 m below the eye that begins behind it: seen where Z = 0.2 / y is at least `near`, and up to its end.
TEST(Raster, AFloorThatPassesTheCameraIsCutAtTheNearPlane) {
  constexpr double kNear = 0.25;
  const Camera camera = pinhole(60, 80, 40.0, kNear);
  const Faces floor = lattice(5, 9, [](int i, int j) { return Vector3((i - 2.37) * 3.0, 0.2, (j - 3.1) * 0.9); });
  const double end = 5.9 * 0.9;
  const Raster raster = rasterise(camera, floor.vertices, floor.triangles);
  const std::vector<int> count = coverage(camera, floor);
  int seen = 0;
  for_each_pixel(camera, [&](int column, int row) {
    const std::size_t pixel = raster.index(column, row);
    const double y = ray(camera, column, row).y();
    const double depth = y > 0 ? 0.2 / y : 2 * end;
    if (depth > kNear && depth < end) {
      EXPECT_NEAR(raster.depth[pixel], depth, 1e-12 * depth);
      EXPECT_EQ(count[pixel], 1) << column << ", " << row;
      ++seen;
    } else {
      EXPECT_EQ(raster.face[pixel], Raster::kNothing) << column << ", " << row;
      EXPECT_EQ(count[pixel], 0);
    }
  });
  EXPECT_GT(seen, 1000);
}

TEST(Raster, TheNearestFaceIsSeenFromEitherSideAndInAnyOrder) {
  const Camera camera = sheet_camera(4, 4);
  Points vertices(3, 9);
  vertices << -9, 9, 0, -9, 9, 0, -9, 9, 0, -9, -9, 30, -9, -9, 30, -9, -9, 30, 3, 3, 3, 1, 1, 1, 2, 2, 2;
  for (const bool turned : {false, true}) {
    Triangles triangles(3, 4);
    triangles << 0, 3, 6, 3, 1, 4, 7, 4, 2, 5, 8, 5;  // the last is the second again
    if (turned) {
      triangles = triangles.colwise().reverse().eval();
    }
    const Raster raster = rasterise(camera, vertices, triangles);
    EXPECT_THAT(raster.face, Each(1));
    EXPECT_THAT(raster.depth, Each(::testing::DoubleNear(1.0, 1e-14)));
  }
}

TEST(Raster, DoesNotDependOnTheNumberOfThreads) {
  const Camera camera = pinhole(301, 203, 300.0);
  const Faces faces = lattice(40, 30, [](int i, int j) {
    return Vector3(0.01 * (i - 20), 0.01 * (j - 15), 0.3 + 0.05 * std::sin(i) * std::cos(2 * j));  // folds hide folds
  });
  const auto draw = [&] { return rasterise(camera, faces.vertices, faces.triangles); };
  const Raster alone = with_threads(1, draw);
  const Raster together = with_threads(3, draw);
  EXPECT_EQ(alone.face, together.face);
  EXPECT_EQ(alone.depth, together.depth);
}

TEST(Raster, SaysWhatIsWrong) {
  const Points vertices = Points::Random(3, 3);
  const Triangles face = Eigen::Vector3i(0, 1, 2);
  const auto said = [&](const auto& change) {
    Camera camera = pinhole(4, 4, 1.0);
    change(camera);
    return message_of<InputError>([&] { rasterise(camera, vertices, face); });
  };
  EXPECT_THAT(said([](Camera& camera) { camera.width = 0; }), HasSubstr("width = 0"));
  EXPECT_THAT(said([](Camera& camera) { camera.near = 0.0; }), HasSubstr("near"));
  EXPECT_THAT(said([](Camera& camera) { camera.axes.col(0) *= -1.0; }), HasSubstr("axes"));
  EXPECT_THAT(said([](Camera& camera) { camera.eye.x() = std::nan(""); }), HasSubstr("eye"));
  EXPECT_THAT(message_of<InputError>([&] { rasterise(pinhole(4, 4, 1.0), vertices, Eigen::Vector3i(0, 1, 3)); }),
              HasSubstr("vertex 3"));
}

}  // namespace touchfield::raster_test
