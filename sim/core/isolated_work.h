#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

namespace touchfield {

/// What a piece of work may take in a process of its own.
struct WorkLimits {
  std::uint64_t memory = 0;  // [bytes] on top of what this process has
  std::uint64_t output = 0;  // [bytes]
  int seconds = 0;           // of processor time; five times as many may pass on the clock
};

/// What the work has handed over. `bytes` are valid while a copy of `owner` lives.
struct WorkOutput {
  std::shared_ptr<const void> owner;
  std::string_view bytes;
};

using Emit = std::function<void(std::string_view)>;

/// Does work on untrusted data in a copy of this process. A crash, an endless loop or excessive use of memory ends
/// there. Only bytes come back from it, which the caller must check in turn. Threads do not exist in the copy, so the
/// work must not use OpenMP or BLAS. Anything that it prints is lost.
///
/// subject  of the sentence that says which limit was met or how the copy ended: "x.h5: is damaged: reading it"
/// work     calls its argument with what it has found, piece by piece
/// returns  the pieces as one
/// throws   InputError with the message of an exception that left the work, or with that sentence; IoError if no
///          process can be started; std::bad_alloc if it lacked memory by a limit of this process's own
WorkOutput isolated(const std::string& subject, const WorkLimits& limits, const std::function<void(const Emit&)>& work);

}  // namespace touchfield
