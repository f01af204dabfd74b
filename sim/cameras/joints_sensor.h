#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "sim/cameras/hand_tables.h"
#include "sim/cameras/joints_hand.h"

namespace touchfield {

/// Sees the hand that is fitted to recorded joints of a hand tracker (JointsHand). It never knows the true one. Its
/// bones are learnt from the first second in which the tracker had a hand, and its frames fitted, before the clock
/// starts.
class JointsSensor final : public MotionSensor {
 public:
  /// path       of the file, for messages
  /// throws     InputError as JointsHand, and where the file has no hand
  JointsSensor(const Scene& scene, const JointRecording& recording, const std::string& path,
               KeptBodies* kept = nullptr);

  const MovingModel& solved() const override { return hand_.solved(); }
  const RecordedTimes* recording() const override { return &times_; }
  /// The newest frame at that time.
  Seen sample(std::int64_t number, double seconds) override;
  std::vector<TriangleMesh> places(int count) const override;
  std::vector<std::string> notes() const override { return notes_; }
  std::vector<std::string> warnings() const override { return misplaced_.warnings(); }

 private:
  std::vector<JointPoints> first_second() const;
  void fit_motion(double seconds, double hz, const std::string& path);

  JointsHand hand_;
  RecordedTimes times_;
  std::vector<std::optional<JointPoints>> joints_;
  std::vector<std::optional<JointsHand::Frame>> frames_;  // those that samples are taken of
  MisplacedHands misplaced_;
  std::vector<std::string> notes_;
};

/// Tracked joints that a program sends: datagrams by UDP, each a row as joints_of_row takes it.
class JointSocket {
 public:
  /// pose     from the tracker's frame to the world's
  /// throws   InputError if something else listens there, or it may not be listened to
  JointSocket(const ListenAddress& address, const RigidMotion& pose);
  ~JointSocket();
  JointSocket(const JointSocket&) = delete;
  JointSocket& operator=(const JointSocket&) = delete;

  struct Received {
    std::optional<JointPoints> joints;  // in the world's frame; none where the tracker had no hand
    double age = 0;                     // since the datagram came [s]
  };

  /// The oldest datagram that has not been taken; waits at most so many seconds for one.
  ///
  /// returns   none if none came
  /// throws    InputError where it is no row of joints; IoError
  std::optional<Received> next(double patience);
  /// The newest that has come, of whatever age; none if none ever did. Those that are no rows of joints count as no
  /// hand.
  std::optional<Received> newest();

  /// "UDP 127.0.0.1:9000 (motion.sensor.joints.listen)", for messages.
  std::string name() const;
  const ListenAddress& address() const { return address_; }

 private:
  ListenAddress address_;
  RigidMotion pose_;
  int socket_ = -1;
  std::optional<JointPoints> joints_;  // of the newest
  std::optional<double> came_;         // when, on the clock of arrival times [s]
};

/// Sees the hand that is fitted to joints which a hand tracker sends while the motion plays (JointsHand, JointSocket).
class LiveJointsSensor final : public MotionSensor {
 public:
  static constexpr double kPatience = 60;
  static constexpr double kSilence = 0.2;  // of the tracker, after which the hand is lost [s]

  /// throws   InputError as JointsHand and JointSocket
  /// patience   for a hand before the clock starts [s]
  LiveJointsSensor(const Scene& scene, const ListenAddress& address, const RigidMotion& pose,
                   KeptBodies* kept = nullptr, double patience = kPatience);

  const MovingModel& solved() const override { return hand_.solved(); }
  /// Learns the bones from the first second in which the tracker has a hand.
  ///
  /// throws    InputError as JointsHand::learn, where a datagram is no row of joints, and where no hand comes in
  ///           the time of patience, or none in a place that makes sense
  void start(Progress& progress) override;
  std::vector<std::string> notes() const override { return notes_; }
  /// Of an address that others reach; and of samples whose place makes no sense, which are lost.
  std::vector<std::string> warnings() const override;
  /// The newest frame, whose time is this less the age of its datagram.
  Seen sample(std::int64_t number, double seconds) override;
  /// Those while the bones were learnt.
  std::vector<TriangleMesh> places(int count) const override { return hand_.places(learnt_, count); }

 private:
  /// What to do where nothing came.
  std::string silence_advice() const;

  JointsHand hand_;
  JointSocket socket_;
  double patience_;
  std::vector<JointsHand::Frame> learnt_;
  MisplacedHands misplaced_;
  std::vector<std::string> notes_;
};

}  // namespace touchfield
