#include "sim/motion/motion_sensor.h"

#include "sim/jobs/play_scene.h"
#include "sim/mesh/remesh/surface_remesh.h"
#include "sim/motion/frame_solver.h"
#include "sim/motion/motion_prediction.h"
#include "sim/motion/play.h"
#include "tests/support/moving_support.h"
#include "tests/support/scene_support.h"
#include "tests/support/testing.h"

namespace touchfield::motion_sensor_test {

const char* const kNoise = "motion.sensor={noise: {noise_mm_rms: 0.3, correlation_mm: 4, seed: 7}}";

Scene noisy_scene(std::vector<std::string> overrides = {}) {
  overrides.insert(overrides.begin(), kNoise);
  return scene_from(kMovingCapsule, overrides);
}

/// How far a sample's vertices are from the true ones, along the mean normals there [m], and the vertices' areas.
Eigen::VectorXd displacements(const Seen& seen, const TriangleMesh& truth) {
  return VertexMeans(truth).normals.cwiseProduct(*seen.state.skin - truth.vertices()).colwise().sum();
}

/// The part of b that drives leave out on a mesh.
double left_out(const Eigen::MatrixXcd& drives, const Model& model, const TriangleMesh& mesh) {
  std::vector<SolveRecord> records;
  Progress silent;
  const SkinScattering place(mesh, model.fixed->wave, model.fixed->scene.solve.scheme, model.fixed->scene.solve.solver,
                             model.fixed->array, records, silent);
  const Eigen::MatrixXcd b = place.system().right_hand_side(place.system().incident(place.array()));
  return (b - b * drives * drives.adjoint()).norm() / b.norm();
}

// An rms over this capsule of the seed's own scatters by a tenth, over 60 samples by 2 %.
TEST(NoisySensor, HasTheNoiseAskedForAndNoneInCommonBetweenSamples) {
  const SensedMotion sensed = sensed_motion(noisy_scene());
  double sum = 0;
  double common = 0;
  Eigen::VectorXd before;
  constexpr int kSamples = 60;
  for (int k = 0; k < kSamples; ++k) {
    const double seconds = 0.005 * k;
    const TriangleMesh truth = sensed.truth->at(sensed.truth->state(seconds)).body.mesh;
    const Seen seen = sensed.sensor->sample(k, seconds);
    EXPECT_FALSE(seen.lost);
    EXPECT_EQ(seen.seconds, seconds);
    const Eigen::VectorXd moved = displacements(seen, truth);
    const Eigen::VectorXd areas = VertexMeans(truth).areas / VertexMeans(truth).areas.sum();
    sum += moved.cwiseAbs2().dot(areas) / kSamples;
    if (k > 0) common += moved.cwiseProduct(before).dot(areas) / (kSamples - 1);
    before = moved;
  }
  EXPECT_NEAR(std::sqrt(sum), 0.3e-3, 0.07 * 0.3e-3);
  EXPECT_LT(std::abs(common), 0.1 * sum);
}

TEST(NoisySensor, GivesTheSameBitsInAnyOrder) {
  const SensedMotion one = sensed_motion(noisy_scene());
  const SensedMotion other = sensed_motion(noisy_scene());
  const Points third = *one.sensor->sample(3, 0.1).state.skin;
  const Points fourth = *one.sensor->sample(4, 0.1).state.skin;
  EXPECT_EQ(*other.sensor->sample(4, 0.1).state.skin, fourth);
  EXPECT_EQ(*other.sensor->sample(3, 0.1).state.skin, third);
  EXPECT_NE(third, fourth);
  const SensedMotion third_is_fourth = sensed_motion(noisy_scene({"motion.sensor.noise.seed=8"}));
  EXPECT_EQ(*third_is_fourth.sensor->sample(3, 0.1).state.skin, fourth);
}

TEST(NoisySensor, SkinBeyondIsSeenWithTheSameNoise) {
  const SensedMotion sensed = sensed_motion(noisy_scene({"body.keep_within_mm=10"}));
  const Seen seen = sensed.sensor->sample(2, 0.1);
  const Model truth = sensed.truth->at(sensed.truth->state(0.1));
  ASSERT_FALSE(truth.beyond.empty());
  const Model model = sensed.solved().at(seen.state);
  EXPECT_EQ(model.beyond.corners, *seen.state.patches);
  const Eigen::VectorXd off = (model.beyond.centres() - truth.beyond.centres()).colwise().norm();
  EXPECT_GT(off.mean(), 0.1e-3);
  EXPECT_LT(off.maxCoeff(), 1.5e-3);
}

TEST(NoisySensor, TheBoxStandsOnTheSkinThatIsSeen) {
  const SensedMotion sensed = sensed_motion(noisy_scene());
  const Seen seen = sensed.sensor->sample(2, 0.1);
  const Model model = sensed.solved().at(seen.state);
  EXPECT_EQ(model.body.mesh.vertices(), *seen.state.skin);
  EXPECT_EQ(model.boxes.front().centre, position(model.body.mesh, find_landmark(model.body, "bottom")));
  const Model truth = sensed.truth->at(sensed.truth->state(0.1));
  EXPECT_GT((model.boxes.front().centre - truth.boxes.front().centre).norm(), 1e-6);
  EXPECT_EQ(model.own_frame.shift, truth.own_frame.shift);
}

TEST(NoisySensor, DrivesOfTheMotionSpanWhatIsSeen) {
  const SensedMotion sensed = sensed_motion(noisy_scene({"array.grid.count=[30, 24]"}));
  const Model& model = sensed.solved().first();
  const Eigen::MatrixXcd drives = drives_of_motion(*sensed.sensor, model.fixed->scene.solve.scheme);
  EXPECT_LT(drives.cols(), drives.rows());
  for (const int k : {0, 3, 5, 8}) {
    const Seen seen = sensed.sensor->sample(100 + k, k / 30.0);  // that it has not been made of
    EXPECT_LT(left_out(drives, model, sensed.solved().at(seen.state).body.mesh), 6e-3) << k;
  }
}

TEST(PlayMotion, NoiseIsPlayedAndRepeats) {
  const Scene scene = noisy_scene({"solve.methods=[surface]", "motion.predict=linear"});
  Progress silent;
  const Motion first = play_motion(sensed_motion(scene), {}, silent);
  const Motion second = play_motion(sensed_motion(scene), {}, silent);
  const Motion exact = play_motion(
      sensed_motion(scene_from(kMovingCapsule, {"solve.methods=[surface]", "motion.predict=linear"})), {}, silent);
  EXPECT_THAT(first.provenance.seeds, HasSubstr("sensor=7"));
  double error = 0;
  double least = 0;
  for (std::size_t f = 0; f < first.methods[0].frames.size(); ++f) {
    EXPECT_EQ(first.methods[0].frames[f].solution.phases, second.methods[0].frames[f].solution.phases);
  }
  for (std::size_t s = 0; s < first.methods[0].scores.size(); ++s) {
    const MotionScore& score = first.methods[0].scores[s];
    const MotionScore& known = exact.methods[0].scores[s];
    EXPECT_EQ(score.frame, known.frame);
    if (score.frame >= 0) {
      EXPECT_EQ(score.age, known.age);
      EXPECT_EQ(score.displacement, known.displacement) << "of the true patch";
    }
    if (score.frame >= 3) {
      error += score.metrics.relative_error;
      least += known.metrics.relative_error;
    }
  }
  EXPECT_GT(error, 1.01 * least) << "evaluated on the true skin";
}

/// Sees another body than the true one, and that not always; notes what is asked of it.
class FakeSensor final : public MotionSensor {
 public:
  explicit FakeSensor(const Scene& scene) : solved_(scene) {}

  const MovingModel& solved() const override { return solved_; }
  void start(Progress&) override { ++started; }
  bool remembers() const override { return true; }
  Seen sample(std::int64_t number, double seconds) override {
    asked.push_back(number);
    Seen seen{taken(number, seconds), solved_.state(0)};
    seen.lost = lost.contains(number);
    if (!seen.lost) {
      seen.state.skin = solved_.first().body.mesh.vertices().colwise() + Vector3(0.05 * seen.seconds, 0, 0);
    }
    return seen;
  }
  std::vector<TriangleMesh> places(int count) const override { return ExactSensor(solved_).places(count); }

  std::set<std::int64_t> lost;
  std::vector<std::int64_t> asked;
  int started = 0;
  std::function<double(std::int64_t, double)> taken = [](std::int64_t, double seconds) { return seconds; };

 private:
  MovingModel solved_;
};

struct Faked {
  SensedMotion sensed;
  FakeSensor* sensor;
};

/// The capsule seen as one of another radius.
Faked faked(const std::vector<std::string>& overrides = {}, double radius_mm = 8) {
  std::vector<std::string> solved = overrides;
  solved.push_back("body.capsule.radius_mm=" + std::to_string(radius_mm));
  solved.emplace_back("motion.change=[]");
  const Scene scene = scene_from(kMovingCapsule, overrides);
  auto sensor = std::make_unique<FakeSensor>(scene_from(kMovingCapsule, solved));
  FakeSensor* fake = sensor.get();
  return {{scene, std::make_unique<const MovingModel>(scene), std::move(sensor)}, fake};
}

TEST(PlayMotion, SolvesWhatIsSeenAndScoresWhatIs) {
  const Faked fake = faked({"solve.methods=[surface]"});
  Progress silent;
  const Motion motion = play_motion(fake.sensed, {}, silent);
  EXPECT_EQ(fake.sensor->started, 1);
  const MovingModel& solved = fake.sensor->solved();
  EXPECT_EQ(motion.mesh.face_count(), solved.first().body.mesh.face_count());
  ASSERT_TRUE(motion.evaluation);
  EXPECT_EQ(motion.evaluation->face_count(), fake.sensed.truth->first().body.mesh.face_count());
  EXPECT_NE(motion.evaluation->face_count(), motion.mesh.face_count());
  const MethodSpec& method = solved.first().fixed->scene.solve.methods.front();
  FrameSolver solver(solved, method, drives_for(*fake.sensor, method));
  for (const MotionFrame& frame : motion.methods.front().frames) {
    MotionState state = solved.state(0);
    state.skin = solved.first().body.mesh.vertices().colwise() + Vector3(0.05 * frame.sampled, 0, 0);
    // Single precision rounds differently by how memory lies, and phases that matter little follow that.
    const double cost = solver.solve(solved.at(state)).solution.cost_history.back();
    EXPECT_NEAR(frame.solution.cost_history.back(), cost, 1e-3 * cost);
  }
  for (const MotionScore& score : motion.methods.front().scores) {
    if (score.frame >= 0) {
      EXPECT_NEAR(score.displacement.x(), 0.05 * score.age, 1e-9) << "of the true patch";
    }
  }
}

class Predicted : public ::testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(All, Predicted, ::testing::Values("linear", "kalman"));

TEST_P(Predicted, LostIsSilent) {
  Faked fake = faked({"motion.predict=" + std::string(GetParam()), "motion.seconds=0.5"});
  fake.sensor->lost = {4, 5, 6, 7};
  Progress silent;
  const Motion motion = play_motion(fake.sensed, {}, silent);
  for (const MotionMethod& method : motion.methods) {
    int lost = 0;
    for (const MotionFrame& frame : method.frames) {
      const auto sample = static_cast<int>(std::lround(30 * frame.sampled));
      EXPECT_EQ(frame.lost, fake.sensor->lost.contains(sample)) << sample;
      EXPECT_EQ(frame.silent, frame.lost);
      EXPECT_EQ(frame.solution.amplitudes.maxCoeff() == 0, frame.lost);
      // No velocity across what is not known.
      EXPECT_EQ(frame.pose_time > frame.sampled, sample > 0 && !frame.lost && sample != 8) << sample;
      lost += frame.lost ? 1 : 0;
    }
    EXPECT_GE(lost, 2);
    for (const MotionScore& score : method.scores) {
      if (score.frame >= 0 && method.frames[static_cast<std::size_t>(score.frame)].lost) {
        EXPECT_EQ(score.metrics.peak_pa, 0.0);
        EXPECT_TRUE(std::isnan(score.displacement.x()));
      }
    }
  }
}

// Frames at half of the samples' rate: a filter knows those between as well.
TEST(PlayMotion, AFilterSeesEverySample) {
  const Faked fake = faked({"motion.predict=kalman", "motion.seconds=0.5", "motion.frames_hz=10", "evaluation=none"});
  Progress silent;
  const Motion motion = play_motion(fake.sensed, {}, silent);
  const MovingModel& solved = fake.sensor->solved();
  MotionPrediction prediction(MotionSpec::Prediction::kKalman, 1 / 30.0);
  for (std::int64_t k = 0; k <= 12; ++k) prediction.see(fake.sensor->sample(k, static_cast<double>(k) / 30));
  const MotionFrame& last = motion.methods.front().frames.back();
  ASSERT_NEAR(last.sampled, 0.4, 1e-6);
  const Model model = solved.at(prediction.at(last.pose_time));
  EXPECT_NEAR((model.boxes.front().centre - solved.first().boxes.front().centre).x(), 0.05 * last.pose_time, 1e-7);
}

TEST(SampleStore, TakesEverySampleOnceAndInOrder) {
  Faked fake = faked();
  SampleStore samples(*fake.sensor, 30);
  EXPECT_NEAR(samples.at(3).seconds, 0.1, 1e-6);
  samples.at(1);
  samples.at(5);
  EXPECT_EQ(fake.sensor->asked, (std::vector<std::int64_t>{0, 1, 2, 3, 4, 5}));
  samples.forget(0.134);
  samples.at(4);
  EXPECT_EQ(fake.sensor->asked.size(), 6U);
  EXPECT_THROW(samples.at(2), std::logic_error);
}

}  // namespace touchfield::motion_sensor_test
