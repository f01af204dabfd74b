#include <filesystem>
#include <random>

#include "tests/cameras/recording_support.h"
#include "tests/support/files.h"
#include "tests/support/testing.h"

namespace touchfield::damaged_recording_test {

namespace fs = std::filesystem;

using Random = std::mt19937;

std::size_t below(Random& random, std::size_t count) { return count == 0 ? 0 : random() % count; }

/// Numbers and words that a hand, a program or an attacker may put into a text.
const std::array<const char*, 20> kWords{
    "",   "0", "-1", "1e999", "nan",   "1e-320", "999999999999", "[",  "]",  "{}",
    "\n", "#", ",",  "\t",    "&a *a", "- - -",  "\xFF\xFE",     "''", ": ", "../left/000000.png"};

void flip_bytes(Random& random, std::string& bytes) {
  for (std::size_t i = below(random, 4); !bytes.empty() && i < 4; ++i) {
    bytes[below(random, bytes.size())] = static_cast<char>(random());
  }
}

void change_digits(Random& random, std::string& bytes) {
  for (std::size_t i = below(random, 3); i < 3; ++i) {
    const std::size_t at = bytes.find_first_of("0123456789.", below(random, bytes.size()));
    if (at != std::string::npos) bytes[at] = "0123456789.-e"[below(random, 13)];
  }
}

void cut_off(Random& random, std::string& bytes) { bytes.resize(below(random, bytes.size())); }

void empty(Random& /*random*/, std::string& bytes) { bytes.clear(); }

void leave_out(Random& random, std::string& bytes) {
  const std::size_t at = below(random, bytes.size());
  bytes.erase(at, 1 + below(random, 40));
}

void say_twice(Random& random, std::string& bytes) {
  const std::size_t at = below(random, bytes.size());
  const std::string part = bytes.substr(at, 1 + below(random, 60));
  bytes.insert(below(random, bytes.size()), part);
}

void put_word(Random& random, std::string& bytes) {
  const std::size_t at = below(random, bytes.size());
  bytes.replace(at, below(random, 6), kWords[below(random, kWords.size())]);
}

/// A header that another image has, its checksum right.
void other_header(Random& random, std::string& bytes) {
  const std::array<std::uint32_t, 6> sizes{0, 1, 24, 4096, 0x7FFFFFFF, 0xFFFFFFFF};
  const std::array<char, 5> bits{1, 8, 16, 32, 0};
  const bool same_size = random() % 2 == 0;
  const std::string begin = png_begin(
      same_size ? 24 : sizes[below(random, sizes.size())], same_size ? 16 : sizes[below(random, sizes.size())],
      bits[below(random, bits.size())], static_cast<char>(random() % 8), static_cast<char>(random() % 2));
  bytes.replace(0, std::min(bytes.size(), begin.size()), begin);
}

/// Pixels of random bytes, packed as they should be or not.
void other_pixels(Random& random, std::string& bytes) {
  std::string rows(below(random, 2000), '\0');
  for (char& byte : rows) byte = static_cast<char>(random());
  bytes = png_begin(24, 16, 16, 0) + png_chunk("IDAT", random() % 2 == 0 ? rows : zlib_packed(rows)) +
          png_chunk("IEND", "");
}

/// A new file: one that is cut to nothing and written again is brought to the disk each time.
void write_anew(const std::string& file, const std::string& bytes) {
  fs::remove(file);
  write_bytes(file, bytes);
}

/// A folder of good images, in which one or two files are damaged in turn and put right again.
class Damaged {
 public:
  Damaged() {
    write_recording(folder_.path(), two_cameras(), 3);
    for (const auto& entry : fs::recursive_directory_iterator(folder_.path())) {
      if (entry.is_regular_file()) files_.push_back(entry.path());
    }
    std::ranges::sort(files_);
    for (const std::string& file : files_) good_.push_back(read_bytes(file));
  }

  std::string path() const { return folder_.path(); }

  void damage(Random& random) {
    const std::size_t times = 1 + random() % 2;
    for (std::size_t i = 0; i < times; ++i) {
      // Texts half of the time.
      const bool text = random() % 2 == 0;
      const std::string& file =
          text ? folder_.file(random() % 2 == 0 ? "cameras.yaml" : "times.csv") : files_[below(random, files_.size())];
      damage_file(random, file);
    }
  }

  void repair() {
    for (std::size_t i = 0; i < files_.size(); ++i) {
      if (fs::is_directory(files_[i])) fs::remove_all(files_[i]);
      if (!fs::exists(files_[i]) || read_bytes(files_[i]) != good_[i]) {
        fs::create_directories(fs::path(files_[i]).parent_path());
        write_anew(files_[i], good_[i]);
      }
    }
  }

 private:
  void damage_file(Random& random, const std::string& file) {
    constexpr std::array kKinds{&flip_bytes, &change_digits, &change_digits, &cut_off,      &empty,
                                &leave_out,  &say_twice,     &put_word,      &other_header, &other_pixels};
    const std::size_t kind = below(random, kKinds.size() + 3);
    if (!fs::is_regular_file(file)) return;
    if (kind < kKinds.size()) {
      std::string bytes = read_bytes(file);
      kKinds[kind](random, bytes);
      write_anew(file, bytes);
    } else if (kind == kKinds.size()) {
      fs::remove(file);
    } else if (kind == kKinds.size() + 1) {
      write_anew(file, good_[below(random, good_.size())]);
    } else {
      fs::remove(file);
      fs::create_directory(file);
    }
  }

  TemporaryDirectory folder_;
  std::vector<std::string> files_;
  std::vector<std::string> good_;
};

/// What holds of every folder that is not refused.
void expect_sound(const CameraFolder& recording) {
  ASSERT_GE(recording.size(), 1U);
  for (std::size_t i = 0; i < recording.size(); ++i) {
    EXPECT_TRUE(std::isfinite(recording.seconds(i)));
    EXPECT_TRUE(i == 0 || recording.seconds(i) > recording.seconds(i - 1));
    const DepthFrame frame = recording.frame(i);
    ASSERT_EQ(frame.images.size(), recording.cameras().size());
    for (std::size_t c = 0; c < frame.images.size(); ++c) {
      const DepthCamera& camera = recording.cameras()[c];
      require_camera(camera.view);
      const auto& depth = frame.images[c].depth;
      ASSERT_EQ(depth.size(), static_cast<std::size_t>(camera.view.width * camera.view.height));
      const auto [least, most] = std::ranges::minmax(depth);
      EXPECT_GE(least, 0.0F);
      EXPECT_LE(most, 65536 * camera.depth_unit);
    }
  }
}

class DamagedRecordings : public ::testing::TestWithParam<int> {};

TEST_P(DamagedRecordings, AreRefusedOrSound) {
  Damaged folder;
  expect_sound(CameraFolder(folder.path()));
  int refused = 0;
  for (int i = 0; i < GetParam(); ++i) {
    Random random(static_cast<unsigned>(i));
    folder.damage(random);
    try {
      const CameraFolder recording(folder.path());
      expect_sound(recording);
    } catch (const InputError& error) {
      ++refused;
      EXPECT_NE(std::string(error.what()).find(folder.path()), std::string::npos) << i << ": " << error.what();
    } catch (const std::exception& error) {
      ADD_FAILURE() << i << ": " << error.what();
    }
    folder.repair();
  }
  EXPECT_GT(refused, GetParam() / 2);
  EXPECT_LT(refused, GetParam());
  RecordProperty("refused", refused);
}

INSTANTIATE_TEST_SUITE_P(Small, DamagedRecordings, ::testing::Values(500));
INSTANTIATE_TEST_SUITE_P(Full, DamagedRecordings, ::testing::Values(10'000));

}  // namespace touchfield::damaged_recording_test
