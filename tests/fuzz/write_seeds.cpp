// write_seeds SOURCES FOLDER: the inputs that the fuzzers start from, a folder a target: those of tests/fuzz/seeds, the
// scenes and sweeps that ship and those that must be refused, small meshes and recordings as touchfield itself
// writes them.

#include <cstdio>
#include <exception>
#include <filesystem>

#include "sim/hand/shapes.h"
#include "sim/mesh/io/mesh_files.h"
#include "tests/cameras/recording_support.h"
#include "tests/support/files.h"

namespace {

namespace fs = std::filesystem;
using namespace touchfield;

void copy_scenes(const fs::path& from, const fs::path& to) {
  fs::create_directories(to);
  for (const fs::directory_entry& entry : fs::directory_iterator(from)) {
    constexpr std::uintmax_t kLongest = 4096;  // the template is ten times as long: too slow to change at many places
    if (entry.path().extension() == ".yaml" && entry.file_size() <= kLongest) {
      fs::copy_file(entry.path(), to / entry.path().filename(), fs::copy_options::overwrite_existing);
    }
  }
}

/// The base of every sweep is the scene that the target has.
void write_sweeps(const fs::path& from, const fs::path& to) {
  fs::create_directories(to);
  for (const fs::directory_entry& entry : fs::directory_iterator(from)) {
    std::string text = support::read_bytes(entry.path());
    const std::size_t base = text.find("base: ");
    text.replace(base, text.find('\n', base) - base, "base: base.yaml");
    support::write_bytes(to / entry.path().filename(), text);
  }
}

void write_meshes(const fs::path& to) {
  for (const std::string ending : {"stl", "obj", "ply", "off"}) {
    fs::create_directories(to / ending);
    write_mesh(to / ending / ("box." + ending), box({2, 3, 4}, 10).mesh, 1e-3);
    write_mesh(to / ending / ("ball." + ending), icosphere(1.0, 1), 1e-3);
  }
}

/// Each file of a small recording after the byte that says which it is.
void write_recordings(const fs::path& to) {
  fs::create_directories(to);
  const support::TemporaryDirectory folder;
  const std::vector<DepthCamera> cameras = support::two_cameras();
  support::write_recording(folder.path(), cameras, 1);
  support::write_bytes(to / "cameras", "c" + support::read_bytes(folder.file("cameras.yaml")));
  support::write_bytes(to / "times", "t" + support::read_bytes(folder.file("times.csv")));
  support::write_bytes(to / "image", "i" + support::read_bytes(folder.file("left/000000.png")));
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    return 2;
  }
  try {
    const fs::path sources = argv[1];
    const fs::path folder = argv[2];
    fs::create_directories(folder);
    fs::copy(sources / "tests/fuzz/seeds", folder, fs::copy_options::recursive | fs::copy_options::overwrite_existing);
    copy_scenes(sources / "scenes", folder / "scene");
    copy_scenes(sources / "tests/data/scenes_bad", folder / "scene");
    write_sweeps(sources / "scenes/sweeps", folder / "sweep");
    write_meshes(folder);
    write_recordings(folder / "camera_folder");
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  return 0;
}
