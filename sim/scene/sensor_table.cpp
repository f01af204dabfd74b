#include <fmt/format.h>

#include "sim/scene/camera_models.h"
#include "sim/scene/rigid_pose.h"
#include "sim/scene/scene_table.h"

namespace touchfield::schema {

namespace {

std::vector<std::string> camera_names() {
  std::vector<std::string> names;
  for (const CameraModel& model : camera_models()) {
    names.push_back(model.name);
  }
  return names;
}

Codec<CameraSpec> camera_codec() {
  const auto pixels = integer(between(16, 4096));
  return Map<CameraSpec>()
      .key("model", &CameraSpec::model, word(camera_names()), "Its field of view, baseline and nearest depth.")
      .required("at_mm", &CameraSpec::at, vector3(kMillimetres, {}), "[150, 0, 0]",
                "Where its eye is in the world [mm].")
      .required("look_at_mm", &CameraSpec::look_at, vector3(kMillimetres, {}), "[0, 0, 300]",
                "A point in the middle of its image [mm].")
      .key("roll_deg", &CameraSpec::roll, number(kDegrees, {}),
           "Its turn about where it looks, clockwise seen from behind it; 0: the rows of its image are level, of a "
           "camera "
           "that looks straight up or down along x [deg].")
      .key("resolution", &CameraSpec::resolution, tuple_of<int, 2>(pixels), "Columns and rows of its depth images.")
      .key("disparity_noise_px", &CameraSpec::disparity_noise, number(kPlain, between(0, 2)),
           "Noise of the disparity that depth comes from, root mean square [pixels].")
      .key("depth_unit_mm", &CameraSpec::depth_unit, number(kMillimetres, between(0.01, 10)),
           "What depths are rounded to [mm].")
      .key("place_error_mm", &CameraSpec::shift_error, number(kMillimetres, between(0, 100)),
           "How far from its place the fit takes it to be, in a direction that is drawn [mm].")
      .key("turn_error_deg", &CameraSpec::turn_error, number(kDegrees, between(0, 30)),
           "Likewise its turn, about an axis that is drawn [deg].")
      .check([](const Input& in, CameraSpec& camera, bool good) {
        if (good && (camera.look_at - camera.at).norm() < 1e-3) {
          in.at(*in.node().find("look_at_mm")).must_be("1 mm or more from at_mm");
          return false;
        }
        return good;
      })
      .codec();
}

bool check_pixels(const Input& in, const MotionSpec::Sensor& sensor) {
  const auto* cameras = std::get_if<std::vector<CameraSpec>>(&sensor.sight);
  std::int64_t pixels = 0;
  for (const CameraSpec& camera : cameras == nullptr ? std::vector<CameraSpec>() : *cameras) {
    pixels += std::int64_t{camera.resolution[0]} * camera.resolution[1];
  }
  if (pixels > kMostCameraPixels) {
    in.at(*in.node().find("cameras"))
        .problem(fmt::format("their images have {} pixels together, must be at most {}", pixels, kMostCameraPixels));
    return false;
  }
  return true;
}

Codec<RecordedSpec> recorded_codec() {
  return Map<RecordedSpec>()
      .required(
          "folder", &RecordedSpec::folder, absolute_file(), "recorded",
          "Folder of 16-bit depth images, cameras.yaml and times.csv, as `touchfield see` writes it; a relative name "
          "counts from the scene's folder.")
      .codec();
}

Codec<JointsSpec> tracked_joints_codec() {
  return Map<JointsSpec>()
      .maybe("file", &JointsSpec::from, absolute_file(), "hand.csv",
             "Table of the joints of a hand, one row per frame, as OpenXR names them. A relative name counts from the "
             "scene's folder.")
      .maybe("port", &JointsSpec::from, integer(between(1, 65535)), "9000",
             "UDP port of this machine on which a tracker's program sends joints while `touchfield live` plays.")
      .exactly_one({"file", "port"})
      .key("pose", &JointsSpec::pose, rigid_pose_codec("the tracker's x, y and z"),
           "How the tracker's own frame lies in the world.")
      .codec();
}

}  // namespace

Codec<MotionSpec::Sensor> sensor_codec() {
  using Sensor = MotionSpec::Sensor;
  const std::vector<std::string> images{"cameras", "recorded"};
  const std::vector<std::string> fitted{"cameras", "recorded", "joints"};
  return Map<Sensor>()
      .key("hz", &Sensor::hz, number(kPlain, kRate), "Samples of the hand a second.")
      .key("latency_ms", &Sensor::latency, number(kMilliseconds, kDelay),
           "From when a sample is taken until the solver knows it [ms].")
      .maybe(
          "noise", &Sensor::sight, sensing_codec(), "",
          "The solver sees the skin as `sensing` shows that of a still, displaced by noise of its own in each sample.")
      .maybe("cameras", &Sensor::sight, list_of<CameraSpec>(camera_codec(), 1, 8), "",
             "The solver sees a hand fitted to images of simulated depth cameras.")
      .maybe("recorded", &Sensor::sight, recorded_codec(), "",
             "The solver sees a hand fitted to recorded depth images.")
      .maybe("joints", &Sensor::sight, tracked_joints_codec(), "",
             "The solver sees a hand fitted to the joints that a hand tracker has recorded.")
      .at_most_one({"noise", "cameras", "recorded", "joints"})
      .key("seed", &Sensor::seed, seed(), "Of what the cameras get wrong.")
      .written_if([](const Sensor& sensor) { return std::holds_alternative<std::vector<CameraSpec>>(sensor.sight); })
      .allowed_with({"cameras"})
      .maybe(
          "hand", &Sensor::hand, hand_codec(), "",
          "The built-in hand that is fitted, before its shape is learnt; if left out that of the scene, to images in "
          "the mean size.")
      .allowed_with(fitted)
      .key("workspace_mm", &Sensor::workspace, tuple_of<Vector3, 2>(vector3(kMillimetres, {})),
           "Two corners of the box that the hand is looked for in: the least x, y, z and the largest [mm].")
      .written_if([](const Sensor& sensor) {
        return std::holds_alternative<std::vector<CameraSpec>>(sensor.sight) ||
               std::holds_alternative<RecordedSpec>(sensor.sight);
      })
      .allowed_with(images)
      .check([](const Input& in, Sensor& sensor, bool good) {
        if (good && !((sensor.workspace[1] - sensor.workspace[0]).minCoeff() > 0)) {
          in.at(*in.node().find("workspace_mm")).at(1).must_be("beyond the first corner in x, y and z");
          return false;
        }
        return good && check_pixels(in, sensor);
      })
      .codec();
}

}  // namespace touchfield::schema
