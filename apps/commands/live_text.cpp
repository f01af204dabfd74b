#include "apps/commands/live_text.h"

#include <algorithm>
#include <iterator>
#include <vector>

#include "sim/core/units.h"
#include "sim/run/motion_summary.h"
#include "sim/run/text_table.h"

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

/// From the phases of a frame until the link had taken it.
Times send_times(const LiveReport& report) {
  Times times;
  for (std::size_t f = 0; f < report.frames.size(); ++f) {
    times.push_back(report.frames[f].shown - report.solved[f]);
  }
  return times;
}

Json spread(const Times& times) {
  const Statistics over_frames = statistics(times);
  return {{"median_s", over_frames.median}, {"p95_s", over_frames.p95}, {"worst_s", over_frames.worst}};
}

/// The spread of each stage.
Json stage_spreads(const std::vector<StageSeconds>& stages) {
  Json spreads = Json::object();
  for (const std::string& name : stages_of(stages)) {
    Times times;
    for (const StageSeconds& seconds : stages) {
      times.push_back(stage_seconds(seconds, name));
    }
    spreads[name] = spread(times);
  }
  return spreads;
}

/// Frames that a newer one, or the end, overtook before the link took them.
std::size_t unsent_frames(const LiveResult& result) {
  return result.loop.frames.size() - result.play.sent - result.play.stale;
}

/// Frames a second.
double rate_of(const LiveResult& result) {
  return static_cast<double>(result.loop.frames.size()) / std::max(result.play.seconds, 1e-9);
}

long silent_frames(const LiveReport& report) { return std::ranges::count(report.frames, true, &MotionFrame::silent); }
long lost_frames(const LiveReport& report) { return std::ranges::count(report.frames, true, &MotionFrame::lost); }

}  // namespace

Json live_value(const LiveResult& result) {
  const LiveReport& loop = result.loop;
  std::vector<StageSeconds> solve_stages;
  std::ranges::transform(loop.frames, std::back_inserter(solve_stages), &MotionFrame::seconds);
  return {{"frames", loop.frames.size()},
          {"seconds", result.play.seconds},
          {"rate_hz", rate_of(result)},
          {"sent", result.play.sent},
          {"late", loop.late},
          {"dropped", loop.dropped},
          {"waiting", loop.waiting},
          {"silent_frames", silent_frames(loop)},
          {"lost_frames", lost_frames(loop)},
          {"stale", result.play.stale},
          {"unsent", unsent_frames(result)},
          {"stale_after_s", result.motion.stale},
          {"silences", result.play.silences},
          {"silent_s", result.play.silent},
          {"worst_residual", loop.residual},
          {"samples", loop.sensed.size()},
          {"overtaken", loop.overtaken},
          {"sense", spread(loop.sensed)},
          {"sense_stages", stage_spreads(loop.sensed_stages)},
          {"latency", spread(latencies(loop))},
          {"solve", spread(solve_times(loop))},
          {"stages", stage_spreads(solve_stages)},
          {"send", spread(send_times(loop))}};
}

std::string live_csv(const LiveReport& report, const SentChecksums& sent) {
  const std::vector<std::string> stages = stages_of(report.frames);
  const auto row_of = [&](std::size_t number, const MotionFrame& frame, double solved) {
    Json row = {{"frame", number},
                {"sampled_s", frame.sampled},
                {"started_s", frame.started},
                {"late_s", frame.late},
                {"pose_time_s", frame.pose_time},
                {"solved_s", solved},
                {"shown_s", frame.shown},
                {"silent", frame.silent},
                {"lost", frame.lost},
                {"target_off_mm", frame.target_off / kMillimetre},
                {"sent_crc32", sent.contains(number) ? sent.at(number) : ""}};
    for (const std::string& stage : stages) {
      row[stage + "_s"] = stage_seconds(frame, stage);
    }
    return row;
  };
  Json rows = Json::array();
  for (std::size_t f = 0; f < report.frames.size(); ++f) {
    rows.push_back(row_of(f, report.frames[f], report.solved[f]));
  }
  return csv_text(row_of(0, {}, 0), rows);
}

}  // namespace touchfield
