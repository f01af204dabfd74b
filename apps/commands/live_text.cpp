#include "apps/commands/live_text.h"

#include <algorithm>
#include <vector>

#include <fmt/format.h>

#include "apps/commands/run_json.h"
#include "sim/core/counted.h"
#include "sim/core/units.h"
#include "sim/store/motion_stages.h"
#include "sim/store/motion_summary.h"
#include "sim/store/text_table.h"

namespace touchfield {

namespace {

using Times = std::vector<double>;  // [s], a frame; NaN where there is none

Times latencies(const LiveReport& report) {
  Times times;
  for (const MotionFrame& frame : report.frames) {
    times.push_back(frame.shown - frame.sampled);
  }
  return times;
}

Times solve_times(const LiveReport& report) {
  Times times;
  for (std::size_t f = 0; f < report.frames.size(); ++f) {
    times.push_back(report.solved[f] - report.frames[f].started);
  }
  return times;
}

Times stage_times(const LiveReport& report, const std::string& stage) {
  Times times;
  for (const MotionFrame& frame : report.frames) {
    times.push_back(stage_seconds(frame, stage));
  }
  return times;
}

std::vector<std::string> row_of(const std::string& name, const Times& times) {
  const Statistics spread = statistics(times);
  std::vector<std::string> row = {name};
  for (const double seconds : {spread.median, spread.p95, spread.worst}) {
    row.push_back(table_number(1e3 * seconds, "{:.1f}"));
  }
  return row;
}

nlohmann::ordered_json spread_json(const Times& times) {
  const Statistics spread = statistics(times);
  return {{"median_s", number_or_null(spread.median)},
          {"p95_s", number_or_null(spread.p95)},
          {"worst_s", number_or_null(spread.worst)}};
}

/// Frames a second.
double rate_of(const LiveResult& result) {
  return static_cast<double>(result.loop.frames.size()) / std::max(result.play.seconds, 1e-9);
}

long quiet_frames(const LiveReport& report) { return std::ranges::count(report.frames, true, &MotionFrame::quiet); }
long lost_frames(const LiveReport& report) { return std::ranges::count(report.frames, true, &MotionFrame::lost); }

}  // namespace

std::string describe_live(const LiveResult& result) {
  const LiveReport& loop = result.loop;
  const std::string text = fmt::format(
      "  loop: {} frames solved in {:.2f} s, {:.1f} per second; {} late, {} slots dropped, {} before a sample; {} "
      "quiet without a target, and {} lost\n"
      "  {} samples sensed, {} overtaken by newer ones\n"
      "  quiet {}, {:.2f} s in all, because data were older than {:g} ms; {} frames arrived that old\n",
      loop.frames.size(), result.play.seconds, rate_of(result), loop.late, loop.dropped, loop.waiting,
      quiet_frames(loop) - lost_frames(loop), lost_frames(loop), loop.sensed.size(), loop.overtaken,
      counted(static_cast<std::int64_t>(result.play.silences), "time", "times"), result.play.silent,
      1e3 * result.motion.stale, result.play.stale);
  std::vector<std::vector<std::string>> rows = {{"ms", "median", "95 %", "worst"},
                                                row_of("sample to link", latencies(loop)),
                                                row_of("sense", loop.sensed),
                                                row_of("solve", solve_times(loop))};
  for (const std::string& stage : stages_of(loop.frames)) {
    rows.push_back(row_of("  " + stage, stage_times(loop, stage)));
  }
  return text + aligned_table(rows);
}

nlohmann::ordered_json live_json(const LiveResult& result) {
  const LiveReport& loop = result.loop;
  nlohmann::ordered_json stages = nlohmann::ordered_json::object();
  for (const std::string& stage : stages_of(loop.frames)) {
    stages[stage] = spread_json(stage_times(loop, stage));
  }
  return {{"frames", loop.frames.size()},
          {"seconds", result.play.seconds},
          {"rate_hz", rate_of(result)},
          {"sent", result.play.sent},
          {"late", loop.late},
          {"dropped", loop.dropped},
          {"waiting", loop.waiting},
          {"quiet_frames", quiet_frames(loop)},
          {"lost_frames", lost_frames(loop)},
          {"stale", result.play.stale},
          {"silences", result.play.silences},
          {"silent_s", result.play.silent},
          {"worst_residual", loop.residual},
          {"samples", loop.sensed.size()},
          {"overtaken", loop.overtaken},
          {"sense", spread_json(loop.sensed)},
          {"latency", spread_json(latencies(loop))},
          {"solve", spread_json(solve_times(loop))},
          {"stages", stages}};
}

std::string live_csv(const LiveReport& report) {
  const std::vector<std::string> stages = stages_of(report.frames);
  std::vector<std::string> header = {"frame",    "sampled_s", "started_s", "late_s", "pose_time_s",
                                     "solved_s", "shown_s",   "quiet",     "lost",   "target_off_mm"};
  for (const std::string& stage : stages) {
    header.push_back(stage + "_s");
  }
  std::string text = csv_line(header);
  for (std::size_t f = 0; f < report.frames.size(); ++f) {
    const MotionFrame& frame = report.frames[f];
    std::vector<std::string> line = {std::to_string(f)};
    for (const double time :
         {frame.sampled, frame.started, frame.late, frame.pose_time, report.solved[f], frame.shown}) {
      line.push_back(csv_number(time));
    }
    line.push_back(frame.quiet ? "1" : "0");
    line.push_back(frame.lost ? "1" : "0");
    line.push_back(csv_number(frame.target_off / kMillimetre));
    for (const std::string& stage : stages) {
      line.push_back(csv_number(stage_seconds(frame, stage)));
    }
    text += csv_line(line);
  }
  return text;
}

}  // namespace touchfield
