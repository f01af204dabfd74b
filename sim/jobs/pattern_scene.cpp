#include "sim/jobs/pattern_scene.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "sim/core/units.h"
#include "sim/jobs/felt_result.h"
#include "sim/jobs/motion_pictures.h"
#include "sim/jobs/run_model.h"
#include "sim/model/stages.h"
#include "sim/run/motion_file.h"
#include "sim/run/motion_summary.h"
#include "sim/run/run_text.h"
#include "sim/run/text_table.h"

namespace touchfield {

namespace {

Json frame_row(const Pattern& pattern, std::size_t k) {
  const MotionScore& score = pattern.motion.methods.front().scores[k];
  const PatternFrame& frame = pattern.frames[k];
  Json row = {{"frame", k},
              {"time_s", score.time},
              {"relative_error", score.metrics.relative_error},
              {"relative_error_ring_up", frame.ring_error},
              {"relative_error_alone", frame.alone_error},
              {"mean_inside_pa", score.metrics.mean_inside_pa},
              {"peak_pa", score.metrics.peak_pa},
              {"leakage", score.metrics.leakage},
              {"level", frame.level},
              {"turn_deg", frame.turn / kDegree},
              {"alone_s", frame.alone_seconds}};
  for (const PatternSound& sound : pattern.sounds) {
    const auto at = static_cast<Eigen::Index>(k);
    row["pressure_pa_" + sound.point.name] = sound.pressure(at);
    row["radiation_pa_" + sound.point.name] = sound.radiation(at);
  }
  return row;
}

void write_pattern_tables(const Pattern& pattern, const RunDirectory& directory) {
  Json frames = Json::array();
  for (std::size_t k = 0; k < pattern.frames.size(); ++k) {
    frames.push_back(frame_row(pattern, k));
  }
  write_text_file(directory.file("pattern.csv"), csv_text(frames.front(), frames));
  Json lines = Json::array();
  for (const PatternSound& sound : pattern.sounds) {
    for (const SpectralLine& line : sound.lines) {
      lines.push_back(Json{{"point", sound.point.name},
                           {"hz", line.hz},
                           {"bin_hz", line.width},
                           {"radiation_mean_square_pa2", line.mean_square},
                           {"radiation_rms_pa", std::sqrt(line.mean_square)}});
    }
  }
  const Json columns = {
      {"point", ""}, {"hz", 0.0}, {"bin_hz", 0.0}, {"radiation_mean_square_pa2", 0.0}, {"radiation_rms_pa", 0.0}};
  write_text_file(directory.file("spectrum.csv"), csv_text(columns, lines));
}

/// Mean and worst, as shares.
Json mean_and_worst(const std::vector<double>& values) {
  const Statistics all = statistics(values);
  return {{"mean", all.mean}, {"worst", all.worst}};
}

template <class Of>
std::vector<double> over_frames(const Pattern& pattern, const Of& of) {
  std::vector<double> values;
  for (std::size_t k = 0; k < pattern.frames.size(); ++k) {
    values.push_back(of(pattern.motion.methods.front().scores[k].metrics, pattern.frames[k]));
  }
  return values;
}

/// Mean of the radiation pressure, and its rms in each band.
Json radiation_value(const PatternSound& sound) {
  Json value = {{"point", sound.point.name}, {"mean_pa", sound.radiation.mean()}};
  for (const FrequencyBand& band : kTouchBands) {
    value[fmt::format("rms_{:.0f}-{:.0f}hz_pa", band.low, band.high)] = std::sqrt(mean_square_in(sound.lines, band));
  }
  return value;
}

/// What a command says of a pattern; its warnings and notes people have been told while it ran.
Json pattern_value(const Pattern& pattern, const std::string& directory) {
  const auto error = [](const Metrics& metrics, const PatternFrame&) { return metrics.relative_error; };
  const auto of_radiation = [](const Metrics& metrics, const PatternFrame&) {
    return metrics.relative_error_radiation;
  };
  const auto turn = [](const Metrics&, const PatternFrame& frame) { return frame.turn; };
  const auto mean = [](const Metrics& metrics, const PatternFrame&) { return metrics.mean_inside_pa; };
  const auto ring = [](const Metrics&, const PatternFrame& frame) { return frame.ring_error; };
  const auto above = [](const Metrics& metrics, const PatternFrame& frame) {
    return metrics.relative_error - frame.alone_error;
  };
  const auto alone = [](const Metrics&, const PatternFrame& frame) { return frame.alone_seconds; };
  const auto& timings = pattern.motion.timings;
  const double phases = std::ranges::find(timings, "phases", [](const auto& stage) { return stage.first; })->second;
  const Statistics alone_seconds = statistics(over_frames(pattern, alone));
  Json value = {{"name", pattern.motion.name},
                {"directory", directory},
                {"frames", pattern.clock.frames},
                {"frames_per_second_hz", pattern.clock.rate},
                {"pass_s", pattern.clock.seconds()},
                {"faces", pattern.faces},
                {"skin_outside_rows", pattern.outside_rows},
                {"relative_error", mean_and_worst(over_frames(pattern, error))}};
  if (const auto errors = over_frames(pattern, of_radiation); statistics(errors).count > 0) {
    value["relative_error_radiation_at_instants"] = mean_and_worst(errors);
  }
  if (pattern.frames.front().ring_error > 0) {
    value["relative_error_ring_up"] = mean_and_worst(over_frames(pattern, ring));
  }
  if (alone_seconds.count > 0) {
    value["above_frames_alone"] = mean_and_worst(over_frames(pattern, above));
    value["frames_alone"] = alone_seconds.count;
    value["frame_alone_mean_s"] = alone_seconds.mean;
  }
  value["mean_inside_pa"] = statistics(over_frames(pattern, mean)).mean;
  value["largest_turn_rad"] = statistics(over_frames(pattern, turn)).worst;
  value["phases_of_a_frame_s"] = phases / pattern.clock.frames;
  value["error_by_all_faces_off"] = pattern.reduced_off;
  Json sound_pressure = Json::array();
  Json radiation_pressure = Json::array();
  for (const PatternSound& sound : pattern.sounds) {
    sound_pressure.push_back(Json{{"point", sound.point.name}, {"rms_pa", std::sqrt(sound.mean_square())}});
    radiation_pressure.push_back(radiation_value(sound));
  }
  value["sound_pressure"] = sound_pressure;
  value["radiation_pressure"] = radiation_pressure;
  value["stages_s"] = stage_values(timings);
  value["warnings"] = pattern.motion.warnings;
  value["notes"] = pattern.motion.notes;
  return value;
}

std::string pattern_text(Json value) {
  value.erase("warnings");
  value.erase("notes");
  return lines_text(value);
}

}  // namespace

Job<Pattern> pattern_job(const Model& model, const PatternOptions& options) {
  const Scene& scene = model.fixed->scene;
  std::vector<std::string> files = {"pattern.log", "failed.json", "pattern.csv", "spectrum.csv"};
  if (scene.write.h5) {
    files.emplace_back("pattern.h5");
  }
  if (scene.write.png) {
    files.insert(files.end(), {"report.html", "strip.png"});
  }
  if (scene.felt) {
    std::ranges::copy(felt_files(scene.write), std::back_inserter(files));
  }
  const auto compute = [&model, &scene, options](RunDirectory& directory, Progress& progress) {
    const std::string method(scene.pattern->method->name);
    directory.plan({method});
    Pattern pattern = solve_pattern(model, options, progress);
    write_pattern_tables(pattern, directory);
    add_felt(pattern.motion, scene, directory, progress);
    if (scene.write.h5) {
      timed(progress, pattern.motion.timings, "write", "write pattern.h5",
            [&] { write_motion_file(directory.file("pattern.h5"), pattern.motion); });
    }
    if (scene.write.png) {
      timed(progress, pattern.motion.timings, "pictures", "draw pictures", [&] {
        draw_motion_page(pattern.motion, directory, pattern_text(pattern_value(pattern, directory.name())));
      });
    }
    directory.finished(method);
    return pattern;
  };
  return {scene.name, files, compute, pattern_value,
          [](const Pattern&, const Json& value, bool) { return pattern_text(value); }};
}

}  // namespace touchfield
