#include "sim/cameras/camera_folder.h"

#include <csignal>
#include <filesystem>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fmt/format.h>

#include "sim/cameras/depth_camera.h"
#include "tests/cameras/recording_support.h"
#include "tests/support/output_support.h"
#include "tests/support/testing.h"

namespace touchfield::camera_folder_test {

void expect_same(const DepthCamera& camera, const DepthCamera& other) {
  EXPECT_EQ(camera.name, other.name);
  EXPECT_EQ(camera.view.width, other.view.width);
  EXPECT_EQ(camera.view.height, other.view.height);
  EXPECT_EQ(camera.view.focal, other.view.focal);
  EXPECT_TRUE(camera.view.centre.isApprox(other.view.centre, 1e-15));
  EXPECT_EQ(camera.view.eye, other.view.eye);
  EXPECT_LT((camera.view.axes - other.view.axes).norm(), 1e-15);
  EXPECT_EQ(camera.distortion, other.distortion);
  EXPECT_EQ(camera.depth_unit, other.depth_unit);
}

double worst_off(const DepthImage& image, const DepthImage& other) {
  double worst = image.depth.size() == other.depth.size() ? 0.0 : HUGE_VAL;
  for (std::size_t i = 0; i < image.depth.size() && std::isfinite(worst); ++i) {
    worst = std::max(worst, std::abs(static_cast<double>(image.depth[i]) - static_cast<double>(other.depth[i])));
  }
  return worst;
}

class Recording : public ::testing::Test {
 protected:
  Recording() { write_recording(path(), cameras_, 3); }

  std::string path() const { return folder_.file("recorded"); }
  std::string file(const std::string& name) const { return path() + "/" + name; }
  CameraFolder read() const { return CameraFolder(path()); }
  std::string refusal() const {
    return message_of<InputError>([&] { read(); });
  }
  /// The refusal with a text of a file replaced by another; the file is as before then.
  std::string refusal_with(const std::string& name, const std::string& text, const std::string& other) const {
    const std::string before = read_bytes(file(name));
    std::string changed = before;
    const std::size_t at = changed.find(text);
    EXPECT_NE(at, std::string::npos) << text;
    write_bytes(file(name), changed.replace(std::min(at, changed.size()), text.size(), other));
    std::string said = refusal();
    write_bytes(file(name), before);
    return said;
  }

  TemporaryDirectory folder_;
  std::vector<DepthCamera> cameras_ = two_cameras();
};

TEST_F(Recording, IsReadAsItWasWritten) {
  const CameraFolder recording = read();
  ASSERT_EQ(recording.cameras().size(), 2U);
  ASSERT_EQ(recording.size(), 3U);
  for (std::size_t c = 0; c < 2; ++c) expect_same(recording.cameras()[c], cameras_[c]);
  for (int i = 0; i < 3; ++i) {
    const auto number = static_cast<std::size_t>(i);
    const DepthFrame written = made_up_frame(cameras_, i);
    const DepthFrame frame = recording.frame(number);
    EXPECT_EQ(frame.seconds, written.seconds);
    EXPECT_EQ(recording.seconds(number), written.seconds);
    ASSERT_EQ(frame.images.size(), 2U);
    for (std::size_t c = 0; c < 2; ++c) {
      EXPECT_LE(worst_off(frame.images[c], written.images[c]), 0.5 * cameras_[c].depth_unit + 1e-7);
    }
  }
}

TEST_F(Recording, CentreCountsFromTheMiddleOfTheFirstPixelInTheFile) {
  EXPECT_THAT(read_bytes(file("cameras.yaml")), HasSubstr("cx: 11.87\n"));
  EXPECT_NEAR(read().cameras()[0].view.centre.x(), 12.37, 1e-12);
}

TEST_F(Recording, ACameraWithoutAFileSawNothing) {
  const std::string path = folder_.file("sparse");
  {
    CameraFolderWriter writer(path, cameras_);
    DepthFrame frame = made_up_frame(cameras_, 0);
    frame.images[0] = {};
    writer.add(frame);
  }
  EXPECT_EQ(read_bytes(path + "/times.csv"), "time_s,left,right\n0,,right/000000.png\n");
  const DepthFrame frame = CameraFolder(path).frame(0);
  EXPECT_EQ(frame.images[0].width, 24);
  EXPECT_EQ(frame.images[0].depth, std::vector<float>(384, 0.0F));
  EXPECT_GT(*std::ranges::max_element(frame.images[1].depth), 0.2F);
}

TEST_F(Recording, ColumnsComeInAnyOrderAndLinesMayBeComments) {
  write_bytes(file("times.csv"),
              "# made by hand\r\nright, time_s, left\r\n\r\n"
              "right/000001.png, 1.5, left/000002.png # late\r\n,2e0,left/000000.png");
  const CameraFolder recording = read();
  ASSERT_EQ(recording.size(), 2U);
  EXPECT_EQ(recording.seconds(0), 1.5);
  EXPECT_EQ(recording.seconds(1), 2.0);
  EXPECT_LE(worst_off(recording.frame(0).images[0], made_up_frame(cameras_, 2).images[0]), 0.51e-4);
  EXPECT_LE(worst_off(recording.frame(0).images[1], made_up_frame(cameras_, 1).images[1]), 0.51e-3);
}

TEST_F(Recording, WhatIsWrittenSoFarCanBeRead) {
  const std::string path = folder_.file("live");
  CameraFolderWriter writer(path, cameras_);
  EXPECT_THAT(message_of<InputError>([&] { CameraFolder{path}; }), HasSubstr("times.csv: no frame in it"));
  for (int i = 0; i < 3; ++i) {
    writer.add(made_up_frame(cameras_, i));
    EXPECT_EQ(CameraFolder(path).size(), static_cast<std::size_t>(i) + 1);
  }
  // As left by a process that was killed between the images of a frame.
  write_depth_png(path + "/left/000003.png", made_up_image(cameras_[0], 3), 1e-4);
  write_bytes(path + "/right/.000003.png.tmp-0123456789abcdef", "half");
  EXPECT_EQ(CameraFolder(path).size(), 3U);
}

TEST_F(Recording, AWriterThatIsKilledLeavesWhatCanBeRead) {
  for (const std::size_t frames : {1U, 2U, 5U, 9U}) {
    const std::string path = folder_.file(std::to_string(frames));
    const pid_t writer = ::fork();
    ASSERT_GE(writer, 0);
    if (writer == 0) {
      try {
        write_recording(path, cameras_, 10'000);
      } catch (const std::exception&) {
      }
      ::_exit(1);
    }
    const auto rows = [&] { return std::ranges::count(read_bytes(path + "/times.csv"), '\n'); };
    while (rows() <= static_cast<std::ptrdiff_t>(frames) && ::waitpid(writer, nullptr, WNOHANG) == 0) {
    }
    ::kill(writer, SIGKILL);
    ::waitpid(writer, nullptr, 0);
    const CameraFolder recording(path);
    EXPECT_GE(recording.size(), frames);
    EXPECT_EQ(recording.frame(recording.size() - 1).images.size(), 2U);
  }
}

TEST_F(Recording, TheWriterRefusesWhatCouldNotBeRead) {
  EXPECT_THAT(message_of<InputError>([&] { CameraFolderWriter(path(), cameras_); }),
              HasSubstr("cameras.yaml: there already"));
  const std::string path = folder_.file("other");
  const auto with = [&](const std::function<void(std::vector<DepthCamera>&)>& change) {
    std::vector<DepthCamera> cameras = cameras_;
    change(cameras);
    return message_of<InputError>([&] { CameraFolderWriter(path, cameras); });
  };
  EXPECT_THAT(with([](auto& cameras) { cameras[1].name = "left"; }), HasSubstr("left is item [0] already"));
  EXPECT_THAT(with([](auto& cameras) { cameras[1].name = "../up"; }), HasSubstr("cameras[1].name"));
  EXPECT_THAT(with([](auto& cameras) { cameras.clear(); }), HasSubstr("cameras"));
  EXPECT_FALSE(std::filesystem::exists(path));

  CameraFolderWriter writer(path, cameras_);
  const auto refused = [&](const DepthFrame& frame) { return message_of<InputError>([&] { writer.add(frame); }); };
  writer.add(made_up_frame(cameras_, 1));
  EXPECT_THAT(refused(made_up_frame(cameras_, 1)), HasSubstr("frame 1: at 0.0333"));
  DepthFrame frame = made_up_frame(cameras_, 2);
  frame.seconds = NAN;
  EXPECT_THAT(refused(frame), HasSubstr("frame 1: at nan s must be after"));
  frame = made_up_frame(cameras_, 2);
  std::swap(frame.images[0], frame.images[1]);
  EXPECT_THAT(refused(frame), EndsWith("frame 1: left: 32 x 20 pixels, must be 24 x 16"));
  frame.images.pop_back();
  EXPECT_THAT(refused(frame), EndsWith("frame 1: 1 images, must be 2"));
  writer.add(made_up_frame(cameras_, 2));
  EXPECT_EQ(CameraFolder(path).size(), 2U);
}

TEST_F(Recording, FaultsOfCamerasNameLineFieldAndRule) {
  struct Fault {
    const char* text;
    const char* other;
    const char* says;
  };
  for (const auto& [text, other, says] : {
           Fault{"format: touchfield-cameras", "format: other", ":1:9: format = other must be touchfield-cameras"},
           {"version: 1", "version: 2", "version = 2 must be 1"},
           {"name: right", "name: left", "cameras[1]: left is item [0] already"},
           {"name: right", "name: time_s", "cameras[1].name = time_s must be another name"},
           {"width: 24", "width: 0", "cameras[0].width = 0 must be 16 to 4096"},
           {"width: 24", "width: 1e9", "cameras[0].width = 1e9 must be 16 to 4096"},
           {"fx: 21.3", "fx: 0", "cameras[0].fx = 0 must be > 0"},
           {"fx: 21.3", "fx: 0.0018", "fx = 0.0018 must be 0.96 to 480, in pixels of an image of 24"},
           {"fx: 21.3", "fx: .nan", "cameras[0].fx = .nan must be a finite number"},
           {"fx: 21.3", "focal: 21.3", "focal: unknown key"},
           {"fx: 21.3", "focal: 21.3", "fx: missing"},
           {"cx: 11.87", "cx: 640", "cx = 640 must be -24 to 48, in pixels of an image of 24"},
           {"depth_unit_mm: 0.1", "depth_unit_mm: 0.001", "depth_unit_mm = 0.001 must be 0.01 to 10: how many mm"},
           {"depth_unit_mm: 0.1", "depth_unit_mm: 1000", "depth_unit_mm = 1000 must be 0.01 to 10"},
           {"model: none", "model: fisheye", "distortion.model = fisheye must be"},
           {"model: brown_conrady", "model: none", "cameras[1].distortion: coefficients that are not 0"},
           {"model: brown_conrady", "model: inverse_brown_conrady", "undistort the images"},
           {"k1: 0.08", "k1: -3", "cameras[1].distortion: cannot be undone within the image"},
           {"translation_mm: [210", "translation_mm: [1e12", "translation_mm[0] = 1e12 must be"},
           {"cameras:", "cameras: [", ""},
       }) {
    EXPECT_THAT(refusal_with("cameras.yaml", text, other), AllOf(HasSubstr("recorded/cameras.yaml:"), HasSubstr(says)));
  }
  std::filesystem::remove(file("cameras.yaml"));
  EXPECT_THAT(refusal(), EndsWith("recorded/cameras.yaml: no such file"));
}

TEST_F(Recording, APoseIsARotationOrAQuaternionOfUnitLength) {
  const Eigen::Matrix3d axes = cameras_[0].view.axes;
  const std::string text = read_bytes(file("cameras.yaml"));
  const std::size_t begin = text.find("rotation:");
  const std::size_t end = text.find("translation_mm");
  const auto with = [&](const std::string& pose) {
    const std::string indent = text.substr(text.rfind('\n', end) + 1, end - text.rfind('\n', end) - 1);
    return text.substr(0, begin) + pose + "\n" + indent + text.substr(end);
  };
  const auto rows = [](const Eigen::Matrix3d& m, int digits) {
    return fmt::format(
        "rotation: [[{1:.{0}f}, {2:.{0}f}, {3:.{0}f}], [{4:.{0}f}, {5:.{0}f}, {6:.{0}f}], "
        "[{7:.{0}f}, {8:.{0}f}, {9:.{0}f}]]",
        digits, m(0, 0), m(0, 1), m(0, 2), m(1, 0), m(1, 1), m(1, 2), m(2, 0), m(2, 1), m(2, 2));
  };
  const auto read_axes = [&](const std::string& pose) {
    write_bytes(file("cameras.yaml"), with(pose));
    return read().cameras()[0].view.axes;
  };
  const auto refused = [&](const std::string& pose) {
    write_bytes(file("cameras.yaml"), with(pose));
    return refusal();
  };
  const Eigen::Matrix3d rounded = read_axes(rows(axes, 5));
  EXPECT_LT((rounded - axes).norm(), 2e-5);
  EXPECT_LT((rounded.transpose() * rounded - Eigen::Matrix3d::Identity()).norm(), 1e-14);
  const Eigen::Quaterniond q(axes);
  EXPECT_LT((read_axes(fmt::format("quaternion_wxyz: [{}, {}, {}, {}]", q.w(), q.x(), q.y(), q.z())) - axes).norm(),
            1e-15);
  EXPECT_THAT(refused(rows(1.01 * axes, 9)),
              HasSubstr("cameras[0].pose.rotation: R^T R differs from 1 by 0.02, must by at most 0.0001"));
  Eigen::Matrix3d mirrored = axes;
  mirrored.col(1) *= -1;
  EXPECT_THAT(refused(rows(mirrored, 9)), HasSubstr("pose.rotation: a reflection, must be a rotation"));
  EXPECT_THAT(refused("quaternion_wxyz: [1, 1, 0, 0]"), HasSubstr("quaternion_wxyz: of length 1.41421, must be 1"));
  EXPECT_THAT(refused(rows(axes, 9) + "\n      quaternion_wxyz: [1, 0, 0, 0]"), HasSubstr("must be exactly one of"));
  EXPECT_THAT(refused(""), HasSubstr("none of rotation, quaternion_wxyz given"));
}

TEST_F(Recording, FaultsOfTimesNameTheLine) {
  const auto with = [&](const std::string& text, const std::string& other) {
    return refusal_with("times.csv", text, other);
  };
  EXPECT_THAT(with("time_s,left,right", "0,left/000000.png,"),
              HasSubstr("recorded/times.csv:1: a header time_s,left,right must come first"));
  EXPECT_THAT(with("time_s,left,right", "time_s,left,left"), HasSubstr("times.csv:1: a header"));
  EXPECT_THAT(with("\n0,", "\n1e-7x,"), HasSubstr("times.csv:2: time_s = 1e-7x must be a number"));
  EXPECT_THAT(with("\n0,", "\n0,0,"), HasSubstr("times.csv:2: 4 values, must be 3 as in the header"));
  EXPECT_THAT(with("\n0,", "\n0.05,"), HasSubstr("times.csv:3: time_s = 0.0333333333333333 must be after 0.05"));
  EXPECT_THAT(with("left/000001.png", "left/1.png"),
              AllOf(HasSubstr("recorded/times.csv:3: left: "), HasSubstr("recorded/left/1.png: no such file")));
  EXPECT_THAT(with("left/000001.png", "left"), HasSubstr("recorded/left: must be a file"));
  std::filesystem::remove(file("times.csv"));
  EXPECT_THAT(refusal(), HasSubstr("recorded/times.csv: no such file"));
  ASSERT_EQ(::mkfifo(file("times.csv").c_str(), 0600), 0);
  EXPECT_THAT(refusal(), EndsWith("recorded/times.csv: must be a file"));
  EXPECT_THAT(message_of<InputError>([&] { CameraFolder{folder_.file("none")}; }), EndsWith("none: no such folder"));
}

TEST_F(Recording, TimesAreThoseOfAnyClockThatCountsSeconds) {
  const auto timed = [&](double first, double period) {
    write_bytes(file("times.csv"),
                fmt::format("time_s,left,right\n{},,\n{},,\n{},,\n", first, first + period, first + 2 * period));
    return read();
  };
  const CameraFolder since_1970 = timed(1763900000.25, 0.03125);
  EXPECT_EQ(since_1970.seconds(2), 1763900000.3125);
  EXPECT_THAT(since_1970.warnings(), IsEmpty());
  EXPECT_THAT(timed(-7, 0.5).warnings(), IsEmpty());
  // In milliseconds, microseconds and by numbers of frames; by hours.
  for (const double period : {33.333, 33333.0, 1.0}) {
    EXPECT_THAT(timed(0, period).warnings(), ElementsAre(HasSubstr("too far to follow a hand"))) << period;
  }
  EXPECT_THAT(timed(0, 1e-5).warnings(), ElementsAre(HasSubstr("the images are 1e-05 s apart (median)")));
  // Since 1970 in milliseconds: of many rows one line.
  const std::string said = message_of<InputError>([&] { timed(1763900000250.0, 31.25); });
  EXPECT_THAT(said, AllOf(HasSubstr("times.csv:2: time_s = 1763900000250"), HasSubstr("must be at most 1e+10")));
  EXPECT_EQ(std::ranges::count(said, '\n'), 0);
}

TEST_F(Recording, WhatIsHardlyMeantIsWarnedOf) {
  const auto warnings = [&](const std::function<void(std::vector<DepthCamera>&)>& change) {
    std::vector<DepthCamera> cameras = cameras_;
    change(cameras);
    return recording_warnings(cameras, {0.0, 0.033, 0.067});
  };
  EXPECT_THAT(warnings([](auto&) {}), IsEmpty());
  EXPECT_THAT(warnings([](auto& cameras) { cameras[1].view.eye = cameras[0].view.eye + Vector3(0.9e-3, 0, 0); }),
              ElementsAre(HasSubstr("left and right stand 0.9 mm apart")));
  EXPECT_THAT(warnings([](auto& cameras) {
                for (DepthCamera& camera : cameras) camera.view.eye *= 1e-3;  // in metres
              }),
              ElementsAre(HasSubstr("all stand within 0.3 mm of the world's origin")));
  EXPECT_THAT(warnings([](auto& cameras) {
                cameras.pop_back();
                cameras[0].view.eye.setZero();
              }),
              IsEmpty());
  EXPECT_THAT(warnings([](auto& cameras) { cameras[0].view.centre *= 2; }),
              ElementsAre(HasSubstr("the axis of left is at (24.24, 15.08) in an image of 24 x 16")));
  EXPECT_THAT(warnings([](auto& cameras) { cameras[0].view.focal.y() *= 1.5; }),
              ElementsAre(HasSubstr("fx = 21.3 and fy = 31.35 of left differ by a factor of 1.5")));
}

TEST_F(Recording, DamageWithinAnImageIsFoundAsItIsRead) {
  std::string bytes = read_bytes(file("left/000001.png"));
  bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 0x10);
  write_bytes(file("left/000001.png"), bytes);
  const CameraFolder recording = read();
  EXPECT_EQ(recording.frame(0).images.size(), 2U);
  EXPECT_THAT(message_of<InputError>([&] { recording.frame(1); }), HasSubstr("left/000001.png: damaged: "));
}

/// The Python program in the documentation writes a folder that is read.
TEST(RecordedInPython, IsRead) {
  const std::string page = read_bytes(std::string(TOUCHFIELD_SOURCE_DIR) + "/docs/cameras.md");
  const std::string fence = "```python\n";
  const std::size_t begin = page.find(fence);
  ASSERT_NE(begin, std::string::npos);
  const TemporaryDirectory folder;
  write_bytes(folder.file("record.py"),
              page.substr(begin + fence.size(), page.find("\n```", begin) - begin - fence.size()));
  if (std::system("/usr/bin/python3 -c 'import numpy, PIL' 2> /dev/null") != 0) {
    GTEST_SKIP() << "no python3 with NumPy and Pillow";
  }
  ASSERT_EQ(std::system(("cd " + folder.path().string() + " && /usr/bin/python3 record.py").c_str()), 0);
  const CameraFolder recording(folder.file("recorded"));
  ASSERT_EQ(recording.size(), 30U);
  EXPECT_NEAR(recording.seconds(29), 29 / 30.0, 1e-12);
  ASSERT_EQ(recording.cameras().size(), 1U);
  const Camera& view = recording.cameras()[0].view;
  EXPECT_EQ(view.centre, Eigen::Vector2d(320, 180));
  EXPECT_EQ(view.axes.col(2), Vector3::UnitZ());
  const DepthFrame frame = recording.frame(29);
  const auto at = [&](int column, int row) {
    return frame.images[0].depth[static_cast<std::size_t>(row * 640 + column)];
  };
  EXPECT_FLOAT_EQ(at(0, 0), 0.0F);
  EXPECT_FLOAT_EQ(at(320, 180), 0.3290F);
  EXPECT_FLOAT_EQ(at(639, 180), 0.0F);
}

}  // namespace touchfield::camera_folder_test
