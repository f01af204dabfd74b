#include "sim/cameras/joints_sensor.h"

#include <chrono>
#include <netdb.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <thread>
#include <unistd.h>

#include <fmt/format.h>

#include "sim/core/units.h"
#include "sim/hand/hand_pose.h"
#include "sim/jobs/play_scene.h"
#include "sim/motion/play.h"
#include "tests/support/joint_table_support.h"
#include "tests/support/scene_support.h"
#include "tests/support/testing.h"

namespace touchfield::joints_sensor_test {

using Frames = std::vector<std::optional<JointPoints>>;

constexpr double kPeriod = 0.02;  // of the table [s]

const std::string kFinger =
    "name: joints\n"
    "array: {grid: {count: [12, 10], pitch_mm: 10.16}}\n"
    "body:\n"
    "  hand: {pose: index_up, length_mm: 180, breadth_mm: 84}\n"
    "  place: {landmark: index_pad, at_mm: [0, 0, 200], rotate_deg: [10, 0, 20]}\n"
    "  edge_mm: {near_target: 2.5, far: 5, within_mm: 8}\n"
    "  keep_within_mm: 35\n"
    "target: {box: {at: index_pad, size_mm: [7, 7, 6]}, pressure_pa: 1500}\n"
    "solve: {methods: [surface], scheme: paper_corrected}\n"
    "evaluation: none\n";
const std::string kMoving =
    "motion: {seconds: 0.2, frames_hz: 10, solve_ms: 20, score_hz: 11, "
    "change: [{path: 'body.place.at_mm[0]', rate: 30}]}\n";

/// A hand that moves as the scene says, whose joints are tracked exactly.
class Tracked : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    scene_ = std::make_unique<Scene>(scene_from(kFinger + kMoving));
    kept_ = std::make_unique<KeptBodies>();
    truth_ = std::make_unique<MovingModel>(*scene_, kept_.get());
  }
  static void TearDownTestSuite() {
    truth_.reset();
    kept_.reset();
    scene_.reset();
  }

  /// The true joints of the whole motion, for the table's times.
  static Frames frames(HandSide side = HandSide::kRight) {
    const auto& hand = std::get<HandShape>(scene_->bodies.front().shape);
    const JointPoints own =
        joints_of(posed_skeleton(hand_pose(hand.pose), hand.length, hand.breadth), mirror_sign(side));
    Frames result;
    for (int k = 0; k < 11; ++k) {
      const RigidMotion to_own = truth_->at(truth_->state(kPeriod * k)).own_frame;
      result.emplace_back(to_own.rotation.transpose() * (own.colwise() - to_own.shift));
    }
    return result;
  }
  std::string file(const Frames& joints) const {
    return folder_.write("hand.csv", joint_table_text(joints, kPeriod, 1e9));
  }
  std::unique_ptr<JointsSensor> sensor(const Frames& joints, const std::vector<std::string>& overrides = {}) const {
    std::vector<std::string> all{"motion.sensor={joints: {file: '" + file(joints) + "'}}", "motion.change=[]"};
    all.insert(all.end(), overrides.begin(), overrides.end());
    SensedMotion sensed = sensed_motion(scene_from(kFinger + kMoving, all), kept_.get());
    EXPECT_EQ(sensed.truth, nullptr);
    return std::unique_ptr<JointsSensor>(dynamic_cast<JointsSensor*>(sensed.sensor.release()));
  }

  static std::unique_ptr<Scene> scene_;
  static std::unique_ptr<KeptBodies> kept_;  // of all these scenes, meshed once
  static std::unique_ptr<MovingModel> truth_;
  TemporaryDirectory folder_;
  Progress silent_;
};
std::unique_ptr<Scene> Tracked::scene_;
std::unique_ptr<KeptBodies> Tracked::kept_;
std::unique_ptr<MovingModel> Tracked::truth_;

// The hand is learnt to 1e-6, its pose to the prior's 0.1 mm; the template's vertices are those of the true mesh.
TEST_F(Tracked, TheSkinIsTheTrueOne) {
  const auto seen_by = sensor(frames());
  EXPECT_THAT(seen_by->notes(), Contains(HasSubstr("learnt from 11 frames")));
  EXPECT_THAT(seen_by->notes(), Not(Contains(HasSubstr("lost"))));
  for (int k = 0; k < 6; ++k) {
    const Seen seen = seen_by->sample(k, k / 30.0);
    ASSERT_FALSE(seen.lost) << k;
    EXPECT_NEAR(seen.seconds, kPeriod * std::floor(k / 30.0 / kPeriod + 1e-9), 1e-6);
    const Points truth = truth_->at(truth_->state(seen.seconds)).body.mesh.vertices();
    EXPECT_LT((*seen.state.skin - truth).colwise().norm().maxCoeff(), 0.25 * kMillimetre) << k;
  }
  EXPECT_EQ(seen_by->places(3).size(), 3U);
}

TEST_F(Tracked, FramesAreLostAndSaidWhy) {
  Frames joints = frames();
  joints[2].reset();
  for (std::size_t k = 7; k < joints.size(); ++k) {  // the index finger's last joints far off
    joints[k]->col(6) += Vector3(0, 0, 0.03);
    joints[k]->col(7) -= Vector3(0, 0, 0.03);
  }
  const auto seen_by = sensor(joints, {"motion.sensor.hz=50"});
  for (int k = 0; k < 11; ++k) EXPECT_EQ(seen_by->sample(k, kPeriod * k).lost, k == 2 || k >= 7) << k;
  EXPECT_THAT(seen_by->notes(), Contains(HasSubstr("lost: of 11 frames 1 have no hand; 4 are more than 6 mm rms off")));
  EXPECT_THAT(message_of<InputError>([&] { sensor(Frames(11)); }), HasSubstr("hand.csv: no frame has a hand"));
}

TEST_F(Tracked, TheOtherHandAndAnotherUnitAreRefused) {
  const auto fault = [&](const Frames& joints, const std::vector<std::string>& overrides = {}) {
    return message_of<InputError>([&] { sensor(joints, overrides); });
  };
  EXPECT_THAT(fault(frames(HandSide::kLeft)),
              AllOf(HasSubstr("hand.csv: the joints are the mirror image of a right hand ("),
                    HasSubstr("If it is a right hand, two axes are exchanged or one is reversed"),
                    HasSubstr("If it is a left hand, the hand that is fitted must have side: left")));
  EXPECT_FALSE(sensor(frames(HandSide::kLeft), {"motion.sensor.hand={pose: index_up, side: left}"})->sample(0, 0).lost);
  Frames large = frames();
  for (auto& joints : large) *joints *= 10;
  EXPECT_THAT(fault(large),
              HasSubstr("mm long from the wrist to the middle fingertip, must be 90 to 270: lengths are in m; "
                        "another unit ends the names of a file's columns, as index_tip_x_mm"));
  EXPECT_THAT(fault(frames(), {"motion.seconds=0.23"}), HasSubstr("motion.seconds = 0.23 must be <= 0.22"));
  EXPECT_THAT(fault(frames(), {"motion.change=[{path: 'body.place.at_mm[0]', rate: 30}]"}),
              HasSubstr("motion.change: the joints of motion.sensor.joints determine how the hand moves"));
}

// Where there is no hand that an array can press on, nothing sounds, and the place is said.
TEST_F(Tracked, PlacesThatMakeNoSenseAreSaid) {
  const auto turn = [](double degrees) {
    return Eigen::AngleAxisd(degrees * kDegree, Vector3::UnitX()).toRotationMatrix();
  };
  JointsHand hand(scene_from(kFinger + kMoving, {"motion.sensor={joints: {listen: 9000}}", "motion.change=[]"}),
                  kept_.get());
  const JointPoints there = *frames().front();
  hand.learn({there}, "hand.csv");
  const std::vector<std::pair<RigidMotion, const char*>> cases = {
      {{turn(90), Vector3::Zero()}, "behind the array, which radiates away from"},       // y is down
      {{turn(-90), Vector3(0, 0, -0.1)}, "behind the array, which radiates away from"},  // y is up
      {{turn(180), Vector3::Zero()}, "behind the array, which radiates away from 20 of"},
      {{turn(0), Vector3(0, 0, -0.5)}, "behind the array, which radiates away from"},  // another origin
      {{turn(0), Vector3(0, 0.1, -0.2)}, "in the array, about transducer"},            // the origin is in the hand
      {{turn(0), Vector3(0, 0.02, -0.19)}, "in the array, about transducer"},
      {{turn(0), Vector3(0, 0, 0.9)}, "m away from the array, must be within 0.70 m"},
      {{turn(0), Vector3(-1, 0, 0)}, "m away from the array, must be within 0.70 m"}};
  for (const auto& [by, says] : cases) {
    const JointsHand::Frame frame = hand.fitted(by(Points(there)));
    EXPECT_EQ(frame.fault, JointsHand::Fault::kPlace) << says;
    EXPECT_THAT(frame.place, AllOf(HasSubstr("the tracked hand is "), HasSubstr(says), HasSubstr("its wrist is at ("),
                                   HasSubstr("motion.sensor.joints.pose")));
    EXPECT_TRUE(hand.seen(0, frame).lost);
  }
  for (const Vector3& shift :
       {Vector3(0, 0, 0), Vector3(0.1, -0.1, 0.4), Vector3(0, 0, -0.1), Vector3(0, -0.15, -0.05)}) {
    EXPECT_EQ(hand.fitted(there.colwise() + shift).fault, JointsHand::Fault::kNone) << shift.transpose();
  }
}

TEST(ListenAddresses, AreAPortOrAnAddressAndAPort) {
  const auto read = [](const std::string& text) {
    const auto address = listen_address(text);
    return address ? address->text() : "";
  };
  EXPECT_EQ(read("9000"), "127.0.0.1:9000");
  EXPECT_EQ(read("0.0.0.0:9000"), "0.0.0.0:9000");
  EXPECT_EQ(read("[::1]:1"), "[::1]:1");
  EXPECT_EQ(read("[0:0:0:0:0:0:0:1]:65535"), "[::1]:65535");
  EXPECT_EQ(read("[::]:9000"), "[::]:9000");
  for (const char* text :
       {"", "0", "65536", "-1", "9e3", "::1:9000", "::1", "[127.0.0.1]:9000", "localhost:9000", ":9000", "127.0.0.1",
        "127.0.0.1:", "[::1]", "[::1]:", "[]:9000", "256.0.0.1:9000", "1.1.1.1:80:80"}) {
    EXPECT_EQ(read(text), "") << text;
  }
  for (const char* text : {"127.0.0.1:1", "127.8.8.8:1", "[::1]:1", "1"}) {
    EXPECT_TRUE(listen_address(text)->is_loopback()) << text;
  }
  for (const char* text : {"0.0.0.0:1", "[::]:1", "192.168.0.7:1", "[fe80::1]:1"}) {
    EXPECT_FALSE(listen_address(text)->is_loopback()) << text;
  }
}

/// A tracker's program: sends a row to a port of this machine, again and again, until it ends.
class Sender {
 public:
  Sender(int port, std::string row, const char* host = "127.0.0.1")
      : thread_([port, host, text = std::move(row)](const std::stop_token& stop) {
          while (!stop.stop_requested()) {
            send(port, text, host);
            std::this_thread::sleep_for(std::chrono::milliseconds(10));
          }
        }) {}

  static void send(int port, const std::string& text, const char* host = "127.0.0.1") {
    addrinfo wanted{};
    wanted.ai_socktype = SOCK_DGRAM;
    addrinfo* to = nullptr;
    ASSERT_EQ(::getaddrinfo(host, std::to_string(port).c_str(), &wanted, &to), 0);
    const int socket = ::socket(to->ai_family, SOCK_DGRAM, 0);
    ::sendto(socket, text.data(), text.size(), 0, to->ai_addr, to->ai_addrlen);
    ::close(socket);
    ::freeaddrinfo(to);
  }
  static sockaddr_in address(int port) {
    sockaddr_in own{};
    own.sin_family = AF_INET;
    own.sin_port = htons(static_cast<std::uint16_t>(port));
    own.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    return own;
  }
  static int free_port() {
    const int socket = ::socket(AF_INET, SOCK_DGRAM, 0);
    sockaddr_in own = address(0);
    socklen_t size = sizeof own;
    ::bind(socket, reinterpret_cast<const sockaddr*>(&own), size);
    ::getsockname(socket, reinterpret_cast<sockaddr*>(&own), &size);
    ::close(socket);
    return ntohs(own.sin_port);
  }

 private:
  std::jthread thread_;
};

// What a tracker sends while it plays: the hand is where it was when the datagram came, and lost when none comes.
TEST_F(Tracked, JointsThatComeByAPortAreSeenAndTheirSilenceIsALostHand) {
  const int port = Sender::free_port();
  const Scene scene = scene_from(kFinger + kMoving,
                                 {fmt::format("motion.sensor={{joints: {{listen: {}}}}}", port), "motion.change=[]"});
  EXPECT_THAT(
      message_of<InputError>([&] { sensed_motion(scene, kept_.get()); }),
      HasSubstr(fmt::format("motion.sensor.joints.listen = 127.0.0.1:{}: joints come by a port only while", port)));
  const SensedMotion sensed = sensed_motion(scene, kept_.get(), nullptr, MotionClock::kWall);
  EXPECT_THAT(message_of<InputError>([&] { sensed_motion(scene, kept_.get(), nullptr, MotionClock::kWall); }),
              HasSubstr("cannot be listened to: Address already in use; choose another port"));
  {
    const Sender tracker(port, joint_row_text(*frames().front()));
    sensed.sensor->start(silent_);
    EXPECT_THAT(sensed.sensor->notes(), Contains(HasSubstr("the lengths of the hand's bones were learnt from")));
    const Seen seen = sensed.sensor->sample(0, 5);
    ASSERT_FALSE(seen.lost);
    EXPECT_LE(seen.seconds, 5);
    EXPECT_GT(seen.seconds, 5 - LiveJointsSensor::kSilence);
    const Points truth = truth_->at(truth_->state(0)).body.mesh.vertices();
    EXPECT_LT((*seen.state.skin - truth).colwise().norm().maxCoeff(), 0.25 * kMillimetre);
    EXPECT_EQ(sensed.sensor->places(2).size(), 2U);
  }
  EXPECT_FALSE(sensed.sensor->sample(1, 5.1).lost);
  std::this_thread::sleep_for(std::chrono::duration<double>(1.5 * LiveJointsSensor::kSilence));
  EXPECT_TRUE(sensed.sensor->sample(2, 5.3).lost);
  Sender::send(port, joint_row_text(*frames().front()));
  EXPECT_FALSE(sensed.sensor->sample(3, 5.4).lost);
  Sender::send(port, "1,2,3");
  EXPECT_TRUE(sensed.sensor->sample(4, 5.5).lost);
  Sender::send(port, "1,2,3");
  EXPECT_THAT(
      message_of<InputError>([&] { sensed.sensor->start(silent_); }),
      HasSubstr(fmt::format(
          "UDP 127.0.0.1:{} (motion.sensor.joints.listen): a datagram is not a row of joints: 3 values, must be 79",
          port)));
}

// The loop does not press on a hand that is in the array or behind it.
TEST_F(Tracked, LiveHandsInPlacesThatMakeNoSenseAreLost) {
  const int port = Sender::free_port();
  const Scene scene = scene_from(kFinger + kMoving,
                                 {fmt::format("motion.sensor={{joints: {{listen: {}}}}}", port), "motion.change=[]"});
  const SensedMotion sensed = sensed_motion(scene, kept_.get(), nullptr, MotionClock::kWall);
  const JointPoints there = *frames().front();
  const JointPoints behind = there.colwise() - Vector3(0, 0, 0.5);
  {
    const Sender tracker(port, joint_row_text(there));
    sensed.sensor->start(silent_);
  }
  for (int k = 0; k < 4; ++k) {
    Sender::send(port, joint_row_text(k % 2 == 0 ? there : behind));
    const Seen seen = sensed.sensor->sample(k, k);
    EXPECT_EQ(seen.lost, k % 2 == 1);
    EXPECT_NEAR(seen.joints.front().z(), (k % 2 == 0 ? there : behind)(2, 0), 1e-6);
  }
  EXPECT_THAT(sensed.sensor->warnings(), ElementsAre(HasSubstr("misplaced: 2 of 4 samples count as lost, and nothing "
                                                               "sounds: at 1.00 s the tracked hand is behind")));
  const Sender tracker(port, joint_row_text(behind));
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  sensed.sensor->sample(4, 4);  // the rows from before
  EXPECT_THAT(message_of<InputError>([&] { sensed.sensor->start(silent_); }),
              HasSubstr(fmt::format("UDP 127.0.0.1:{} (motion.sensor.joints.listen): at 0.00 s the tracked hand is "
                                    "behind the array",
                                    port)));
}

TEST_F(Tracked, OtherAddressesAreListenedToAndThoseThatOthersReachAreSaid) {
  const std::string row = joint_row_text(*frames().front());
  for (const auto& [host, to] : {std::pair("127.0.0.1", "127.0.0.1"), std::pair("::1", "::1"),
                                 std::pair("0.0.0.0", "127.0.0.1"), std::pair("::", "127.0.0.1")}) {
    const int port = Sender::free_port();
    JointSocket socket({host, port}, {});
    Sender::send(port, row, to);
    const auto heard = socket.next(1);
    EXPECT_TRUE(heard && heard->joints) << host;
  }
  EXPECT_THAT(message_of<InputError>([&] {
                JointSocket({"198.51.100.1", 9000}, {});
              }),
              HasSubstr("give an address of this machine, or 0.0.0.0 for all of them"));
  const auto listening = [](const std::string& host, int port) {
    const Scene scene =
        scene_from(kFinger + kMoving,
                   {fmt::format("motion.sensor={{joints: {{listen: '{}:{}'}}}}", host, port), "motion.change=[]"});
    const auto& address = std::get<ListenAddress>(std::get<JointsSpec>(scene.motion->sensor.sight).from);
    return std::make_unique<LiveJointsSensor>(scene, address, RigidMotion(), kept_.get(), 0.2);
  };
  const int port = Sender::free_port();
  const auto open = listening("0.0.0.0", port);
  EXPECT_THAT(
      message_of<InputError>([&] { open->start(silent_); }),
      AllOf(StartsWith(fmt::format("UDP 0.0.0.0:{} (motion.sensor.joints.listen): nothing came within 0.2 s; let "
                                   "the tracker's program send to this port of this machine",
                                   port)),
            Not(HasSubstr("Only programs"))));
  Sender::send(port, joint_row_text(JointPoints::Zero()));
  EXPECT_THAT(message_of<InputError>([&] { open->start(silent_); }), HasSubstr("1 rows came, none with a hand"));
  EXPECT_THAT(open->warnings(), ElementsAre(StartsWith("open_port: whoever reaches UDP 0.0.0.0:")));
  const auto closed = listening("[::1]", port);
  EXPECT_THAT(message_of<InputError>([&] { closed->start(silent_); }),
              HasSubstr(fmt::format("Only programs of this machine reach ::1: for a tracker elsewhere listen on the "
                                    "network, as \"0.0.0.0:{}\"",
                                    port)));
  EXPECT_THAT(closed->warnings(), IsEmpty());
}

// Fingers that are one skin in index_up cannot open.
TEST_F(Tracked, FingersThatTheTemplateHoldsTogetherAreLostWhereTheyOpen) {
  Frames joints;
  const auto& hand = std::get<HandShape>(scene_->bodies.front().shape);
  const JointPoints own = joints_of(posed_skeleton(hand_pose("flat"), hand.length, hand.breadth), -1);
  for (int k = 0; k < 11; ++k) joints.emplace_back(own.colwise() + Vector3(0, 0, 0.2));
  const auto folded = sensor(joints);
  EXPECT_TRUE(folded->sample(0, 0).lost);
  EXPECT_THAT(folded->notes(), Contains(HasSubstr("7 move fingers that touch in the pose index_up")));
  EXPECT_FALSE(sensor(joints, {"motion.sensor.hand={pose: flat}"})->sample(0, 0).lost);
}

TEST_F(Tracked, TheTrackersFrameIsPlacedInTheWorld) {
  Frames joints = frames();
  for (auto& one : joints) {
    *one = one->colwise() - Vector3(0.5, 0.1, 0);
    *one = (Eigen::AngleAxisd(-90 * kDegree, Vector3::UnitX()).toRotationMatrix() * *one).eval();
  }
  const auto seen_by = sensor(joints, {"motion.sensor.joints.pose={rotation: [[1, 0, 0], [0, 0, -1], [0, 1, 0]], "
                                       "translation_mm: [500, 100, 0]}"});
  const Points truth = truth_->first().body.mesh.vertices();
  EXPECT_LT((*seen_by->sample(0, 0).state.skin - truth).colwise().norm().maxCoeff(), 0.25 * kMillimetre);
  EXPECT_THAT(message_of<InputError>([&] {
                sensor(joints, {"motion.sensor.joints.pose={rotation: [[1, 0, 0], [0, 1, 0], [0, 0, -1]], "
                                "translation_mm: [0, 0, 0]}"});
              }),
              HasSubstr("a reflection, must be a rotation: the columns are the tracker's x, y and z in the world"));
}

}  // namespace touchfield::joints_sensor_test
