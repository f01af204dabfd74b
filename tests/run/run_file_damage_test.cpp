// What run.h5 must not be read from: no runs, newer ones, cut and changed files, contents that make no sense.

#include "sim/run/archive_file.h"
#include "sim/run/hdf5_file.h"
#include "sim/run/run_file.h"
#include "tests/support/output_support.h"
#include "tests/support/result_file_support.h"
#include "tests/support/testing.h"

namespace touchfield::run_file_damage_test {

class DamagedRunFile : public ResultFile {
 protected:
  /// A file of these contents with the checksum that fits.
  void forge(const std::function<void(const hdf5::Group&)>& fill) const {
    const hdf5::MemoryFile file(path_);
    fill(file.root());
    write_archive(path_, file);
  }

  /// A run of one face and one channel, filled in further by hand.
  RunData read_forged(const std::function<void(const hdf5::Group&)>& fill) const {
    forge([&](const hdf5::Group& root) {
      forge_beginning(root, "touchfield-run", kRunFormatVersion);
      root.set_attribute("radiation_per_square", 1e-6);
      fill(root);
    });
    return read_run_file(path_);
  }
};

TEST_F(DamagedRunFile, FilesThatAreNoRunsAreInputErrors) {
  const auto read = [&] { read_run_file(path_); };
  EXPECT_THAT(message_of<InputError>(read), AllOf(HasSubstr(path_), HasSubstr("No such file")));
  EXPECT_THAT(message_of<InputError>([&] { read_run_file(directory_.path()); }), HasSubstr("is not a file"));
  write_bytes(path_, std::string(5000, 'x'));
  EXPECT_THAT(message_of<InputError>(read), HasSubstr("not an HDF5 file"));
  forge([](const hdf5::Group& root) { root.set_attribute("title", "something else"); });
  EXPECT_THAT(message_of<InputError>(read), HasSubstr("not a touchfield run"));
  forge([](const hdf5::Group& root) {
    root.set_attribute("format", "touchfield-run");
    root.set_attribute("format_version", kRunFormatVersion + 1);
  });
  EXPECT_THAT(message_of<InputError>(read), HasSubstr(": a newer touchfield reads it"));
}

TEST_F(DamagedRunFile, IsRefused) {
  const auto read = [&] { read_run_file(path_); };
  write_run_file(path_, full_run());
  expect_damage_is_seen(path_, read, 300, 500);
}

// Another program has changed it: damage would not be noticed.
TEST_F(DamagedRunFile, AFileWithoutItsChecksumLineIsReadOnlyWithAWarning) {
  write_run_file(path_, full_run());
  const std::string bytes = read_bytes(path_);
  std::string warning;
  const Warn warn = [&](const std::string& text) { warning += text; };
  read_run_file(path_, warn);
  EXPECT_EQ(warning, "");
  write_bytes(path_, bytes.substr(0, bytes.size() - kChecksumLength));
  EXPECT_THAT(message_of<InputError>([&] { read_run_file(path_); }),
              AllOf(HasSubstr(path_), HasSubstr("checksum line")));
  EXPECT_EQ(read_run_file(path_, warn).name, full_run().name);
  EXPECT_THAT(warning, AllOf(HasSubstr(path_), HasSubstr("checksum line")));
  write_bytes(path_, bytes.substr(0, bytes.size() / 2));
  EXPECT_THAT(message_of<InputError>([&] { read_run_file(path_, warn); }), HasSubstr("is damaged"));
}

TEST(Checksum, IsTheCrc32OfEverythingBeforeTheLine) {
  // The check value of the CRC-32 catalogue, for the digits 1 to 9.
  EXPECT_EQ(checksum_line("123456789"), "touchfield-crc32 cbf43926\n");
  EXPECT_EQ(checksum_line("").size(), kChecksumLength);
}

// Sizes and indices that only a forged file has: the checksum fits, the parts do not.
TEST_F(DamagedRunFile, SizesThatContradictEachOtherAreErrors) {
  const auto message = [&](const std::function<void(const hdf5::Group&)>& fill) {
    forge([&](const hdf5::Group& root) {
      root.set_attribute("format", "touchfield-run");
      root.set_attribute("format_version", kRunFormatVersion);
      root.set_attribute("name", "forged");
      root.set_attribute("complete", 1);
      root.write_text("scene", "");
      fill(root);
    });
    return message_of<InputError>([&] { read_run_file(path_); });
  };
  const std::array<double, 9> corners = {0, 0, 0, 1, 0, 0, 0, 1, 0};
  const std::array<int, 3> wrong_index = {0, 1, 7};
  const auto with_mesh = [&](const std::function<void(const hdf5::Group&)>& fill) {
    return message([&](const hdf5::Group& root) {
      fill(root.create("mesh"));
      root.create("array");
    });
  };
  EXPECT_THAT(message([](const hdf5::Group&) {}), HasSubstr("no group mesh"));
  EXPECT_THAT(with_mesh([&](const hdf5::Group& mesh) { mesh.write("vertices", corners.data(), {9}, "m"); }),
              HasSubstr("/mesh: vertices must be [n, 3]"));
  EXPECT_THAT(with_mesh([&](const hdf5::Group& mesh) {
                mesh.write("vertices", corners.data(), {3, 3}, "m");
                mesh.write("triangles", wrong_index.data(), {1, 3}, "1");
              }),
              HasSubstr("/mesh"));
  EXPECT_THAT(with_mesh([&](const hdf5::Group& mesh) {
                mesh.write("vertices", wrong_index.data(), {1, 3}, "m");
              }),
              HasSubstr("does not hold floats"));
}

TEST_F(DamagedRunFile, EvaluationsAndSolvesThatMakeNoSenseAreErrors) {
  const auto message = [&](const std::function<void(const hdf5::Group&)>& fill) {
    return message_of<InputError>([&] { read_forged(fill); });
  };
  EXPECT_THAT(message([](const hdf5::Group& root) { root.create("evaluation").set_attribute("evaluation", "nobody"); }),
              HasSubstr("unknown evaluation 'nobody'"));
  EXPECT_THAT(message([](const hdf5::Group& root) {
                const hdf5::Group evaluation = root.create("evaluation");
                evaluation.set_attribute("evaluation", "edge");
                evaluation.set_attribute("scheme", "chief");
              }),
              HasSubstr("/evaluation/mesh"));
  const auto solves = [](std::int64_t steps, std::int64_t converged, std::size_t stages) {
    return [=](const hdf5::Group& root) {
      const hdf5::Group group = root.create("solves");
      const double number = 1.0;
      group.write_texts("stage", std::vector<std::string>(stages, "pressure"));
      for (const char* name : {"scheme", "solver", "precision"}) group.write_texts(name, {"any"});
      const std::int64_t one = 1;
      for (const char* name : {"unknowns", "right_hand_sides", "refinements"}) {
        group.write(name, &one, {1}, "1");
      }
      group.write("steps", &steps, {1}, "1");
      group.write("converged", &converged, {1}, "1");
      group.write("residual", &number, {1}, "1");
      group.write("seconds", &number, {1}, "s");
    };
  };
  EXPECT_EQ(read_forged(solves(7, 1, 1)).solves[0].steps, 7);
  EXPECT_THAT(message(solves(1LL << 40, 1, 1)), HasSubstr("steps[0] = 1099511627776 is out of range"));
  EXPECT_THAT(message(solves(7, 2, 1)), HasSubstr("converged[0] = 2 is out of range"));
  EXPECT_THAT(message(solves(7, 1, 2)), HasSubstr("stage has 2 texts, must have 1"));
}

TEST_F(DamagedRunFile, ATransferMatrixThatMakesNoSenseIsAnError) {
  const std::array<double, 2> numbers = {1, 1};
  const std::array<Complex, 2> rows = {1, 1};
  const std::array<std::int64_t, 1> face = {0};
  const auto forge = [&](bool with_target, const hdf5::Shape& shape) {
    return message_of<InputError>([&] {
      read_forged([&](const hdf5::Group& root) {
        if (with_target) {
          const hdf5::Group target = root.create("target");
          target.write("face", face.data(), {1}, "1");
          target.write("amplitude", numbers.data(), {1}, "Pa");
          target.write("share", numbers.data(), {1}, "1");
          target.write("box", face.data(), {1}, "1");
        }
        const hdf5::Group transfer = root.create("transfer").create("paper");
        for (const char* name : {"outside_weight", "channels_left_out", "outside_left_out"}) {
          transfer.set_attribute(name, 0.0);
        }
        transfer.write("weight", numbers.data(), {1}, "m2");
        transfer.write("target", rows.data(), shape, "Pa");
        transfer.write("outside", rows.data(), {2, 1}, "Pa m");
        transfer.write("incident", rows.data(), {1, 1}, "Pa");
      });
    });
  };
  EXPECT_THAT(forge(false, {1, 1}), AllOf(HasSubstr("/transfer/paper"), HasSubstr("must have a target")));
  EXPECT_THAT(forge(true, {1, 2}), AllOf(HasSubstr("/transfer/paper"), HasSubstr("target must be [n, 1]")));
  EXPECT_THAT(forge(true, {1}), HasSubstr("target must be [n, 1]"));
  EXPECT_THAT(forge(true, {2, 1}), HasSubstr("a column of target has 2 values, must have 1"));
}

}  // namespace touchfield::run_file_damage_test
