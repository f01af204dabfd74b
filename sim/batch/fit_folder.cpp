#include "sim/batch/fit_folder.h"

#include <algorithm>
#include <chrono>
#include <filesystem>

#include <fmt/format.h>

#include "sim/core/atomic_file.h"
#include "sim/core/errors.h"
#include "sim/core/json_text.h"
#include "sim/core/units.h"
#include "sim/scene/quantity.h"
#include "sim/scene/yaml_tree.h"
#include "sim/solve/meshed_body.h"
#include "sim/solve/stages.h"
#include "sim/store/vtk_files.h"
#include "sim/tracking/seen_distance.h"

namespace touchfield {

namespace {

constexpr std::size_t kMostLearnt = 30;  // frames, spread over the time of learning

std::string skin_name(std::size_t frame) { return fmt::format("skin_{:04}.vtp", frame + 1); }

/// Learns from the first part of a recording, so many seconds long, in which the hand is found, at most kMostLearnt frames
/// of it: it may come into the images later.
bool learn(const CameraFolder& folder, double seconds, HandTracker& tracker) {
  for (std::size_t first = 0, end = 0; first < folder.size(); first = end) {
    while (end < folder.size() && (end == first || folder.seconds(end) - folder.seconds(first) < seconds)) {
      ++end;
    }
    const std::size_t step = (end - first + kMostLearnt - 1) / kMostLearnt;
    std::vector<DepthFrame> frames;
    for (std::size_t k = first; k < end; k += step) {
      frames.push_back(folder.frame(k));
    }
    if (tracker.learn(frames)) {
      return true;
    }
  }
  return false;
}

/// Whether the other hand is in the images.
bool finds_other_hand(const CameraFolder& folder, const FolderFit& how) {
  HandShape other = how.hand;
  other.side = other_side(other.side);
  HandTracker tracker(HandTemplate(other, HandTemplate::kUsualEdge), folder.cameras(),
                      Box{how.workspace[0], how.workspace[1]});
  return learn(folder, std::max(how.learning, 1.0), tracker);
}

std::string frames_csv(const std::vector<FittedFrame>& frames) {
  std::string text = "time_s,lost,residual_mm,explained,seen,fit_ms,file\n";
  for (const FittedFrame& frame : frames) {
    const HandFit& fit = frame.fit;
    text += schema::decimal_text(fit.seconds);
    text += fit.lost ? fmt::format(",1,,,,{:.4g},\n", frame.milliseconds)
                     : fmt::format(",0,{:.4g},{:.4g},{:.4g},{:.4g},{}\n", fit.residual / kMillimetre, fit.explained,
                                   fit.seen, frame.milliseconds, frame.file);
  }
  return text;
}

std::string times_csv(const std::vector<SeriesStep>& steps) {
  std::string text = "file,time_s\n";
  for (const SeriesStep& step : steps) {
    text += fmt::format("{},{}\n", step.file, schema::decimal_text(step.time));
  }
  return text;
}

/// The body of a scene that these meshes are.
std::string body_yaml(const std::string& directory, const TriangleMesh& first, const std::vector<Landmark>& landmarks) {
  const std::filesystem::path folder = std::filesystem::absolute(directory);
  std::vector<std::pair<std::string, schema::Node>> places;
  for (const Landmark& landmark : landmarks) {
    const Vector3 at = position(first, landmark);
    std::vector<schema::Node> coordinates;
    for (const double coordinate : at) {
      coordinates.push_back(schema::scalar(fmt::format("{:.6f}", coordinate)));
    }
    places.emplace_back(landmark.name, schema::list(std::move(coordinates)));
  }
  return schema::block_text(schema::map(
      {{"body",
        schema::map(
            {{"meshes", schema::map({{"folder", schema::scalar(bytes_in_characters(folder.string()))},
                                     {"times", schema::scalar(bytes_in_characters((folder / "times.csv").string()))},
                                     {"unit", schema::scalar("m")},
                                     {"landmarks", schema::map(std::move(places))}})}})}}));
}

}  // namespace

std::vector<std::string> fit_files(const CameraFolder& folder) {
  std::vector<std::string> files = {"fit.log", "failed.json", "fit.csv", "body.yaml", "times.csv", "skin.pvd"};
  for (std::size_t k = 0; k < folder.size(); ++k) {
    files.push_back(skin_name(k));
  }
  return files;
}

FittedFolder fit_folder(const CameraFolder& folder, const FolderFit& how, RunDirectory& directory, Progress& progress) {
  const HandTemplate hand(how.hand, HandTemplate::kUsualEdge);
  const Body body = touchfield::hand(hand_options(how.hand, how.edge));
  const HandTemplate::Carrier carrier = hand.carrier(body.mesh.vertices());
  HandTracker tracker(hand, folder.cameras(), Box{how.workspace[0], how.workspace[1]});
  FittedFolder fitted;
  std::vector<std::pair<std::string, double>> seconds;
  if (how.learning > 0) {
    fitted.learnt =
        timed(progress, seconds, "learn", "the hand's shape", [&] { return learn(folder, how.learning, tracker); });
    if (!fitted.learnt) {
      progress.warn(fmt::format(
          "shape: within no {:g} s the hand was found in three frames, so that its shape is the built-in hand's",
          how.learning));
    }
  }
  fitted.proportions = tracker.shape().proportions;
  tracker.forget();
  std::vector<SeriesStep> steps;
  timed(progress, seconds, "fit", fmt::format("{} frames", folder.size()), [&] {
    Points world;
    for (std::size_t k = 0; k < folder.size(); ++k) {
      const DepthFrame frame = folder.frame(k);
      const auto begin = std::chrono::steady_clock::now();
      FittedFrame& own = fitted.frames.emplace_back();
      own.fit = tracker.track(frame);
      own.milliseconds = 1e3 * std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
      if (!own.fit.lost) {
        tracker.skin(own.fit, carrier, world);
        const TriangleMesh skin(world, body.mesh.triangles());
        const SeenDistance seen = seen_distance(folder.cameras(), frame, skin);
        own.file = skin_name(k);
        write_faces_vtp(directory.file(own.file), skin,
                        {{"cameras", seen.cameras.cast<double>()}, {"distance_m", seen.distance}});
        steps.push_back({own.fit.seconds - folder.seconds(0), own.file});
        if (steps.size() == 1) {
          write_atomically(directory.file("body.yaml"), {body_yaml(directory.path(), skin, body.landmarks)});
        }
      }
      progress.advance((static_cast<double>(k) + 1) / static_cast<double>(folder.size()));
    }
  });
  write_atomically(directory.file("fit.csv"), {frames_csv(fitted.frames)});
  if (steps.empty()) {
    const char* side = how.hand.side == HandSide::kRight ? "left" : "right";
    throw InputError(fmt::format("the hand was found in none of {} frames; {}", folder.size(),
                                 finds_other_hand(folder, how)
                                     ? fmt::format("the images show a {0} hand: give --side {0}", side)
                                     : "is it in the workspace, and are the cameras' places theirs?"));
  }
  write_atomically(directory.file("times.csv"), {times_csv(steps)});
  write_series(directory.file("skin.pvd"), steps);
  return fitted;
}

}  // namespace touchfield
