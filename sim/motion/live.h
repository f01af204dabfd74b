#pragma once

#include <condition_variable>
#include <cstddef>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <thread>
#include <utility>
#include <vector>

#include "sim/core/version.h"
#include "sim/motion/loop_clock.h"
#include "sim/motion/motion_prediction.h"
#include "sim/motion/motion_sensor.h"
#include "sim/run/motion_data.h"
#include "solvers/phase/phase_methods.h"

namespace touchfield {

/// A place for the newest of something, between threads: what is put there replaces what was there, nothing queues.
template <class T>
class LatestSlot {
 public:
  void put(std::shared_ptr<const T> value) {
    const std::lock_guard lock(mutex_);
    value_.swap(value);
  }

  /// Null if there is none.
  std::shared_ptr<const T> newest() const {
    const std::lock_guard lock(mutex_);
    return value_;
  }

  /// The same, and leaves none.
  std::shared_ptr<const T> take() {
    const std::lock_guard lock(mutex_);
    return std::exchange(value_, nullptr);
  }

 private:
  mutable std::mutex mutex_;
  std::shared_ptr<const T> value_;
};

/// The clock of a live loop, one for all its threads.
class LiveTime {
 public:
  LiveTime() = default;
  LiveTime(const LiveTime&) = delete;
  LiveTime& operator=(const LiveTime&) = delete;
  virtual ~LiveTime() = default;

  /// [s] since a moment of its own.
  virtual double now() = 0;
  /// Returns at time t [s], or when it is told to stop.
  virtual void wait_until(double t, const std::stop_token& stop) = 0;
};

/// Seconds of steady_now.
class SteadyTime final : public LiveTime {
 public:
  double now() override { return steady_now(); }
  void wait_until(double t, const std::stop_token& stop) override;
};

/// What a sensor saw last, and what is expected by it and those before. Times are since the loop began.
struct LiveSample {
  Seen now;
  MotionPrediction prediction;
};

/// The skin that a frame was solved for, for somebody who looks on.
struct SolvedSkin {
  Model model;
  Eigen::VectorXcd pressure;  // on the faces of its solving mesh, M [Pa]; empty: not known
  double scale = 1;           // of the wanted pressures of its target
};

/// What a solver found for a sample.
struct LiveSolution {
  MotionFrame frame;                         // whose times are not its
  double residual = 0;                       // the largest that it was ever left with
  std::shared_ptr<const SolvedSkin> skin{};  // null if it is not wanted or the sample is lost
};

/// Takes a sample of this number, rising but for those that are left out, at a time of the motion [s]. What that takes
/// makes the sample known later.
using LiveSensor = std::function<Seen(std::int64_t number, double seconds)>;
/// Finds phases for the pose at `wanted` [s], which is that of the sample or, predicted, later; none for a sample that
/// is lost.
using LiveSolver = std::function<LiveSolution(const LiveSample& sample, double wanted)>;

/// A frame of the loop. Its times are since the loop began; `shown` is when the link had taken it, NaN before.
struct LiveFrame {
  std::size_t number = 0;  // from 0
  double solved = 0;       // when the solver was done
  MotionFrame frame;
  std::shared_ptr<const SolvedSkin> skin{};
  std::int64_t late = 0;  // slots so far, as LoopClock has them
  std::int64_t dropped = 0;
};

/// What a loop did.
struct LiveReport {
  std::vector<MotionFrame> frames;  // by their numbers, without phases
  std::vector<double> solved;       // a frame
  std::vector<double> sensed;       // what each sample took to make [s]
  std::vector<StageSeconds> sensed_stages;
  std::int64_t overtaken = 0;  // samples that were not made, as a newer one was there already
  std::int64_t late = 0;       // as LoopClock has them
  std::int64_t dropped = 0;
  std::int64_t waiting = 0;
  double residual = 0;
};

/// The loop of a sensor and a solver on the wall clock. Each has a thread of its own. One slot is between them and one
/// behind the solver. A slot keeps only the newest item, so nothing queues.
///
/// Slots of frames, samples, and late or dropped frames are those of a LoopClock with measured solve times. The pose is
/// predicted for the instant that LoopClock gives. The time from a frame's solution until the link has it then counts
/// as solving, by its own running median. A solver that throws or never returns ends or hangs its thread alone. The
/// taker of the frames sees `over`, or that no more come.
class LiveLoop {
 public:
  /// motion    with the duration of the loop
  /// prepare   makes the solver, in the thread that will call it; may take its time
  /// recorded  its frames are the samples, each at its own time; null: sensor.hz samples per second. Copied
  /// throws    InputError as LoopClock
  LiveLoop(const MotionSpec& motion, LiveSensor sensor, std::function<LiveSolver()> prepare, LiveTime& time,
           const RecordedTimes* recorded = nullptr);
  /// Waits for the threads, for ever if one hangs: see stop.
  ~LiveLoop() = default;
  LiveLoop(const LiveLoop&) = delete;
  LiveLoop& operator=(const LiveLoop&) = delete;

  /// Waits for the solver to be made, at most so many seconds.
  /// returns   whether it is
  /// throws    what `prepare` threw
  bool ready(double seconds);

  /// The loop begins, at this time of its clock. Once, after ready.
  void begin(double now);
  /// That time.
  double begun() const;

  /// The newest frame, unless it was taken before.
  std::shared_ptr<const LiveFrame> take() { return solved_.take(); }
  /// The same, taken or not; null before the first.
  std::shared_ptr<const LiveFrame> newest() const { return newest_.newest(); }
  /// The newest that has a skin; null before the first.
  std::shared_ptr<const LiveFrame> newest_skin() const { return newest_skin_.newest(); }
  /// The link has taken that frame, at this time of the clock.
  void committed(std::size_t number, double at);
  /// Whether the last frame that the link has taken sounds; false before the first.
  bool sounds() const;

  /// Whether sensor or solver failed, so that there will be no frame any more.
  bool over() const;
  /// Throws what they threw, if so.
  void rethrow() const;

  /// Ends the loop. Waits for both threads, at most so many seconds of the machine's clock.
  /// returns   whether they have ended
  bool stop(double patience);

  /// So far.
  LiveReport report() const;

 private:
  void run(const std::function<void()>& work);
  /// Whether it comes before the motion or the recording is over.
  bool has_sample(std::int64_t number) const;
  Tick sample_time(std::int64_t number) const;
  /// The last sample due by then.
  std::int64_t newest_due(Tick at) const;
  void sense(const std::stop_token& stop);
  void solve(const std::stop_token& stop, const std::function<LiveSolver()>& prepare);
  /// The newest sample, once there is one; null when it is told to stop.
  std::shared_ptr<const LiveSample> newest_sample(const std::stop_token& stop);
  LiveFrame frame_for(const FrameStart& start, const LiveSample& sample, const LoopClock& clock,
                      const LiveSolver& solver);
  void keep(const LiveFrame& frame, const LoopClock& clock);

  MotionSpec motion_;
  LiveSensor sensor_;
  std::optional<RecordedTimes> recorded_;
  LiveTime& time_;
  LatestSlot<LiveSample> sensed_;
  LatestSlot<LiveFrame> solved_;
  LatestSlot<LiveFrame> newest_;  // for those who look on
  LatestSlot<LiveFrame> newest_skin_;

  mutable std::mutex mutex_;  // of what follows
  std::condition_variable_any changed_;
  bool ready_ = false;
  std::optional<double> begun_;
  std::exception_ptr failure_;
  int running_ = 1;  // threads
  LiveReport report_;
  RunningMedian handover_;  // from a solution until the link has it
  bool sounds_ = false;

  std::jthread sensor_thread_;  // the last of all: ends first
  std::jthread solver_thread_;
};

/// The solver of a scene's method: FrameSolver on what the sensor saw, or on what is expected from it.
///
/// Finds before it returns what does not have to be found in every frame, and the first frame (FrameSolver::begin).
///
/// sensor   started; its model has to outlive the solver
/// first    gets that frame and its skin
/// watched  whether the frame's skin is wanted, asked at each frame that has one
/// progress   hears how far it is; may be null
/// throws   NumericalError as FrameSolver
LiveSolver live_solver(
    const MotionSensor& sensor, const MethodSpec& method, LiveSolution& first, Progress* progress = nullptr,
    std::function<bool()> watched = [] { return false; });

}  // namespace touchfield
