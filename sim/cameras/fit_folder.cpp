#include "sim/cameras/fit_folder.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <filesystem>
#include <optional>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "sim/cameras/hand_tables.h"
#include "sim/cameras/seen_skin.h"
#include "sim/core/errors.h"
#include "sim/core/files.h"
#include "sim/core/text.h"
#include "sim/core/units.h"
#include "sim/core/version.h"
#include "sim/mesh/io/mesh_files.h"
#include "sim/model/meshed_body.h"
#include "sim/model/stages.h"
#include "sim/run/motion_summary.h"
#include "sim/run/vtk_files.h"
#include "sim/scene/quantity.h"
#include "sim/scene/yaml_tree.h"

namespace touchfield {

namespace {

constexpr std::size_t kMostLearnt = 30;  // frames, spread over the time of learning

std::string skin_name(std::size_t frame) { return fmt::format("skin_{:04}.ply", frame + 1); }

/// Learns from the first part of a recording, so many seconds long, in which the hand is found, at most kMostLearnt
/// frames of it: it may come into the images later.
bool learn(const CameraFolder& folder, double seconds, HandTracker& tracker, Progress& progress) {
  for (std::size_t first = 0, end = 0; first < folder.size(); first = end) {
    while (end < folder.size() && (end == first || folder.seconds(end) - folder.seconds(first) < seconds)) {
      ++end;
    }
    const std::size_t step = (end - first + kMostLearnt - 1) / kMostLearnt;
    const auto frame = [&, first](std::size_t k) {
      const std::size_t number = first + k * step;
      progress.advance(static_cast<double>(number) / static_cast<double>(folder.size()));
      return folder.frame(number);
    };
    if (tracker.learn((end - first + step - 1) / step, frame)) {
      return true;
    }
  }
  return false;
}

/// A built-in hand that a recording may show, and how well it fits.
struct Candidate {
  HandShape hand;
  std::optional<HandTracker> tracker{};  // once it is tried: its template takes a second
  double worth = 0;                      // of some frames together
};

bool fits(Candidate& candidate, const CameraFolder& folder, const DepthFrame& frame, const Box& workspace) {
  if (!candidate.tracker) {
    candidate.tracker.emplace(HandTemplate(candidate.hand, HandTemplate::kUsualEdge), folder.cameras(), workspace);
  }
  candidate.tracker->forget();
  const HandFit fit = candidate.tracker->track(frame);
  candidate.worth += fit.lost ? 0.0 : fit.worth();
  return !fit.lost;
}

bool sides_are_close(const std::deque<Candidate>& sides) {
  constexpr double kClear = 0.9;  // of the worth of the best: what comes closer is not told from it
  const auto [least, most] = std::ranges::minmax_element(sides, {}, &Candidate::worth);
  return sides.size() > 1 && least->worth > kClear * most->worth;
}

/// Fits each side to some frames, spread over the recording, until one shows a hand whose side is clear, or enough show
/// one. Returns the frames. To several cameras a hand of the other side is lost, which takes long to find out: one that
/// they find has the right side. In a single image the side may be a guess.
std::vector<DepthFrame> compare(const CameraFolder& folder, const Box& workspace, std::deque<Candidate>& sides) {
  constexpr std::size_t kMostFrames = 5;
  constexpr int kEnough = 4;
  std::vector<DepthFrame> tried;
  const std::size_t step = (folder.size() + kMostFrames - 1) / kMostFrames;
  int found = 0;
  for (std::size_t k = 0; k < folder.size() && found < kEnough; k += step) {
    tried.push_back(folder.frame(k));
    bool any = false;
    for (Candidate& side : sides) {
      if (!any || folder.cameras().size() == 1) {
        any = fits(side, folder, tried.back(), workspace) || any;
      }
    }
    found += any ? 1 : 0;
    if (found > 0 && !sides_are_close(sides)) {
      break;
    }
  }
  return tried;
}

/// The hand whose pose and side fit best, of those that may be chosen; a warning where the other side fits nearly as
/// well. The side is that of the flat hand, whose joints are all free; then its poses are compared.
HandShape nearest_hand(const CameraFolder& folder, const FolderFit& how, std::optional<std::string>& warning) {
  const Box workspace{how.workspace[0], how.workspace[1]};
  std::deque<Candidate> sides;  // trackers cannot be moved
  for (const HandSide side :
       how.any_side ? std::vector{HandSide::kRight, HandSide::kLeft} : std::vector{how.hand.side}) {
    HandShape& hand = sides.emplace_back().hand = how.hand;
    hand.pose = how.any_pose ? "flat" : how.hand.pose;
    hand.side = side;
  }
  const std::vector<DepthFrame> tried = compare(folder, workspace, sides);
  const Candidate& best = *std::ranges::max_element(sides, {}, &Candidate::worth);
  if (sides_are_close(sides)) {
    warning = fmt::format("side: the images fit a {} hand nearly as well as the {} hand that is used; give --side",
                          side_name(other_side(best.hand.side)), side_name(best.hand.side));
  }
  Candidate pointing{best.hand};
  pointing.hand.pose = "index_up";
  if (how.any_pose) {
    for (const DepthFrame& frame : tried) {
      fits(pointing, folder, frame, workspace);
    }
  }
  return pointing.worth > best.worth ? pointing.hand : best.hand;
}

bool finds_other_hand(const CameraFolder& folder, const FolderFit& how) {
  std::deque<Candidate> other(1);
  other.front().hand = how.hand;
  other.front().hand.side = other_side(how.hand.side);
  compare(folder, Box{how.workspace[0], how.workspace[1]}, other);
  return other.front().worth > 0;
}

std::string frames_csv(const std::vector<FittedFrame>& frames) {
  std::string text =
      "time_s,lost,probability,residual_mm,explained,share,evidence,seen,misfit,digits_off,oddity,landmark_off_mm,"
      "fit_ms,file,reason\n";
  for (const FittedFrame& frame : frames) {
    const HandFit& fit = frame.fit;
    text += fmt::format("{},{:d},", schema::decimal_text(fit.seconds), fit.lost);
    text += fit.placed ? fmt::format("{:.4g},{:.4g},{:.4g},{:.4g},{:.4g},{:.4g},{:.4g},{},{:.4g}", fit.probability,
                                     fit.residual / kMillimetre, fit.explained, fit.share, fit.evidence, fit.seen,
                                     fit.misfit, fit.digits_off, fit.oddity)
                       : ",,,,,,,,";
    text += std::isfinite(frame.landmark_off) ? fmt::format(",{:.4g}", frame.landmark_off / kMillimetre) : ",";
    text += fmt::format(",{:.4g},{},{}\n", frame.milliseconds, frame.file, lost_text(fit));
  }
  return text;
}

/// What a camera saw in all frames so far.
struct CameraUse {
  std::size_t frames = 0;         // with any depth
  std::size_t with_hand = 0;      // of these, in which the hand was found
  std::size_t confirming = 0;     // of these, in which it saw the skin
  std::size_t in_workspace = 0;   // of those in which the hand was lost, with points where it is looked for
  std::vector<double> on_skin{};  // share of its points near the hand that lie on the skin, each frame with the hand
  std::vector<double> depths{};   // median of each frame with any depth [m]
};

/// The median of the depths in an image, of some of its pixels [m]; 0 if it saw nothing.
double median_depth(const DepthImage& image) {
  constexpr std::size_t kEvery = 61;  // pixels: no divisor of usual widths
  std::vector<float> depths;
  for (std::size_t pixel = 0; pixel < image.depth.size(); pixel += kEvery) {
    if (image.depth[pixel] > 0) {
      depths.push_back(image.depth[pixel]);
    }
  }
  if (depths.empty()) {
    return 0;
  }
  const auto middle = depths.begin() + static_cast<std::ptrdiff_t>(depths.size() / 2);
  std::ranges::nth_element(depths, middle);
  return static_cast<double>(*middle);
}

void add_use(const DepthFrame& frame, const HandFit& fit, std::vector<CameraUse>& uses) {
  constexpr int kLeastConfirmed = 20;  // vertices: some agree by chance
  for (std::size_t c = 0; c < uses.size(); ++c) {
    const double depth = median_depth(frame.images[c]);
    if (depth == 0) {
      continue;
    }
    CameraUse& use = uses[c];
    ++use.frames;
    use.depths.push_back(depth);
    use.in_workspace += fit.lost && fit.points[c] > 0 ? 1 : 0;
    if (!fit.lost) {
      ++use.with_hand;
      use.confirming += fit.confirmed[c] >= kLeastConfirmed ? 1 : 0;
      if (std::isfinite(fit.explained_by[c])) {
        use.on_skin.push_back(fit.explained_by[c]);
      }
    }
  }
}

/// Cameras that see something and not the skin where the fit has it.
std::vector<std::string> cameras_apart(const std::vector<DepthCamera>& cameras, const std::vector<CameraUse>& uses) {
  constexpr double kFew = 0.1;      // of the frames
  constexpr double kOnSkin = 0.85;  // of the points
  std::vector<std::string> warnings;
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    const CameraUse& use = uses[c];
    if (use.with_hand > 0 && static_cast<double>(use.confirming) < kFew * static_cast<double>(use.with_hand)) {
      warnings.push_back(fmt::format(
          "cameras: in {1} of {2} frames {0} sees something, but no skin at the place of the fitted hand; correct its "
          "pose in cameras.yaml (translation_mm, the rotation from camera to world), or leave it out",
          cameras[c].name, use.with_hand - use.confirming, use.with_hand));
    } else if (const double share = statistics(use.on_skin).median; cameras.size() > 1 && share < kOnSkin) {
      warnings.push_back(
          fmt::format("cameras: of the points that {} sees near the hand, {:.0f} % lie on the fitted skin (median); "
                      "where cameras agree it is {:.0f} % or more. Correct its pose in cameras.yaml, or leave it out",
                      cameras[c].name, 100 * share, 100 * kOnSkin));
    }
  }
  return warnings;
}

/// A residual above what the noise of the points and the model explain.
std::optional<std::string> residual_warning(const std::vector<FittedFrame>& frames, std::size_t cameras) {
  constexpr double kModel = 0.4e-3;  // of a hand that is not the template [m]
  constexpr double kMost = 1.5;      // times both
  std::vector<double> residuals;
  std::vector<double> noises;
  for (const FittedFrame& frame : frames) {
    if (!frame.fit.lost) {
      residuals.push_back(frame.fit.residual);
      noises.push_back(frame.fit.noise);
    }
  }
  const double residual = statistics(residuals).median;
  const double noise = statistics(noises).median;
  if (!(residual > kMost * std::hypot(kModel, noise))) {
    return {};
  }
  return fmt::format(
      "residual: points lie {:.2f} mm rms off the fitted skin, and a depth camera's noise explains {:.2f} mm. Check {}"
      "depth_unit_mm and the distance from the cameras",
      residual / kMillimetre, noise / kMillimetre, cameras > 1 ? "the cameras' places, " : "");
}

/// Why the hand is in no frame, and what to try.
std::string nothing_found(const std::vector<DepthCamera>& cameras, const std::vector<CameraUse>& uses,
                          const std::vector<FittedFrame>& frames, const FolderFit& how) {
  const auto reached = [](const FittedFrame& frame) { return frame.fit.placed ? 1 + frame.fit.probability : 0.0; };
  const auto nearest = std::ranges::max_element(frames, {}, reached);
  std::string text = fmt::format("the hand was not found in any of {} frames; the closest was that at {} s: {}",
                                 frames.size(), schema::decimal_text(nearest->fit.seconds), lost_text(nearest->fit));
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    const CameraUse& use = uses[c];
    if (use.frames == 0) {
      text += fmt::format("\n  {}: nothing seen in any frame", cameras[c].name);
      continue;
    }
    const auto [least, most] = std::ranges::minmax(use.depths);
    text +=
        fmt::format("\n  {}: it sees points {:.0f} to {:.0f} mm away (medians), in the workspace in {} of {} frames",
                    cameras[c].name, least / kMillimetre, most / kMillimetre, use.in_workspace, use.frames);
  }
  text += fmt::format(
      "\n  If they are not in the workspace, {} to {}: set --workspace-mm, or correct depth_unit_mm and pose.\n  If "
      "they are: --side, --pose and --length-mm describe the hand. A pose in cameras.yaml may be wrong (from camera to "
      "world), or images mirrored.",
      place_text(how.workspace[0], 0), place_text(how.workspace[1], 0));
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
      {{"body", schema::map({{"meshes", schema::map({{"folder", schema::scalar(folder.string())},
                                                     {"times", schema::scalar((folder / "times.csv").string())},
                                                     {"unit", schema::scalar("m")},
                                                     {"landmarks", schema::map(std::move(places))}})}})}}));
}

/// The names of all files that it writes.
std::vector<std::string> fit_files(const CameraFolder& folder) {
  std::vector<std::string> files = {"fit.log", "failed.json", "fit.csv", "body.yaml", "times.csv", kLandmarksFile};
  for (std::size_t k = 0; k < folder.size(); ++k) {
    files.push_back(skin_name(k));
  }
  return files;
}

/// The frames of a recording one by one, with the tables of those until now.
class FolderFitter {
 public:
  FolderFitter(const CameraFolder& folder, const FolderFit& how, RunDirectory& directory)
      : folder_(folder),
        how_(how),
        directory_(directory),
        hand_(how.hand, HandTemplate::kUsualEdge),
        body_(touchfield::hand(hand_options(how.hand, how.edge))),
        carrier_(hand_.carrier(body_.mesh.vertices())),
        tracker_(hand_, folder.cameras(), Box{how.workspace[0], how.workspace[1]}),
        uses_(folder.cameras().size()),
        truth_(folder.landmarks()) {
    std::ranges::transform(body_.landmarks, std::back_inserter(fitted_landmarks_.names), &Landmark::name);
  }

  FittedFolder fitted(Progress& progress) {
    const auto warn = [&](const std::string& warning) {
      fitted_.warnings.push_back(warning);
      progress.warn(warning);
    };
    std::ranges::for_each(folder_.warnings(), warn);
    if (how_.learning > 0) {
      fitted_.learnt =
          timed(progress, "the hand's shape", [&] { return learn(folder_, how_.learning, tracker_, progress); });
      if (!fitted_.learnt) {
        warn(
            fmt::format("shape: in no period of {:g} s was the hand found in three frames, so its shape is that of the "
                        "built-in hand; a longer --learn-s uses more frames",
                        how_.learning));
      }
    }
    fitted_.proportions = tracker_.shape().proportions;
    tracker_.forget();
    timed(progress, fmt::format("{} frames", folder_.size()), [&] {
      try {
        fit_all(progress);
      } catch (...) {
        write_tables();
        throw;
      }
    });
    write_tables();
    if (steps_.empty()) {
      throw InputError(
          !how_.any_side && finds_other_hand(folder_, how_)
              ? fmt::format("the hand was not found in any of {0} frames; the images show a {1} hand: give --side {1}",
                            folder_.size(), side_name(other_side(how_.hand.side)))
              : nothing_found(folder_.cameras(), uses_, fitted_.frames, how_));
    }
    std::ranges::for_each(cameras_apart(folder_.cameras(), uses_), warn);
    if (const auto warning = residual_warning(fitted_.frames, folder_.cameras().size())) {
      warn(*warning);
    }
    return std::move(fitted_);
  }

 private:
  void fit_all(Progress& progress) {
    constexpr std::size_t kTableEvery = 100;  // frames
    for (std::size_t k = 0; k < folder_.size(); ++k) {
      const DepthFrame frame = folder_.frame(k);
      const double begin = steady_now();
      FittedFrame& own = fitted_.frames.emplace_back();
      own.fit = tracker_.track(frame);
      own.milliseconds = 1e3 * (steady_now() - begin);
      add_use(frame, own.fit, uses_);
      if (!own.fit.lost) {
        write_skin(frame, own, skin_name(k));
      }
      own.fit.deformation.resize(3, 0);  // of ten thousand frames it would be a gigabyte
      own.fit.seen_vertex.resize(0);
      if ((k + 1) % kTableEvery == 0) {
        write_tables();
      }
      progress.advance((static_cast<double>(k) + 1) / static_cast<double>(folder_.size()));
    }
  }

  void write_skin(const DepthFrame& frame, FittedFrame& own, const std::string& file) {
    Points world;
    tracker_.skin(own.fit, carrier_, world);
    const TriangleMesh skin(world, body_.mesh.triangles());
    const SeenDistance seen = seen_distance(folder_.cameras(), frame, skin);
    write_atomically(directory_.file(file),
                     {as_ply(skin, 1.0, {{"cameras", seen.cameras.cast<double>()}, {"distance_m", seen.distance}})});
    own.file = file;
    fitted_landmarks_.seconds.push_back(own.fit.seconds);
    fitted_landmarks_.at.push_back(landmark_points(skin, body_.landmarks, fitted_landmarks_.names));
    own.landmark_off = landmark_off(own.fit.seconds, landmark_points(skin, body_.landmarks, truth_.names));
    steps_.push_back({own.fit.seconds - folder_.seconds(0), file});
    if (steps_.size() == 1) {
      write_atomically(directory_.file("body.yaml"), {body_yaml(directory_.name(), skin, body_.landmarks)});
    }
  }

  /// How far the farthest of the points whose places the recording says is from where the fit has it [m].
  double landmark_off(double seconds, const Points& fitted) const {
    double farthest = kNotComputed;
    if (const std::optional<Points> known = truth_.between(seconds)) {
      for (const double off : (fitted - *known).colwise().norm()) {
        farthest = std::isfinite(off) ? std::fmax(farthest, off) : farthest;
      }
    }
    return farthest;
  }

  void write_tables() const {
    write_atomically(directory_.file("fit.csv"), {frames_csv(fitted_.frames)});
    if (!steps_.empty()) {
      write_atomically(directory_.file("times.csv"), {times_csv(steps_)});
      write_atomically(directory_.file(kLandmarksFile), {landmarks_csv(fitted_landmarks_)});
    }
  }

  const CameraFolder& folder_;
  const FolderFit& how_;
  RunDirectory& directory_;
  HandTemplate hand_;
  Body body_;
  HandTemplate::Carrier carrier_;
  HandTracker tracker_;
  std::vector<CameraUse> uses_;
  std::vector<SeriesStep> steps_;
  LandmarkRecording truth_;  // what the recording says of the hand; empty as a rule
  LandmarkRecording fitted_landmarks_;
  FittedFolder fitted_;
};

FittedFolder fit_folder(const CameraFolder& folder, const FolderFit& how, RunDirectory& directory, Progress& progress) {
  FolderFit own = how;
  std::optional<std::string> warning;
  if (how.any_pose || how.any_side) {
    own.hand =
        timed(progress, "find the pose and side that fit best", [&] { return nearest_hand(folder, how, warning); });
    progress.note(fmt::format("  pose {}, {} hand", own.hand.pose, side_name(own.hand.side)));
  }
  FittedFolder fitted = FolderFitter(folder, own, directory).fitted(progress);
  fitted.hand = own.hand;
  if (warning) {
    progress.warn(*warning);
    fitted.warnings.push_back(*warning);
  }
  return fitted;
}

Json fit_value(const FittedFolder& fitted, const std::string& directory) {
  std::vector<double> residuals;
  std::vector<double> seen;
  std::vector<double> times;
  for (const FittedFrame& frame : fitted.frames) {
    times.push_back(frame.milliseconds);
    if (!frame.fit.lost) {
      residuals.push_back(frame.fit.residual / kMillimetre);
      seen.push_back(frame.fit.seen);
    }
  }
  return {{"directory", directory},
          {"frames", fitted.frames.size()},
          {"lost", fitted.frames.size() - residuals.size()},
          {"pose", fitted.hand.pose},
          {"side", side_name(fitted.hand.side)},
          {"shape_learnt", fitted.learnt},
          {"length_ratio", std::exp(fitted.proportions(kLengthRatio))},
          {"breadth_ratio", std::exp(fitted.proportions(kBreadthRatio))},
          {"residual_mm_median", statistics(residuals).median},
          {"seen_median", statistics(seen).median},
          {"fit_ms_p95", statistics(times).p95},
          {"warnings", fitted.warnings}};
}

}  // namespace

Job<FittedFolder> fit_job(const CameraFolder& folder, const FolderFit& how) {
  return {.name = "fit",
          .files = fit_files(folder),
          .compute = [&folder, how](RunDirectory& directory,
                                    Progress& progress) { return fit_folder(folder, how, directory, progress); },
          .value = fit_value,
          .makes = "meshes"};
}

}  // namespace touchfield
