#include "sim/cameras/see_scene.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "sim/cameras/camera_folder.h"
#include "sim/cameras/hand_tables.h"
#include "sim/core/files.h"
#include "sim/core/require.h"
#include "sim/core/units.h"
#include "sim/hand/hand_flesh.h"
#include "sim/model/stages.h"
#include "sim/motion/loop_clock.h"
#include "sim/pictures/canvas.h"
#include "sim/pictures/picture_parts.h"
#include "sim/scene/quantity.h"
#include "sim/scene/schema.h"

namespace touchfield {

namespace {

constexpr PixelBox kSights = {30, 90, 1010, 720};
constexpr int kGap = 10;
constexpr int kLabelHeight = 30;
constexpr std::size_t kOneColumn = 3;  // sights
constexpr Colour kHoleColour = {235, 30, 60};
constexpr Colour kBackground = {240, 240, 240};

/// Columns and rows of an image, from its upper left pixel.
struct ImagePart {
  double left = 0;
  double top = 0;
  double width = 0;
  double height = 0;
};

/// The part with the mesh, as wide for its height as the image; all of it where the mesh is not seen.
ImagePart part_with_mesh(const Raster& exact) {
  constexpr double kMargin = 1.1;
  const SeenPart seen = seen_part(exact);
  ImagePart part{0, 0, static_cast<double>(exact.width), static_cast<double>(exact.height)};
  if (seen.width() <= 0) {
    return part;
  }
  const double share = std::min(1.0, kMargin * std::max(seen.width() / part.width, seen.height() / part.height));
  const auto placed = [share](double middle, double size) {
    return std::clamp(middle - 0.5 * share * size, 0.0, size - share * size);
  };
  part.left = placed(0.5 * (seen.left + seen.right), part.width);
  part.top = placed(0.5 * (seen.top + seen.bottom), part.height);
  part.width *= share;
  part.height *= share;
  return part;
}

/// The largest box of an image's shape in a cell, at half its height.
///
/// right   whether it ends at the cell's right side, not begins at its left
PixelBox image_box(const PixelBox& cell, int width, int height, bool right) {
  const double scale = std::min(static_cast<double>(cell.width) / width, static_cast<double>(cell.height) / height);
  const int across = static_cast<int>(scale * width);
  const int down = static_cast<int>(scale * height);
  return {cell.x + (right ? cell.width - across : 0), cell.y + (cell.height - down) / 2, across, down};
}

/// One camera's sight, with what it would be if it were exact.
class SightPanel {
 public:
  SightPanel(const CameraSight& sight, const TriangleMesh& mesh)
      : sight_(sight), mesh_(mesh), exact_(rasterise(sight.camera, mesh.vertices(), mesh.triangles())) {
    require(sight.depth.size() == exact_.depth.size(), "{}: {} depths, must be {} x {}", sight.label,
            sight.depth.size(), exact_.width, exact_.height);
  }

  const Raster& exact() const { return exact_; }

  void draw(Canvas& canvas, const PixelBox& cell, double nearest, double farthest) const {
    const int width = (cell.width - kGap) / 2;
    const int height = cell.height - kLabelHeight;
    const PixelBox view = image_box({cell.x, cell.y, width, height}, exact_.width, exact_.height, true);
    const PixelBox close =
        image_box({cell.x + width + kGap, cell.y, width, height}, exact_.width, exact_.height, false);
    const ImagePart whole{0, 0, static_cast<double>(exact_.width), static_cast<double>(exact_.height)};
    const ImagePart part = part_with_mesh(exact_);
    draw_part(canvas, view, whole, [&](std::size_t pixel) { return shaded(pixel); });
    draw_part(canvas, close, part, [&](std::size_t pixel) { return said(pixel, nearest, farthest); });
    const double scale = view.width / whole.width;
    const auto pixels = [](double length) { return static_cast<int>(std::lround(length)); };
    canvas.frame({view.x + pixels(scale * part.left), view.y + view.height - pixels(scale * (part.top + part.height)),
                  pixels(scale * part.width), pixels(scale * part.height)},
                 kInk, 1.5);
    draw_fitted(canvas, view.x, view.y + view.height + 0.5 * kLabelHeight, sight_.label, {.size = 16}, cell.width);
  }

 private:
  template <typename ColourOf>
  void draw_part(Canvas& canvas, const PixelBox& box, const ImagePart& part, const ColourOf& colour) const {
    canvas.image(box, [&](int i, int j) {
      const int column = static_cast<int>(part.left + part.width * (i + 0.5) / box.width);
      const int row = static_cast<int>(part.top + part.height * (1 - (j + 0.5) / box.height));
      return colour(exact_.index(std::min(column, exact_.width - 1), std::min(row, exact_.height - 1)));
    });
    canvas.frame(box, kInk, 1.0);
  }

  /// Lit from the camera.
  Colour shaded(std::size_t pixel) const {
    constexpr double kDark = 60;
    constexpr double kBright = 235;
    if (exact_.face[pixel] == Raster::kNothing) {
      return kBackground;
    }
    const double facing = std::abs(mesh_.normals().col(exact_.face[pixel]).dot(sight_.camera.axes.col(2)));
    Colour grey;
    grey.fill(static_cast<std::uint8_t>(std::lround(kDark + (kBright - kDark) * facing)));
    return grey;
  }

  Colour said(std::size_t pixel, double nearest, double farthest) const {
    const auto depth = static_cast<double>(sight_.depth[pixel]);
    if (depth > 0) {
      return viridis((depth - nearest) / (farthest - nearest));
    }
    return exact_.face[pixel] == Raster::kNothing ? kBackground : kHoleColour;
  }

  const CameraSight& sight_;
  const TriangleMesh& mesh_;
  Raster exact_;
};

}  // namespace

void draw_sights(const std::string& path, const std::string& title, const std::string& subtitle,
                 const TriangleMesh& mesh, const std::vector<CameraSight>& sights) {
  std::vector<SightPanel> panels;
  panels.reserve(sights.size());
  double nearest = HUGE_VAL;
  double farthest = 0;
  for (const CameraSight& sight : sights) {
    for (const double depth : panels.emplace_back(sight, mesh).exact().depth) {
      nearest = std::min(nearest, depth);
      farthest = std::isfinite(depth) ? std::max(farthest, depth) : farthest;
    }
  }
  constexpr double kStep = 10 * kMillimetre;
  nearest = farthest > 0 ? kStep * std::floor(nearest / kStep) : 0.0;
  farthest = std::max(kStep * std::ceil(farthest / kStep), nearest + kStep);

  Canvas canvas(kPictureWidth, kPictureHeight);
  const int columns = sights.size() > kOneColumn ? 2 : 1;
  const int rows = (static_cast<int>(sights.size()) + columns - 1) / columns;
  for (int s = 0; s < static_cast<int>(sights.size()); ++s) {
    const int width = (kSights.width - (columns - 1) * 2 * kGap) / columns;
    const int height = kSights.height / rows;
    panels[static_cast<std::size_t>(s)].draw(canvas,
                                             {kSights.x + (s % columns) * (width + 2 * kGap),
                                              kSights.y + (rows - 1 - s / columns) * height, width, height - kGap},
                                             nearest, farthest);
  }
  draw_colour_bar(canvas, {.label = "depth [mm]", .bottom = nearest / kMillimetre, .top = farthest / kMillimetre});
  draw_texts(canvas, {.title = title,
                      .subtitle = subtitle,
                      .caption = "left: the view of the camera; right: the measured depths of the framed part",
                      .foot = "red: skin in view without a measured depth"});
  write_atomically(path, {canvas.file()});
}

namespace {

constexpr const char* kSightPicture = "sight.png";

/// The skin at one time, and what the cameras see of it.
struct Instant {
  TriangleMesh mesh;
  DepthFrame frame;
  Points landmarks;
};

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

void draw_instant(const std::string& path, const SeenScene& seen, const Instant& instant) {
  std::vector<CameraSight> sights;
  for (std::size_t c = 0; c < instant.frame.images.size(); ++c) {
    const Camera& camera = seen.cameras.real()[c].view;
    sights.push_back(
        {fmt::format("{}: {}, {} x {}", seen.cameras.told()[c].name, seen.models[c], camera.width, camera.height),
         camera, instant.frame.images[c].depth});
  }
  draw_sights(path, seen.moving.first().fixed->scene.name, "view of each camera in the first frame", instant.mesh,
              sights);
}

/// The largest depth that 16 bits hold [m].
double farthest_depth(const StereoCamera& camera) { return kMostUnits * camera.depth_unit; }

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
        "the skin less steeply than {:.0f} degrees",
        own.camera, away, camera.nearest() / kMillimetre, farthest_depth(camera) / kMillimetre, kGrazing / kDegree);
  }
  return {};
}

/// The names of all files that it writes.
std::vector<std::string> sight_files(const SeenScene& seen) {
  std::vector<std::string> files = {"see.log", "failed.json", kSightPicture};
  if (!landmark_names(seen).empty()) {
    files.emplace_back(kLandmarksFile);
  }
  const std::vector<std::string> images = recorded_files(seen.cameras.told(), static_cast<std::size_t>(seen.frames));
  files.insert(files.end(), images.begin(), images.end());
  return files;
}

std::vector<SightSummary> see_scene(const SeenScene& seen, RunDirectory& directory, Progress& progress) {
  const std::vector<DepthCamera>& told = seen.cameras.told();
  CameraFolderWriter folder(directory.path(), told);
  std::vector<SightSummary> summaries;
  std::ranges::transform(told, std::back_inserter(summaries),
                         [](const DepthCamera& camera) { return SightSummary{.camera = camera.name}; });
  LandmarkRecording landmarks{.names = landmark_names(seen), .seconds = {}, .at = {}};
  timed(progress, fmt::format("{} images of each of {} cameras", seen.frames, told.size()), [&] {
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
        draw_instant(directory.file(kSightPicture), seen, instant);
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

Job<std::vector<SightSummary>> see_job(const SeenScene& seen) {
  const std::string name = seen.moving.first().fixed->scene.name;
  return {
      .name = name,
      .files = sight_files(seen),
      .compute = [&seen](RunDirectory& directory, Progress& progress) { return see_scene(seen, directory, progress); },
      .value =
          [name, frames = seen.frames](const std::vector<SightSummary>& sights, const std::string& directory) {
            Json cameras = Json::array();
            for (const SightSummary& sight : sights) {
              cameras.push_back(Json{{"camera", sight.camera},
                                     {"pixels", sight.pixels},
                                     {"holes", sight.holes},
                                     {"nearest_mm", sight.nearest / kMillimetre},
                                     {"farthest_mm", sight.farthest / kMillimetre}});
            }
            return Json{{"name", name}, {"directory", directory}, {"frames", frames}, {"cameras", cameras}};
          },
      .makes = "images"};
}

}  // namespace touchfield
