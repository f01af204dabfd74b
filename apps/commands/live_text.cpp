#include "apps/commands/live_text.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <fmt/format.h>

#include "apps/commands/run_json.h"
#include "sim/pictures/picture_parts.h"
#include "sim/store/text_table.h"

namespace touchfield {

namespace {

using Times = std::vector<double>;  // [s], NaN where there is none

struct NamedTimes {
  std::string name;
  Times times;
};

/// Seconds of each frame in each stage, 0 in those that it did without; stages in the order of the frame that has most.
std::vector<NamedTimes> stages_of(const std::vector<LiveFrame>& frames) {
  std::vector<NamedTimes> stages;
  const auto most = std::ranges::max_element(frames, {}, [](const LiveFrame& f) { return f.frame.seconds.size(); });
  if (most != frames.end()) {
    for (const auto& [name, seconds] : most->frame.seconds) {
      stages.push_back({name, Times(frames.size(), 0.0)});
    }
  }
  for (std::size_t f = 0; f < frames.size(); ++f) {
    for (const auto& [name, seconds] : frames[f].frame.seconds) {
      auto stage = std::ranges::find(stages, name, &NamedTimes::name);
      if (stage == stages.end()) {
        stages.push_back({name, Times(frames.size(), 0.0)});
        stage = stages.end() - 1;
      }
      stage->times[f] += seconds;
    }
  }
  return stages;
}

template <class Time>
Times times_of(const std::vector<LiveFrame>& frames, Time time) {
  Times times;
  for (const LiveFrame& frame : frames) {
    times.push_back(time(frame));
  }
  return times;
}

/// What is said of every time: from the sample to the link, and solving.
std::vector<NamedTimes> measured_times(const LiveReport& report) {
  return {{"latency", times_of(report.frames, [](const LiveFrame& f) { return f.frame.shown - f.frame.sampled; })},
          {"solve", times_of(report.frames, [](const LiveFrame& f) { return f.solved - f.frame.started; })}};
}

struct Spread {
  double median;
  double most;  // 95th percentile
  double worst;
};

Spread spread_of(const Times& times) {
  if (std::ranges::none_of(times, [](double t) { return std::isfinite(t); })) {
    return {kNotComputed, kNotComputed, kNotComputed};
  }
  return {quantile(times, 0.5), quantile(times, 0.95), quantile(times, 1)};
}

std::vector<std::string> row_of(const std::string& name, const Times& times) {
  const Spread spread = spread_of(times);
  const auto shown = [](double seconds) { return table_number(1e3 * seconds, "{:.1f}"); };
  return {name, shown(spread.median), shown(spread.most), shown(spread.worst)};
}

nlohmann::ordered_json spread_json(const Times& times) {
  const Spread spread = spread_of(times);
  return {{"median_s", number_or_null(spread.median)},
          {"percentile_95_s", number_or_null(spread.most)},
          {"worst_s", number_or_null(spread.worst)}};
}

/// Frames a second.
double rate_of(const LiveResult& result) {
  return static_cast<double>(result.loop.frames.size()) / std::max(result.play.seconds, 1e-9);
}

long empty_frames(const LiveReport& report) {
  return std::ranges::count_if(report.frames, [](const LiveFrame& frame) { return frame.frame.quiet; });
}

}  // namespace

std::string describe_live(const LiveResult& result) {
  const LiveReport& loop = result.loop;
  std::string text = fmt::format(
      "  loop: {} frames solved in {:.2f} s, {:.1f} a second; {} late, {} dropped, {} of no sample, {} quiet where the "
      "target holds no skin\n"
      "  quiet {} times, {:.2f} s, for what was older than {:g} ms; {} frames came that old\n",
      loop.frames.size(), result.play.seconds, rate_of(result), loop.late, loop.dropped, loop.waiting,
      empty_frames(loop), result.play.silences, result.play.silent, 1e3 * result.motion.stale, result.play.stale);
  std::vector<std::vector<std::string>> rows = {{"ms", "median", "95 %", "worst"}};
  for (const NamedTimes& measured : measured_times(loop)) {
    rows.push_back(row_of(measured.name == "latency" ? "sample to link" : measured.name, measured.times));
  }
  for (const NamedTimes& stage : stages_of(loop.frames)) {
    rows.push_back(row_of("  " + stage.name, stage.times));
  }
  return text + aligned_table(rows);
}

nlohmann::ordered_json live_json(const LiveResult& result) {
  const LiveReport& loop = result.loop;
  nlohmann::ordered_json json = {{"frames", loop.frames.size()},
                                 {"seconds", result.play.seconds},
                                 {"rate_hz", rate_of(result)},
                                 {"sent", result.play.sent},
                                 {"late", loop.late},
                                 {"dropped", loop.dropped},
                                 {"waiting", loop.waiting},
                                 {"empty", empty_frames(loop)},
                                 {"stale", result.play.stale},
                                 {"silences", result.play.silences},
                                 {"silent_s", result.play.silent},
                                 {"worst_residual", loop.residual}};
  for (const NamedTimes& measured : measured_times(loop)) {
    json[measured.name] = spread_json(measured.times);
  }
  json["stages"] = nlohmann::ordered_json::object();
  for (const NamedTimes& stage : stages_of(loop.frames)) {
    json["stages"][stage.name] = spread_json(stage.times);
  }
  return json;
}

std::string live_csv(const LiveReport& report) {
  const std::vector<NamedTimes> stages = stages_of(report.frames);
  std::vector<std::string> header = {"frame",       "sampled_s", "started_s", "late_s",
                                     "pose_time_s", "solved_s",  "shown_s",   "quiet"};
  for (const NamedTimes& stage : stages) {
    header.push_back(stage.name + "_s");
  }
  std::string text = csv_line(header);
  for (std::size_t f = 0; f < report.frames.size(); ++f) {
    const auto& [number, frame, solved] = report.frames[f];
    std::vector<std::string> line = {std::to_string(number)};
    for (const double time : {frame.sampled, frame.started, frame.late, frame.pose_time, solved, frame.shown}) {
      line.push_back(csv_number(time));
    }
    line.push_back(frame.quiet ? "1" : "0");
    for (const NamedTimes& stage : stages) {
      line.push_back(csv_number(stage.times[f]));
    }
    text += csv_line(line);
  }
  return text;
}

}  // namespace touchfield
