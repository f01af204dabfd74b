#pragma once

#include <optional>
#include <string>
#include <vector>

#include "sim/core/child_process.h"

namespace touchfield {

/// A child process that answers each line that it is given by one line. It dies with its parent, however that ends, and
/// does not get the terminal's interrupts.
class WorkerProcess {
 public:
  /// arguments   program and its arguments
  /// log         file that its standard error is appended to
  /// throws      IoError naming the system's reason
  WorkerProcess(std::vector<std::string> arguments, const std::string& log);
  WorkerProcess(const WorkerProcess&) = delete;
  WorkerProcess& operator=(const WorkerProcess&) = delete;
  /// Kills it if it still runs.
  ~WorkerProcess();

  /// The descriptor to wait for with poll(): readable once there is an answer or the process has ended.
  int socket() const { return socket_.number(); }

  /// Sends a line of at most 64 KiB, once the last one is answered. A process that has ended is met when its answer is
  /// read.
  void send(const std::string& line);

  struct Answer {
    std::optional<std::string> line;  // nothing yet if empty and not ended
    bool ended = false;
  };
  /// Reads what is there without waiting; to be called again until there is a line.
  Answer receive();

  /// Waits for the end of a process that has closed its answers, and says how it ended: end_text.
  std::string how_it_ended();

 private:
  Descriptor socket_;
  pid_t pid_ = -1;
  std::string buffer_;  // a part of an answer
};

}  // namespace touchfield
