#include "sim/motion/moving_model.h"
#include "tests/support/scene_support.h"
#include "tests/support/testing.h"

namespace touchfield::mesh_sequence_test {

/// A tetrahedron whose tip is at a height.
std::string tetrahedron(double height, const std::string& last_face = "f 2 3 4\n") {
  return "v 0 0 0\nv 10 0 0\nv 0 10 0\nv 1 2 " + std::to_string(height) + "\nf 1 3 2\nf 1 2 4\nf 1 4 3\n" + last_face;
}

MeshShape series(const TemporaryDirectory& folder, const std::vector<std::pair<double, std::string>>& meshes) {
  MeshShape shape;
  shape.series.emplace();
  for (const auto& [time, text] : meshes) {
    const std::string name = "mesh" + std::to_string(shape.series->meshes.size()) + ".obj";
    shape.series->meshes.push_back({folder.write(name, text), time});
  }
  shape.file = shape.series->meshes.front().file;
  return shape;
}

TEST(MeshSequence, IsLinearBetweenItsMeshes) {
  const TemporaryDirectory folder;
  const MeshSequence sequence(series(folder, {{0.5, tetrahedron(10)}, {1, tetrahedron(20)}, {3, tetrahedron(8)}}));
  EXPECT_EQ(sequence.triangles().cols(), 4);
  const auto tip = [&](double seconds) { return sequence.state(seconds).col(3).z(); };
  EXPECT_DOUBLE_EQ(tip(0), 10e-3);
  EXPECT_DOUBLE_EQ(tip(0.5), 10e-3);
  EXPECT_DOUBLE_EQ(tip(0.75), 15e-3);
  EXPECT_DOUBLE_EQ(tip(1), 20e-3);
  EXPECT_DOUBLE_EQ(tip(2), 14e-3);
  EXPECT_DOUBLE_EQ(tip(9), 8e-3);
  EXPECT_EQ(sequence.state(0.7).leftCols(3), sequence.state(2).leftCols(3));
}

TEST(MeshSequence, RefusesOtherTriangles) {
  const TemporaryDirectory folder;
  const auto refused = [&](const std::string& second) {
    return message_of<InputError>([&] { MeshSequence(series(folder, {{0, tetrahedron(10)}, {0.04, second}})); });
  };
  const std::string second = folder.file("mesh1.obj") + " (time_s = 0.04): ";
  const std::string first = " as in " + folder.file("mesh0.obj");
  EXPECT_EQ(refused(tetrahedron(10, "")), second + "3 triangles, must be 4" + first);
  EXPECT_EQ(refused(tetrahedron(10, "f 3 4 2\n")),
            second + "triangle 3 joins vertices 2, 3, 1, must be 1, 2, 3" + first);
  EXPECT_EQ(refused("v 5 5 5\n" + tetrahedron(10)), second + "5 vertices, must be 4" + first);
  EXPECT_THAT(refused(tetrahedron(-10)), AllOf(HasSubstr(second), HasSubstr("1 piece inside out")));
  EXPECT_THAT(refused(tetrahedron(0)), HasSubstr("without volume"));
}

}  // namespace touchfield::mesh_sequence_test
