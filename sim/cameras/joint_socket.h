#pragma once

#include <optional>
#include <string>

#include "sim/cameras/joint_table.h"

namespace touchfield {

/// Tracked joints that a program on this machine sends: datagrams by UDP to 127.0.0.1, each a row as joints_of_row
/// takes it.
class JointSocket {
 public:
  /// port     1 to 65535
  /// pose     from the tracker's frame to the world's
  /// throws   InputError if something else listens there, or it may not be listened to
  JointSocket(int port, const RigidMotion& pose);
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

  /// "UDP port 9000 (motion.sensor.joints.port)", for messages.
  std::string name() const;

 private:
  int port_;
  RigidMotion pose_;
  int socket_ = -1;
  std::optional<JointPoints> joints_;  // of the newest
  std::optional<double> came_;         // when, on the clock of arrival times [s]
};

}  // namespace touchfield
