#pragma once

#include <array>
#include <functional>
#include <random>
#include <string>

#include "sim/run/archive_file.h"
#include "sim/run/hdf5_file.h"
#include "tests/support/files.h"
#include "tests/support/testing.h"

/// What tests of result files share, and what each such file must withstand.
namespace touchfield {
inline namespace support {

/// A folder with a file to be.
class ResultFile : public ::testing::Test {
 protected:
  const TemporaryDirectory directory_{"with space \xc3\xa4"};
  const std::string path_ = directory_.file("result.h5");
};

/// What a forged file begins with: one face, one channel.
inline void forge_beginning(const hdf5::Group& root, const std::string& format, int version) {
  root.set_attribute("format", format);
  root.set_attribute("format_version", version);
  root.set_attribute("name", "forged");
  root.set_attribute("complete", 1);
  root.write_text("scene", "");
  root.set_attribute("solved_skin", "whole");
  const std::array<double, 9> corners = {0, 0, 0, 1, 0, 0, 0, 1, 0};
  const std::array<int, 3> triangle = {0, 1, 2};
  const hdf5::Group mesh = root.create("mesh");
  mesh.write("vertices", corners.data(), {3, 3}, "m");
  mesh.write("triangles", triangle.data(), {1, 3}, "1");
  const hdf5::Group array = root.create("array");
  array.set_attribute("kind", "transducers");
  array.set_attribute("directivity", "omni");
  array.write("position", corners.data(), {1, 3}, "m");
  array.write("axis", corners.data() + 3, {1, 3}, "1");
  array.write("amplitude", corners.data(), {1}, "Pa m");
  array.write("device", triangle.data(), {1}, "1");
  array.write("channel", triangle.data(), {1}, "1");
}

/// A file that is cut, at so many places and anywhere in its last 100 bytes, continued, or of which one bit is changed,
/// so many times, is refused.
inline void expect_damage_is_seen(const std::string& path, const std::function<void()>& read, std::size_t cuts,
                                  int changes) {
  const std::string bytes = read_bytes(path);
  for (std::size_t size = 0; size < bytes.size(); size += size + 100 < bytes.size() ? bytes.size() / cuts + 1 : 1) {
    write_bytes(path, bytes.substr(0, size));
    EXPECT_THROW(read(), InputError) << size << " of " << bytes.size();
  }
  write_bytes(path, bytes + "more");
  EXPECT_THROW(read(), InputError);
  std::mt19937 random(1);
  for (int trial = 0; trial < changes; ++trial) {
    std::string damaged = bytes;
    const std::size_t at = random() % bytes.size();
    damaged[at] = static_cast<char>(static_cast<unsigned char>(damaged[at]) ^ (1U << (random() % 8)));
    write_bytes(path, damaged);
    EXPECT_THROW(read(), InputError) << "byte " << at;
  }
}

}  // namespace support
}  // namespace touchfield
