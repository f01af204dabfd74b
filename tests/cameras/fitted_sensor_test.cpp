#include "sim/cameras/fitted_sensor.h"

#include <map>
#include <memory>
#include <utility>

#include "sim/cameras/camera_folder.h"
#include "sim/core/units.h"
#include "sim/jobs/play_scene.h"
#include "sim/mesh/query/face_tree.h"
#include "sim/motion/frame_solver.h"
#include "sim/motion/play.h"
#include "tests/support/moving_support.h"
#include "tests/support/scene_support.h"
#include "tests/support/testing.h"

namespace touchfield::fitted_sensor_test {

const std::string kFingerBody =
    "name: seen\n"
    "array: {grid: {count: [12, 10], pitch_mm: 10.16}}\n"
    "body:\n"
    "  hand: {pose: index_up, length_mm: 190}\n"
    "  place: {landmark: index_pad, at_mm: [0, 0, 200]}\n"
    "  edge_mm: {near_target: 2.5, far: 5, within_mm: 8}\n"
    "  keep_within_mm: 35\n"
    "target: {box: {at: index_pad, size_mm: [7, 7, 6]}, pressure_pa: 1500}\n"
    "solve: {methods: [surface], scheme: paper_corrected}\n"
    "evaluation: none\n";
const std::string kCameras =
    "motion:\n"
    "  seconds: 0.2\n"
    "  frames_hz: 10\n"
    "  solve_ms: 20\n"
    "  change: [{path: 'body.place.at_mm[0]', rate: 30}, {path: target.pressure_pa, rate: 100}]\n"
    "  sensor:\n"
    "    cameras:\n"
    "      - {at_mm: [280, -50, 0], look_at_mm: [0, -50, 215], resolution: [424, 240]}\n"
    "      - {at_mm: [-280, -50, 0], look_at_mm: [0, -50, 215], resolution: [424, 240]}\n"
    "      - {at_mm: [0, 270, 0], look_at_mm: [0, -50, 215], resolution: [424, 240]}\n";

TEST(FittedScene, IsTheHandThatIsFittedAndMovesByNothingButItsTarget) {
  const Scene scene = scene_from(kFingerBody + kCameras);
  const Scene solved = fitted_scene(scene);
  const auto& hand = std::get<HandShape>(solved.bodies.front().shape);
  EXPECT_EQ(hand.length, HandShape{}.length);
  EXPECT_EQ(hand.pose, "index_up");
  EXPECT_EQ(solved.bodies.front().keep_within, scene.bodies.front().keep_within);
  EXPECT_EQ(solved.evaluation.kind, EvaluationSpec::Kind::kNone);
  ASSERT_EQ(solved.motion->changes.size(), 1U);
  EXPECT_EQ(solved.motion->changes.front().path, "target.pressure_pa");
  const Scene told = scene_from(kFingerBody + kCameras, {"motion.sensor.hand={pose: flat, length_mm: 170}"});
  EXPECT_EQ(std::get<HandShape>(fitted_scene(told).bodies.front().shape).pose, "flat");
}

TEST(FittedScene, NamesWhatIsNoHand) {
  const std::string camera = "{at_mm: [0, 300, 0], look_at_mm: [0, 0, 80]}";
  const auto fault = [](const std::string& text, const std::vector<std::string>& overrides) {
    return message_of<InputError>([&] { sensed_motion(scene_from(text, overrides)); });
  };
  EXPECT_THAT(
      fault(kMovingCapsule, {"motion.sensor={cameras: [" + camera + "]}"}),
      HasSubstr("motion.sensor.cameras: a hand is fitted, but the scene's body is not a hand; must be body.hand, or "
                "motion.sensor.hand"));
  const std::string two =
      "name: two\narray: {grid: {count: [8, 8]}}\n"
      "bodies:\n"
      "  - {name: left, hand: {}, place: {at_mm: [-90, 0, 180]}, edge_mm: 8}\n"
      "  - {name: right, sphere: {radius_mm: 6}, place: {at_mm: [90, 0, 80]}, edge_mm: 3}\n"
      "target: {box: {centre_mm: [90, 0, 74], size_mm: [5, 5, 4]}, pressure_pa: 1000}\n"
      "solve: {methods: [surface]}\n"
      "motion: {seconds: 0.2, sensor: {cameras: [" +
      camera + "]}}\n";
  EXPECT_THAT(fault(two, {}), HasSubstr("the scene has 2 bodies, must have 1"));
}

/// The same images, each made once.
HandImages remembered(HandImages images) {
  using Made = std::map<std::pair<std::int64_t, double>, DepthFrame>;
  images.at = [at = images.at, made = std::make_shared<Made>()](std::int64_t number, double seconds) {
    const auto place = made->find({number, seconds});
    return place != made->end() ? place->second
                                : made->emplace(std::pair(number, seconds), at(number, seconds)).first->second;
  };
  return images;
}

/// What a test of images needs, made once: it takes some seconds.
class Fitted : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    scene_ = std::make_unique<Scene>(scene_from(kFingerBody + kCameras));
    truth_ = std::make_unique<MovingModel>(*scene_);
    images_ = std::make_unique<HandImages>(remembered(simulated_images(*truth_)));
  }
  static void TearDownTestSuite() {
    images_.reset();
    truth_.reset();
    scene_.reset();
  }

  static std::unique_ptr<Scene> scene_;
  static std::unique_ptr<MovingModel> truth_;
  static std::unique_ptr<HandImages> images_;
  Progress silent_;
};
std::unique_ptr<Scene> Fitted::scene_;
std::unique_ptr<MovingModel> Fitted::truth_;
std::unique_ptr<HandImages> Fitted::images_;

// The pad is seen by three cameras with the noise of a D415; the hand is of another size than the template.
TEST_F(Fitted, TheSkinThatIsSolvedLiesOnTheTrueOne) {
  FittedSensor sensor(*scene_, *images_, truth_.get());
  sensor.start(silent_);
  EXPECT_THAT(sensor.notes(), ElementsAre(HasSubstr("learnt from 6 images of the second from 0 s on")));
  const Model& first = sensor.solved().first();
  const Eigen::MatrixXcd drives = drives_of_motion(sensor, first.fixed->scene.solve.scheme);
  std::vector<SolveRecord> records;
  for (std::int64_t k = 0; k < 6; ++k) {
    const double seconds = static_cast<double>(k) / 30;
    const Seen seen = sensor.sample(k, seconds);
    ASSERT_FALSE(seen.lost) << k;
    EXPECT_EQ(seen.seconds, seconds);
    const Model model = sensor.solved().at(seen.state);
    const Model truth = truth_->at(truth_->state(seconds));
    EXPECT_LT((model.boxes.front().centre - truth.boxes.front().centre).norm(), 2.5 * kMillimetre) << k;
    const FaceTree tree(truth.body.mesh);
    double sum = 0;
    int count = 0;
    for (Eigen::Index f = 0; f < model.body.mesh.face_count(); ++f) {
      const Vector3 x = model.body.mesh.centroids().col(f);
      if ((x - truth.boxes.front().centre).norm() < 12 * kMillimetre) {
        const double distance = tree.nearest(x).distance;
        sum += distance * distance;
        ++count;
      }
    }
    EXPECT_LT(std::sqrt(sum / count), 0.8 * kMillimetre) << k;
    const SkinScattering place(model.body.mesh, model.fixed->wave, first.fixed->scene.solve.scheme,
                               first.fixed->scene.solve.solver, model.fixed->array, records, silent_);
    const Eigen::MatrixXcd b = place.system().right_hand_side(place.system().incident(place.array()));
    EXPECT_LT((b - b * drives * drives.adjoint()).norm(), 6e-3 * b.norm()) << k;
  }
}

TEST_F(Fitted, TheShapeIsLearntWhereTheHandCameIn) {
  HandImages late{images_->cameras,
                  [](std::int64_t number, double seconds) {
                    DepthFrame frame = images_->at(number, std::max(0.0, seconds - 1));
                    frame.seconds = seconds;
                    for (DepthImage& image : frame.images) {
                      if (seconds < 1) {
                        std::ranges::fill(image.depth, 0.0F);
                      }
                    }
                    return frame;
                  },
                  2};
  FittedSensor sensor(scene_from(kFingerBody + kCameras, {"motion.seconds=1.2"}), late, truth_.get());
  sensor.start(silent_);
  EXPECT_THAT(sensor.notes(), ElementsAre(HasSubstr("learnt from 6 images of the second from 1 s on")));
  EXPECT_TRUE(sensor.sample(0, 0).lost);
}

// At times that are not the sensor's, and with a beginning of its own.
TEST_F(Fitted, RecordedImagesArePlayedWithoutScores) {
  const TemporaryDirectory folder;
  {
    CameraFolderWriter writer(folder.file("recorded"), images_->cameras);
    for (int k = 0; k < 5; ++k) {
      DepthFrame frame = images_->at(k, 0.045 * k);
      frame.seconds = 100 + 0.045 * k;
      writer.add(frame);
    }
  }
  const std::string motion_text = "motion: {seconds: 0.17, frames_hz: 20, solve_ms: 1, sensor: {recorded: {folder: '" +
                                  folder.file("recorded") + "'}}}\n";
  const SensedMotion sensed = sensed_motion(scene_from(kFingerBody + motion_text));
  EXPECT_EQ(sensed.truth, nullptr);
  const Motion motion = play_motion(sensed, {}, silent_);
  const MotionMethod& surface = motion.methods.front();
  EXPECT_TRUE(surface.scores.empty());
  EXPECT_THAT(motion.notes, Contains(HasSubstr("nothing is scored")));
  ASSERT_EQ(surface.frames.size(), 4U);
  for (std::size_t f = 0; f < 4; ++f) {
    EXPECT_FALSE(surface.frames[f].lost);
    // Frames start at 0, 50, 100, 150 ms, with samples of 0, 33, 100, 133 ms, whose newest images are:
    EXPECT_NEAR(surface.frames[f].sampled, (std::array{0.0, 0.0, 0.09, 0.09})[f], 1e-6);
  }
  const auto fault = [&](const std::vector<std::string>& overrides) {
    return message_of<InputError>([&] { sensed_motion(scene_from(kFingerBody + motion_text, overrides)); });
  };
  EXPECT_NO_THROW(sensed_motion(scene_from(kFingerBody + motion_text, {"motion.seconds=0.225"})));  // a period more
  EXPECT_THAT(fault({"motion.seconds=0.226"}), HasSubstr("motion.seconds = 0.226 must be <= 0.225"));
  EXPECT_THAT(fault({"motion.change=[{path: 'body.place.at_mm[0]', rate: 30}]"}),
              HasSubstr("motion.change: the images of motion.sensor.recorded determine how the hand moves"));
  EXPECT_THAT(
      fault({"body={sphere: {radius_mm: 8}, edge_mm: 3, place: {at_mm: [0, 0, 80]}}",
             "target.box={centre_mm: [0, 0, 72], size_mm: [5, 5, 5]}"}),
      HasSubstr("motion.sensor.recorded: a hand is fitted, but the scene's body is not a hand; must be body.hand"));
}

}  // namespace touchfield::fitted_sensor_test
