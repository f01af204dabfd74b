#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <iterator>
#include <random>
#include <stdlib.h>
#include <string>
#include <sys/stat.h>
#include <vector>

#include "sim/hand/shapes.h"
#include "sim/mesh/io/file_text.h"
#include "sim/mesh/io/mesh_files.h"
#include "sim/mesh/query/inspect.h"
#include "tests/support/files.h"
#include "tests/support/testing.h"

namespace touchfield::mesh_io_test {

namespace fs = std::filesystem;

constexpr double kMm = 1e-3;

class MeshIo : public ::testing::Test {
 protected:
  std::string path(const std::string& name) const { return folder_.file(name); }
  std::string write(const std::string& name, const std::string& content) const { return folder_.write(name, content); }

  /// Reading a file of this content must be refused by a message that names the file and says this.
  void expect_refused(const std::string& name, const std::string& content, const std::string& says) const {
    const std::string file = write(name, content);
    EXPECT_THAT([&] { read_mesh(file, kMm); }, ThrowsMessage<InputError>(AllOf(HasSubstr(file), HasSubstr(says))))
        << content.substr(0, 300);
  }

  const TemporaryDirectory folder_;
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

const char* const kOff = "OFF\n4 4 6\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n";

TEST_F(MeshIo, ReadsVariantsOfOff) {
  const std::string off = kOff;
  const std::string commented = "# a comment\n\n" + with(off, "4 4 6", "  # counts\n\n4 4 6 # and edges");
  const std::string body = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n";
  const std::string coloured =
      "COFF\n4 4 0\n0 0 0 255 0 0 255\n1 0 0 0 255 0 255\n0 1 0 .5 .5 .5 1\n0 0 1 9 9 9 9\n"
      "3 0 2 1 255 0 0\n3 0 1 3 0.5 0.5 0.5\n3 0 3 2\n3 1 2 3 7\n";
  for (const std::string& text :
       {commented, with(off, "4 4 6", "4 4"), "OFF 4 4 6\n" + body, "OFF 4 4\n" + body, coloured,
        with(coloured, "COFF", "STCNOFF"), with(off, "3 1 2 3\n", "3 1 2 3"), "OFF4 4 6\n" + body, "OFF4 4\n" + body}) {
    expect_tetrahedron(read_mesh(write("b.off", text), kMm), kMm);
  }
  expect_refused("n.off", with(off, "OFF\n4 4 6", "OFFx4 4 6"), "not an OFF file");
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

/// A text with these line ends, and a byte order mark before it if it is marked.
std::string with_ends(const std::string& text, const std::string& end, bool marked) {
  std::string other = marked ? "\xEF\xBB\xBF" : "";
  for (const char c : text) {
    other += c == '\n' ? end : std::string(1, c);
  }
  return other;
}

TEST_F(MeshIo, ReadsLinesOfAnyEnd) {
  const std::string ply = std::string(kPlyHeader) + kPlyBody;
  for (const std::string end : {"\n", "\r\n", "\r"}) {
    for (const bool marked : {false, true}) {
      SCOPED_TRACE(std::to_string(end.size()) + (marked ? " marked" : ""));
      for (const auto& [name, text] : std::vector<std::pair<std::string, std::string>>{
               {"A.OBJ", kObj}, {"a.off", kOff}, {"a.ply", ply}, {"a.stl", ascii_stl()}}) {
        expect_tetrahedron(read_mesh(write(name, with_ends(text, end, marked)), kMm), kMm);
      }
      expect_refused("n.obj", with_ends(with(kObj, "v 1 0 0", "v 1 zero 0"), end, marked), "n.obj:4: a coordinate");
    }
  }
}

TEST_F(MeshIo, PassesOverNumbersThatDoNotMatter) {
  for (const char* spelling : {"nan nan nan", "1.#QNAN -1.#IND 1.#INF", "0,5 0,5 0,7"}) {
    SCOPED_TRACE(spelling);
    std::string stl = ascii_stl();
    for (std::size_t at = 0; (at = stl.find("normal 0 0 0", at)) != std::string::npos; at += 7) {
      stl.replace(at + 7, 5, spelling);
    }
    expect_tetrahedron(read_mesh(write("a.stl", stl), kMm), kMm);
    const std::string first(spelling, std::string(spelling).find(' '));
    expect_tetrahedron(
        read_mesh(write("a.ply", std::string(kPlyHeader) + with(kPlyBody, "0 0 0 255", "0 0 0 " + first)), kMm), kMm);
    expect_tetrahedron(read_mesh(write("a.obj", with(kObj, "vn 0 0 1", std::string("vn ") + spelling)), kMm), kMm);
    expect_refused("n.stl", with(ascii_stl(), "1e0", first), "a coordinate is");
    expect_refused("n.obj", with(kObj, "v 1 0 0", "v 1 0 " + first), "a coordinate is");
    expect_refused("n.off", with(kOff, "1 0 0", "1 0 " + first), "a coordinate is");
  }
}

TEST_F(MeshIo, NotesBytesBehindTheLastFace) {
  const TriangleMesh mesh = icosphere(0.02, 1);
  write_mesh(path("a.stl"), mesh, kMm);
  write_mesh(path("a.ply"), mesh, kMm);
  for (const char* name : {"a.stl", "a.ply"}) {
    const FileSurface surface =
        read_surface(write(std::string("b") + name, read_bytes(path(name)) + std::string(92, 'x')));
    EXPECT_EQ(surface.triangles.size(), 20u);
    EXPECT_THAT(surface.notes, ElementsAre("92 bytes behind the last face are ignored"));
    EXPECT_THAT(read_surface(path(name)).notes, IsEmpty());
  }
  const std::string stl = read_bytes(path("a.stl"));
  EXPECT_THAT(read_surface(write("zero.stl", stl + std::string(100, '\0'))).notes, SizeIs(1));
  expect_refused("more.stl", stl + stl.substr(84, 100), "announces 20 faces, but there are 2 more behind them");
}

TEST_F(MeshIo, RefusesFilesOfOtherKinds) {
  for (const char* name : {"n.stl", "n.obj", "n.ply", "n.off"}) {
    expect_refused(name, "version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 12345\n", name);
    expect_refused(name, "\n<!DOCTYPE html>\n<html><body>v 1 2 3</body></html>\n", name);
    expect_refused(name, std::string("\x1F\x8B\x08") + std::string(100, 'x'), name);
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

TEST_F(MeshIo, WritesWhatItReads) {
  const TriangleMesh mesh = transformed(icosphere(0.0123, 5), Eigen::Matrix3d::Identity(), {0.1, -0.2, 0.05});
  // All keep doubles but binary STL, which has floats, of coordinates up to 0.25 m.
  for (const auto& [name, tolerance] :
       {std::pair{"s.obj", 1e-16}, {"s.ply", 1e-16}, {"s.off", 1e-16}, {"s.stl", 0.25 * 6e-8}}) {
    write_mesh(path(name), mesh, kMm);
    const TriangleMesh back = read_mesh(path(name), kMm);
    ASSERT_EQ(back.face_count(), mesh.face_count()) << name;
    EXPECT_EQ(back.vertex_count(), mesh.vertex_count()) << name;
    EXPECT_LT((back.centroids() - mesh.centroids()).cwiseAbs().maxCoeff(), tolerance) << name;
    EXPECT_THAT(inspect(back).faults, IsEmpty()) << name;
  }
  EXPECT_EQ(folder_.entries(), 4U) << "something is left behind";
  write_mesh(path("s.vtp"), mesh, kMm);
  EXPECT_THAT(message_of<InputError>([&] { read_mesh(path("s.vtp"), kMm); }), HasSubstr("VTP is only written"));
}

TEST_F(MeshIo, RefusesPathsThatAreNoMeshFile) {
  EXPECT_THAT([&] { read_mesh(path("none.stl"), kMm); },
              ThrowsMessage<InputError>(AllOf(HasSubstr("none.stl"), HasSubstr("no such file"))));
  fs::create_directory(path("folder.stl"));
  EXPECT_THAT([&] { read_mesh(path("folder.stl"), kMm); }, ThrowsMessage<InputError>(HasSubstr("is a directory")));
  ASSERT_EQ(mkfifo(path("pipe.stl").c_str(), 0600), 0);
  EXPECT_THROW(read_mesh(path("pipe.stl"), kMm), InputError);
  expect_refused("a.step", kObj, "must end in .stl, .obj, .ply, .off, .vtp (only written) or .glb (only read)");
  expect_refused("noending", kObj, "must end in .stl, .obj, .ply, .off, .vtp (only written) or .glb (only read)");
  for (const char* name : {"e.stl", "e.obj", "e.ply", "e.off", "e.glb"}) {
    expect_refused(name, "", "the file is empty");
    expect_refused(name, "\n\n", "");
  }
  const std::string good = write("a.obj", kObj);
  for (const double unit : {0.0, -1.0, std::nan(""), HUGE_VAL}) {
    EXPECT_THAT([&] { read_mesh(good, unit); }, ThrowsMessage<InputError>(HasSubstr("mesh.unit")));
  }
}

TEST_F(MeshIo, RefusesBrokenFiles) {
  const std::string ply = std::string(kPlyHeader) + kPlyBody;
  struct Case {
    const char* name;
    std::string good;
    const char* old;
    const char* replacement;
    const char* says;
  };
  for (const auto& [name, good, old, replacement, says] : std::vector<Case>{
           {"n.stl", ascii_stl(), "1e0", "nan", "n.stl:13: a coordinate is nan"},
           {"n.stl", ascii_stl(), "1e0", "one", "'one', which is not a number"},
           {"n.stl", ascii_stl(), "endloop", "vertex 0 0 0\nendloop", "'vertex' where 'endloop' is expected"},
           {"n.obj", kObj, "v 1 0 0", "v 1 nan 0", "n.obj:4: a coordinate is nan"},
           {"n.obj", kObj, "v 1 0 0", "v 1 0", "three coordinates"},
           {"n.obj", kObj, "f 1 3 2", "f 1 3 7", "face 0 names vertex 6, but there are 4"},
           {"n.obj", kObj, "f 1 3 2", "f 0 3 2", "'0'"},
           {"n.obj", kObj, "f 1 3 2", "f -9 3 2", "only 4 vertices come before"},
           {"n.obj", kObj, "f 1 3 2", "f 1 99999999999999999999 2", "99999999999999999999"},
           {"n.ply", ply, "1 0 0 255", "1 nan 0 255", "coordinate y of a vertex is nan"},
           {"n.ply", ply, "3 0 1 3", "3 0 1 4", "face 1 names vertex 4"},
           {"n.ply", ply, "3 0 1 3", "3 0 1.5 3", "must be a whole number"},
           {"n.ply", ply, "list uchar", "list text", "'text' is not a type"},
           {"n.ply", ply, "vertex_indices", "corners", "no list 'vertex_indices'"},
           {"n.ply", ply, "float z", "float w", "no property 'z'"},
           {"n.off", kOff, "OFF", "4OFF", "not in three dimensions"},
           {"n.off", kOff, "OFF", "OFF BINARY", "binary OFF is not supported"},
           {"n.off", kOff, "4 4 6", "4 -4 6", "'-4', it must be a whole number from 0"},
           {"n.off", kOff, "4 4 6", "400 4 6", "ends after 8 of its 400 vertices"},
           {"n.off", kOff, "4 4 6", "4 3 6", "continues after its 4 vertices and 3 faces"},
           {"n.off", kOff, "3 0 3 2", "3 0 3", "announces 3 corners, but has 2"},
           {"n.off", kOff, "3 0 3 2", "3 0 4 2", "face 2 names vertex 4, but there are 4"},
       }) {
    expect_refused(name, with(good, old, replacement), says);
  }
  for (const auto& [name, text] :
       {std::pair{"n.stl", "solid x\nendsolid x\n"}, {"n.obj", "v 0 0 0\n"}, {"n.off", "OFF\n1 0 0\n0 0 0\n"}}) {
    expect_refused(name, text, "has no face");
  }
  for (const auto& [name, good, rest] :
       {std::tuple{"t.stl", ascii_stl(), 40U}, {"t.ply", ply, 4U}, {"t.off", std::string(kOff), 3U}}) {
    for (std::size_t cut = 1; cut + rest < good.size(); cut += 3) {
      expect_refused(name, good.substr(0, cut), "");
    }
  }
  write_mesh(path("s.stl"), icosphere(0.01, 2), kMm);
  const std::string binary = read_bytes(path("s.stl"));
  expect_refused("t.stl", binary.substr(0, 2000), "announces 80 faces, which take 4084 bytes, but it has 2000");
  expect_refused("t.stl", with(binary, "binary STL", "solid  STL").substr(0, 2000), "announces 80 faces");
  std::string poisoned = binary;
  const float nan = std::nanf("");
  std::memcpy(poisoned.data() + 84 + 7 * 50 + 12, &nan, sizeof nan);
  expect_refused("p.stl", poisoned, "face 7 has a coordinate that is not a finite number");
}

// What a file announces is refused before memory is taken for it.
TEST_F(MeshIo, RefusesMoreThanAnyMeshHas) {
  const std::string says = "a mesh file may have at most 15000000 and 5000000";
  expect_refused("n.off", "OFF\n400000000000 4 6\n0 0 0\n", says);
  expect_refused("n.off", "OFF\n4 5000001 6\n0 0 0\n", says);
  const std::string ply = std::string(kPlyHeader) + kPlyBody;
  expect_refused("n.ply", with(ply, "element vertex 4", "element vertex 15000001"), says);
  expect_refused("n.ply", with(ply, "element face 4", "element face 5000001"), says);
  const std::string sparse = write("sparse.stl", "solid");
  fs::resize_file(sparse, std::uintmax_t{1} << 40U);
  EXPECT_THAT([&] { read_mesh(sparse, kMm); },
              ThrowsMessage<InputError>(HasSubstr("1099511627776 bytes, a mesh file may have at most 1073741824")));
}

// Faces without area are the reader's business only if a mesh is wanted.
TEST_F(MeshIo, ReadsSurfacesAsTheyAre) {
  const std::string file = write("q.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nv 0 0 0\nv 7 7 7\nf 1 2 3 4\nf 1 2 2\n");
  const FileSurface surface = read_surface(file);
  EXPECT_EQ(surface.points.size(), 5u);
  EXPECT_THAT(surface.triangles, ElementsAre(ElementsAre(0, 1, 2), ElementsAre(0, 2, 3), ElementsAre(0, 1, 1)));
  EXPECT_THAT([&] { read_mesh(file, kMm); }, ThrowsMessage<InputError>(HasSubstr("3 degenerate faces")));
}

// Random bytes and random damage must end in a mesh or in an InputError, never in a crash or another exception.
TEST_F(MeshIo, SurvivesDamage) {
  std::mt19937_64 random(1);
  const auto at_random = [&](std::size_t below) { return static_cast<std::size_t>(random() >> 20U) % below; };
  write_mesh(path("s.stl"), icosphere(0.01, 1), kMm);
  write_mesh(path("s.ply"), icosphere(0.01, 1), kMm);
  std::vector<std::pair<std::string, std::string>> files = {{"d.stl", read_bytes(path("s.stl"))},
                                                            {"d.ply", read_bytes(path("s.ply"))},
                                                            {"d.obj", kObj},
                                                            {"d.stl", ascii_stl()},
                                                            {"d.ply", std::string(kPlyHeader) + kPlyBody},
                                                            {"d.off", kOff}};
  for (const auto& [name, good] : files) {
    constexpr std::size_t kChanges = 180;
    for (std::size_t trial = 0; trial < kChanges; ++trial) {
      std::string bad = trial % 6 == 0 ? good.substr(0, 1 + at_random(good.size() - 1)) : good;
      for (std::size_t i = 0; trial % 6 > 0 && i < 1 + 10 * trial / kChanges; ++i) {
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
  EXPECT_EQ(folder_.entries(), 1U);
}

}  // namespace touchfield::mesh_io_test
