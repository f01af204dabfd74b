#include "sim/mesh/mesh_io.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <stdlib.h>
#include <string>
#include <sys/stat.h>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sim/core/errors.h"
#include "sim/mesh/inspect.h"
#include "sim/mesh/shapes.h"

namespace touchfield {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::ThrowsMessage;
namespace fs = std::filesystem;

constexpr double kMm = 1e-3;

class MeshIo : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = (fs::temp_directory_path() / "touchfield_mesh_XXXXXX").string();
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
  }
  void TearDown() override { fs::remove_all(folder_); }

  std::string path(const std::string& name) const { return (folder_ / name).string(); }

  std::string write(const std::string& name, const std::string& content) const {
    std::ofstream(path(name), std::ios::binary) << content;
    return path(name);
  }

  static std::string content(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }

  /// Reading a file of this content must be refused by a message that names the file and says this.
  void expect_refused(const std::string& name, const std::string& content, const std::string& says) const {
    const std::string file = write(name, content);
    EXPECT_THAT([&] { read_mesh(file, kMm); }, ThrowsMessage<InputError>(AllOf(HasSubstr(file), HasSubstr(says))))
        << content.substr(0, 300);
  }

  fs::path folder_;
};

// Four faces of a tetrahedron with legs of 1 (see its volume: 1/6), normals outwards.
const char* const kObj =
    "# a comment\nmtllib none.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvn 0 0 1\nvt 0 0\n"
    "f 1 3 2\nf 1/1 2/1 4/1\nf 1//1 4//1 3//1\nf -3/1/1 -2/1/1 -1/1/1\n";

const char* const kPlyHeader =
    "ply\nformat ascii 1.0\ncomment made by hand\nelement vertex 4\nproperty float x\nproperty float y\nproperty float "
    "z\n"
    "property uchar red\nelement face 4\nproperty list uchar int vertex_indices\nproperty float quality\nend_header\n";
const char* const kPlyBody =
    "0 0 0 255\n1 0 0 255\n0 1 0 255\n0 0 1 255\n3 0 2 1 0.5\n3 0 1 3 0.5\n3 0 3 2 0.5\n3 1 2 3 0.5\n";

std::string ascii_stl() {
  const std::vector<std::array<const char*, 3>> faces = {{"0 0 0", "0 1 0", "1 0 0"},
                                                         {"0 0 0", "1 0 0", "0 0 1e0"},
                                                         {"0 0 0", "0 0 1", "0 1 0"},
                                                         {"1 0 0", "0 1 0", "0 0 1"}};
  std::string text = "solid tetrahedron of some program\n";
  for (const auto& face : faces) {
    text += "  facet normal 0 0 0\n    outer loop\n";
    for (const char* vertex : face) {
      text += std::string("      vertex ") + vertex + "\n";
    }
    text += "    endloop\n  endfacet\n";
  }
  return text + "endsolid tetrahedron of some program\n";
}

std::string with(std::string text, const std::string& old, const std::string& replacement) {
  const std::size_t at = text.find(old);
  EXPECT_NE(at, std::string::npos) << old;
  return text.replace(at, old.size(), replacement);
}

void expect_tetrahedron(const TriangleMesh& mesh, double unit) {
  const MeshReport report = inspect(mesh);
  EXPECT_THAT(report.faults, IsEmpty());
  EXPECT_EQ(report.faces, 4);
  EXPECT_EQ(report.vertices, 4);
  EXPECT_NEAR(report.volume / std::pow(unit, 3), 1.0 / 6.0, 1e-14);
}

TEST_F(MeshIo, ReadsObj) {
  expect_tetrahedron(read_mesh(write("a.obj", kObj), 1.0), 1.0);
  expect_tetrahedron(read_mesh(write("A.OBJ", kObj), kMm), kMm);
}

TEST_F(MeshIo, ReadsAsciiStlAndMergesItsVertices) {
  expect_tetrahedron(read_mesh(write("a.stl", ascii_stl()), kMm), kMm);
  std::string dos = ascii_stl();
  for (std::size_t at = 0; (at = dos.find('\n', at)) != std::string::npos; at += 2) {
    dos.insert(at, "\r");
  }
  expect_tetrahedron(read_mesh(write("dos.stl", dos), kMm), kMm);
}

TEST_F(MeshIo, ReadsAsciiPly) {
  expect_tetrahedron(read_mesh(write("a.ply", std::string(kPlyHeader) + kPlyBody), kMm), kMm);
}

TEST_F(MeshIo, ReadsBinaryPlyOfEitherByteOrder) {
  for (const bool big : {false, true}) {
    std::string bytes = with(kPlyHeader, "ascii", big ? "binary_big_endian" : "binary_little_endian");
    const auto put = [&](auto value) {
      std::string raw(sizeof value, '\0');
      std::memcpy(raw.data(), &value, sizeof value);
      if (big) {
        std::reverse(raw.begin(), raw.end());
      }
      bytes += raw;
    };
    for (const auto& vertex : std::vector<std::array<float, 3>>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}) {
      std::for_each(vertex.begin(), vertex.end(), put);
      put(std::uint8_t{255});
    }
    for (const auto& face : std::vector<std::array<int, 3>>{{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}) {
      put(std::uint8_t{3});
      std::for_each(face.begin(), face.end(), put);
      put(0.5f);
    }
    expect_tetrahedron(read_mesh(write("b.ply", bytes), kMm), kMm);
    for (std::size_t cut = 0; cut < bytes.size(); ++cut) {
      const std::string file = write("cut.ply", bytes.substr(0, cut));
      EXPECT_THROW(read_mesh(file, kMm), InputError) << cut;
    }
  }
}

// An L of six corners: area 3, by whatever cuts. A fan from its first corner would have area 4 or overlap.
TEST_F(MeshIo, CutsPolygonsThatAreNotConvex) {
  const std::string text = "v 2 0 0\nv 2 1 0\nv 1 1 0\nv 1 2 0\nv 0 2 0\nv 0 0 0\nf 1 2 3 4 5 6\n";
  const TriangleMesh mesh = read_mesh(write("l.obj", text), 1.0);
  EXPECT_EQ(mesh.face_count(), 4);
  EXPECT_NEAR(mesh.total_area(), 3.0, 1e-12);
  EXPECT_NEAR(mesh.normals().row(2).minCoeff(), 1.0, 1e-12);
}

TEST_F(MeshIo, MergesEqualCoordinatesOnly) {
  const std::string apart = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 1.0000001 0\nv -0.0 0 0\nv -1 0 0\nf 1 2 3\nf 5 4 6\n";
  const TriangleMesh mesh = read_mesh(write("m.obj", apart), 1.0);
  EXPECT_EQ(mesh.vertex_count(), 5);
  EXPECT_EQ(mesh.triangles()(0, 0), mesh.triangles()(0, 1));
  EXPECT_NE(mesh.triangles()(2, 0), mesh.triangles()(1, 1));
}

TEST_F(MeshIo, WritesWhatItReads) {
  const TriangleMesh mesh = transformed(icosphere(0.0123, 5), Eigen::Matrix3d::Identity(), {0.1, -0.2, 0.05});
  // OBJ and PLY keep doubles; binary STL has floats, of coordinates up to 0.25 m.
  for (const auto& [name, tolerance] : {std::pair{"s.obj", 1e-16}, {"s.ply", 1e-16}, {"s.stl", 0.25 * 6e-8}}) {
    write_mesh(path(name), mesh, kMm);
    const TriangleMesh back = read_mesh(path(name), kMm);
    ASSERT_EQ(back.face_count(), mesh.face_count()) << name;
    EXPECT_EQ(back.vertex_count(), mesh.vertex_count()) << name;
    EXPECT_LT((back.centroids() - mesh.centroids()).cwiseAbs().maxCoeff(), tolerance) << name;
    EXPECT_THAT(inspect(back).faults, IsEmpty()) << name;
  }
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), {}), 3) << "something is left behind";
}

TEST_F(MeshIo, BinaryStlHasItsPublishedLayout) {
  write_mesh(path("s.stl"), icosphere(0.01, 2), kMm);
  const std::string bytes = content(path("s.stl"));
  ASSERT_EQ(bytes.size(), 84u + 50u * 80u);
  float corner = 0;
  std::memcpy(&corner, bytes.data() + 84 + 12, sizeof corner);
  EXPECT_NEAR(corner, icosphere(0.01, 2).corner(0, 0).x() / kMm, 1e-5);
}

TEST_F(MeshIo, RefusesPathsThatAreNoMeshFile) {
  EXPECT_THAT([&] { read_mesh(path("none.stl"), kMm); },
              ThrowsMessage<InputError>(AllOf(HasSubstr("none.stl"), HasSubstr("no such file"))));
  fs::create_directory(path("folder.stl"));
  EXPECT_THAT([&] { read_mesh(path("folder.stl"), kMm); }, ThrowsMessage<InputError>(HasSubstr("is a directory")));
  ASSERT_EQ(mkfifo(path("pipe.stl").c_str(), 0600), 0);
  EXPECT_THROW(read_mesh(path("pipe.stl"), kMm), InputError);
  expect_refused("a.step", kObj, "must end in .stl, .obj or .ply");
  expect_refused("noending", kObj, "must end in .stl, .obj or .ply");
  for (const char* name : {"e.stl", "e.obj", "e.ply"}) {
    expect_refused(name, "", "the file is empty");
    expect_refused(name, "\n\n", "");
  }
  const std::string good = write("a.obj", kObj);
  for (const double unit : {0.0, -1.0, std::nan(""), HUGE_VAL}) {
    EXPECT_THAT([&] { read_mesh(good, unit); }, ThrowsMessage<InputError>(HasSubstr("mesh.unit")));
  }
}

TEST_F(MeshIo, RefusesBrokenStl) {
  expect_refused("n.stl", with(ascii_stl(), "1e0", "nan"), "n.stl:13: a coordinate is nan");
  expect_refused("n.stl", with(ascii_stl(), "1e0", "inf"), "a coordinate is inf");
  expect_refused("n.stl", with(ascii_stl(), "1e0", "one"), "'one', which is not a number");
  expect_refused("n.stl", with(ascii_stl(), "endloop", "vertex 0 0 0\nendloop"),
                 "'vertex' where 'endloop' is expected");
  for (std::size_t cut = 1; cut < ascii_stl().size() - 40; cut += 7) {
    expect_refused("t.stl", ascii_stl().substr(0, cut), "");
  }
  write_mesh(path("s.stl"), icosphere(0.01, 2), kMm);
  const std::string binary = content(path("s.stl"));
  expect_refused("t.stl", binary.substr(0, 2000), "announces 80 faces, which take 4084 bytes, but it has 2000");
  expect_refused("t.stl", binary.substr(0, 60), "not an STL file");
  expect_refused("t.stl", with(binary, "binary STL", "solid  STL").substr(0, 2000), "announces 80 faces");
  std::string poisoned = binary;
  const float nan = std::nanf("");
  std::memcpy(poisoned.data() + 84 + 7 * 50 + 12, &nan, sizeof nan);
  expect_refused("p.stl", poisoned, "face 7 has a coordinate that is not a finite number");
  expect_refused("none.stl", "solid x\nendsolid x\n", "has no face");
}

TEST_F(MeshIo, RefusesBrokenObj) {
  expect_refused("n.obj", with(kObj, "v 1 0 0", "v 1 nan 0"), "n.obj:4: a coordinate is nan");
  expect_refused("n.obj", with(kObj, "v 1 0 0", "v 1 zero 0"), "'zero', which is not a number");
  expect_refused("n.obj", with(kObj, "v 1 0 0", "v 1 0"), "three coordinates");
  expect_refused("n.obj", with(kObj, "f 1 3 2", "f 1 3 7"), "face 0 names vertex 6, but there are 4");
  expect_refused("n.obj", with(kObj, "f 1 3 2", "f 0 3 2"), "'0'");
  expect_refused("n.obj", with(kObj, "f 1 3 2", "f -9 3 2"), "only 4 vertices come before");
  expect_refused("n.obj", with(kObj, "f 1 3 2", "f 1 3"), "2 corners");
  expect_refused("n.obj", with(kObj, "f 1 3 2", "f 1 99999999999999999999 2"), "99999999999999999999");
  expect_refused("n.obj", with(kObj, "f 1 3 2", "f 1 3 3"), "degenerate");
  expect_refused("n.obj", "v 0 0 0\n", "has no face");
}

TEST_F(MeshIo, RefusesBrokenPly) {
  const std::string good = std::string(kPlyHeader) + kPlyBody;
  expect_refused("n.ply", with(good, "1 0 0 255", "1 nan 0 255"), "coordinate y of a vertex is nan");
  expect_refused("n.ply", with(good, "3 0 1 3", "3 0 1 4"), "face 1 names vertex 4");
  expect_refused("n.ply", with(good, "3 0 1 3", "3 0 1.5 3"), "must be a whole number");
  expect_refused("n.ply", with(good, "3 0 1 3", "-3 0 1 3"), "");
  expect_refused("n.ply", with(good, "element vertex 4", "element vertex 400000000000"), "");
  expect_refused("n.ply", with(good, "element vertex 4", "element vertex many"), "number of entries");
  expect_refused("n.ply", with(good, "list uchar", "list text"), "'text' is no type");
  expect_refused("n.ply", with(good, "vertex_indices", "corners"), "no list 'vertex_indices'");
  expect_refused("n.ply", with(good, "float z", "float w"), "no property 'z'");
  expect_refused("n.ply", with(good, "format ascii 1.0\n", ""), "no 'format'");
  expect_refused("n.ply", with(good, "ascii", "rot13"), "'rot13'");
  expect_refused("n.ply", with(good, "element face 4", "element side 4"), "no element 'face'");
  expect_refused("n.ply", with(good, "ply\n", "plx\n"), "does not begin with 'ply'");
  const std::string trailing = "\n";
  for (std::size_t cut = 1; cut + 4 < good.size(); cut += 3) {
    const std::string file = write("t.ply", good.substr(0, cut));
    EXPECT_THROW(read_mesh(file, kMm), InputError) << cut;
  }
}

// Random bytes and random damage must end in a mesh or in an InputError, never in a crash or another exception.
TEST_F(MeshIo, SurvivesDamage) {
  std::mt19937 random(1);
  const auto at_random = [&](std::size_t below) {
    return std::uniform_int_distribution<std::size_t>(0, below - 1)(random);
  };
  write_mesh(path("s.stl"), icosphere(0.01, 1), kMm);
  write_mesh(path("s.ply"), icosphere(0.01, 1), kMm);
  const std::vector<std::pair<std::string, std::string>> files = {{"d.stl", content(path("s.stl"))},
                                                                  {"d.ply", content(path("s.ply"))},
                                                                  {"d.obj", kObj},
                                                                  {"d.stl", ascii_stl()},
                                                                  {"d.ply", std::string(kPlyHeader) + kPlyBody}};
  for (const auto& [name, good] : files) {
    for (int trial = 0; trial < 300; ++trial) {
      std::string bad = good;
      for (std::size_t i = 0; i < 1 + static_cast<std::size_t>(trial) / 30; ++i) {
        bad[at_random(bad.size())] = static_cast<char>(at_random(256));
      }
      const std::string file = write(name, bad);
      try {
        read_mesh(file, kMm);
      } catch (const InputError& error) {
        EXPECT_THAT(error.what(), HasSubstr(file));
      }
    }
    std::string noise(500, '\0');
    std::generate(noise.begin(), noise.end(), [&] { return static_cast<char>(at_random(256)); });
    EXPECT_THROW(read_mesh(write(name, noise), kMm), InputError);
  }
}

TEST_F(MeshIo, LeavesNothingWhereItCannotWrite) {
  const TriangleMesh mesh = icosphere(0.01, 1);
  EXPECT_THAT([&] { write_mesh(path("none/s.stl"), mesh, kMm); }, ThrowsMessage<IoError>(HasSubstr("none/s.stl")));
  EXPECT_THAT([&] { write_mesh(path("s.vtk"), mesh, kMm); }, ThrowsMessage<InputError>(HasSubstr("must end in")));
  fs::create_directory(path("taken.stl"));
  write("taken.stl/inside", "x");
  EXPECT_THROW(write_mesh(path("taken.stl"), mesh, kMm), IoError);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), {}), 1);
}

}  // namespace
}  // namespace touchfield
