#pragma once

#include <string>
#include <sys/types.h>
#include <unistd.h>
#include <utility>

/// What those share who start processes and speak with them.
namespace touchfield {

/// A file descriptor, closed by its owner.
class Descriptor {
 public:
  explicit Descriptor(int number = -1) : number_(number) {}
  Descriptor(Descriptor&& other) noexcept : number_(std::exchange(other.number_, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    std::swap(number_, other.number_);
    return *this;
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() { close(); }

  int number() const { return number_; }  // -1: none
  void close() {
    if (number_ >= 0) {
      ::close(std::exchange(number_, -1));
    }
  }

 private:
  int number_;
};

/// Two connected sockets, which no program that is started inherits unless it is handed them.
struct SocketPair {
  /// throws   IoError with the system's reason
  SocketPair();

  Descriptor own;
  Descriptor others;
};

/// In a process that was just forked: it is to be killed when its parent ends, and ends at once if that has happened.
void die_with(pid_t parent);

/// Waits for the end of a child and returns its status; -1 if there is no such child.
int wait_for(pid_t child);

/// How a process of this status has ended: "signal 9 (Killed)", "exit code 3"; "an unknown cause" for -1.
std::string end_text(int status);

}  // namespace touchfield
