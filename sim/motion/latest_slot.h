#pragma once

#include <memory>
#include <mutex>
#include <utility>

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

}  // namespace touchfield
