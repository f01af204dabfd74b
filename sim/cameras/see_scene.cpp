#include "sim/cameras/see_scene.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "sim/cameras/camera_folder.h"
#include "sim/cameras/landmark_table.h"
#include "sim/core/files.h"
#include "sim/core/require.h"
#include "sim/core/units.h"
#include "sim/hand/hand_flesh.h"
#include "sim/model/stages.h"
#include "sim/motion/loop_clock.h"
#include "sim/pictures/sight_picture.h"
#include "sim/scene/quantity.h"
#include "sim/scene/schema.h"

namespace touchfield {

namespace {

std::string sight_name(PictureFormat format) { return "sight." + to_string(format); }

/// The skin at one time, and what the cameras see of it.
struct Instant {
  TriangleMesh mesh;
  DepthFrame frame;
  Points landmarks;
};

/// Landmarks of a hand that the scene's bodies have.
std::vector<std::string> landmark_names(const SeenScene& seen) {
  std::vector<std::string> names;
  for (const Landmark& landmark : seen.moving.first().body.landmarks) {
    if (std::ranges::count(hand_landmark_names(), landmark.name) > 0) {
      names.push_back(landmark.name);
    }
  }
  return names;
}

Instant instant_of(const SeenScene& seen, int number, const std::vector<std::string>& landmarks) {
  const double seconds = to_seconds(instant(number, seen.moving.first().fixed->scene.motion->sensor.hz));
  const MotionState state = seen.moving.state(seconds);
  const Model model = seen.moving.at(state);
  TriangleMesh mesh = seen.skin.at(model, state);
  DepthFrame frame = seen.cameras.sees(mesh, seconds, static_cast<std::uint64_t>(number));
  return {std::move(mesh), std::move(frame), landmark_points(model.body.mesh, model.body.landmarks, landmarks)};
}

void draw_instant(const std::string& path, const SeenScene& seen, const Instant& instant, PictureFormat format) {
  std::vector<CameraSight> sights;
  for (std::size_t c = 0; c < instant.frame.images.size(); ++c) {
    const Camera& camera = seen.cameras.real()[c].view;
    sights.push_back(
        {fmt::format("{}: {}, {} x {}", seen.cameras.told()[c].name, seen.models[c], camera.width, camera.height),
         camera, instant.frame.images[c].depth});
  }
  draw_sights(path, seen.moving.first().fixed->scene.name, "view of each camera in the first frame", instant.mesh,
              sights, format);
}

/// The largest depth that 16 bits hold [m].
double farthest_depth(const StereoCamera& camera) { return kMostUnits * camera.depth_unit; }

/// Adds a frame to the mean of `frames`.
void add_sight(const StereoCamera& camera, const DepthImage& image, const DepthImage& exact, int frames,
               SightSummary& summary) {
  int seen = 0;
  int holes = 0;
  int beyond = 0;
  for (std::size_t p = 0; p < exact.depth.size(); ++p) {
    if (exact.depth[p] > 0) {
      const auto depth = static_cast<double>(exact.depth[p]);
      ++seen;
      holes += image.depth[p] > 0 ? 0 : 1;
      beyond += depth > farthest_depth(camera) ? 1 : 0;
      summary.nearest = summary.nearest > 0 ? std::min(summary.nearest, depth) : depth;
      summary.farthest = std::max(summary.farthest, depth);
    }
  }
  summary.pixels += static_cast<double>(seen - holes) / frames;
  summary.holes += seen > 0 ? static_cast<double>(holes) / seen / frames : 0.0;
  summary.beyond += seen > 0 ? static_cast<double>(beyond) / seen / frames : 0.0;
}

/// What of a camera's images the user should know; empty for nothing.
std::string sight_warning(const StereoCamera& camera, const SightSummary& own) {
  if (own.farthest == 0) {
    return fmt::format("sight: {} sees nothing of the body", own.camera);
  }
  const std::string away =
      fmt::format("{:.0f} to {:.0f} mm away", own.nearest / kMillimetre, own.farthest / kMillimetre);
  const std::string unit = fmt::format("{:.6g}", camera.depth_unit / kMillimetre);
  if (own.beyond > 0) {
    return fmt::format(
        "sight: {} has no depth beyond {:.0f} mm, {:.0f} times depth_unit_mm = {}, and the body is {}, {:.0f} % of it "
        "beyond: a larger depth_unit_mm reaches farther",
        own.camera, farthest_depth(camera) / kMillimetre, kMostUnits, unit, away, std::ceil(100 * own.beyond));
  }
  if (own.pixels == 0 && own.farthest < camera.nearest()) {
    return fmt::format("sight: {} has no depth of the body, which is {}; it has depth from {:.0f} mm on", own.camera,
                       away, camera.nearest() / kMillimetre);
  }
  if (own.pixels == 0) {
    return fmt::format(
        "sight: {} has no depth of the body, which is {}; it has depth from {:.0f} to {:.0f} mm, where both eyes see "
        "the "
        "skin less steeply than {:.0f} degrees",
        own.camera, away, camera.nearest() / kMillimetre, farthest_depth(camera) / kMillimetre, kGrazing / kDegree);
  }
  return {};
}

}  // namespace

SeenScene seen_scene(const Scene& scene, Progress* progress) {
  const auto* specs = scene.motion ? std::get_if<std::vector<CameraSpec>>(&scene.motion->sensor.sight) : nullptr;
  require(specs != nullptr, "motion.sensor.cameras is missing: see makes the images of simulated cameras");
  const MotionSpec& motion = *scene.motion;
  const auto frames = last_instant(to_ticks(motion.seconds) - 1, motion.sensor.hz) + 1;
  require(frames <= static_cast<std::int64_t>(schema::kMostListed),
          "motion.sensor.hz: {} images per camera in {} s, must be <= {}", frames, motion.seconds, schema::kMostListed);
  MovingModel moving(scene, nullptr, progress);
  WholeSkin skin(moving.first());
  std::vector<std::string> models;
  std::ranges::transform(*specs, std::back_inserter(models), &CameraSpec::model);
  return {std::move(moving), std::move(skin), SimulatedCameras(*specs, motion.sensor.seed), std::move(models),
          static_cast<int>(frames)};
}

std::vector<std::string> sight_files(const SeenScene& seen, PictureFormat format) {
  std::vector<std::string> files = {"see.log", "failed.json", sight_name(format)};
  if (!landmark_names(seen).empty()) {
    files.emplace_back(kLandmarksFile);
  }
  const std::vector<std::string> images = recorded_files(seen.cameras.told(), static_cast<std::size_t>(seen.frames));
  files.insert(files.end(), images.begin(), images.end());
  return files;
}

std::vector<SightSummary> see_scene(const SeenScene& seen, RunDirectory& directory, PictureFormat format,
                                    Progress& progress) {
  const std::vector<DepthCamera>& told = seen.cameras.told();
  CameraFolderWriter folder(directory.path(), told);
  std::vector<SightSummary> summaries;
  std::ranges::transform(told, std::back_inserter(summaries),
                         [](const DepthCamera& camera) { return SightSummary{.camera = camera.name}; });
  LandmarkRecording landmarks{.names = landmark_names(seen), .seconds = {}, .at = {}};
  std::vector<std::pair<std::string, double>> seconds;
  timed(progress, seconds, "see", fmt::format("{} images of each of {} cameras", seen.frames, told.size()), [&] {
    for (int k = 0; k < seen.frames; ++k) {
      const Instant instant = instant_of(seen, k, landmarks.names);
      folder.add(instant.frame);
      landmarks.seconds.push_back(instant.frame.seconds);
      landmarks.at.push_back(instant.landmarks);
      for (std::size_t c = 0; c < told.size(); ++c) {
        add_sight(seen.cameras.real()[c], instant.frame.images[c],
                  exact_image(seen.cameras.real()[c].view, instant.mesh), seen.frames, summaries[c]);
      }
      if (k == 0) {
        draw_instant(directory.file(sight_name(format)), seen, instant, format);
      }
      progress.advance((k + 1.0) / seen.frames);
    }
  });
  if (!landmarks.names.empty()) {
    write_atomically(directory.file(kLandmarksFile), {landmarks_csv(landmarks)});
  }
  for (std::size_t c = 0; c < told.size(); ++c) {
    if (const std::string warning = sight_warning(seen.cameras.real()[c], summaries[c]); !warning.empty()) {
      progress.warn(warning);
    }
  }
  return summaries;
}

}  // namespace touchfield
