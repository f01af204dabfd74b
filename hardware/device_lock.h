#pragma once

#include <string>

#include "sim/core/child_process.h"

namespace touchfield {

/// Keeps a device to one process of this machine, until the object or the process ends, however that ends.
///
/// It is the name of a socket, which the system gives once in a network namespace: it needs no file and no permission,
/// and holds between users. A program in another network namespace (a container) counts as one on another machine.
class DeviceLock {
 public:
  /// Holds nothing.
  DeviceLock() = default;
  /// key      the same for everyone who means this device, at most 90 bytes
  /// device   for the message
  /// throws   DeviceError "DEVICE: busy: process 1234 drives it, ..."
  DeviceLock(const std::string& key, const std::string& device);

 private:
  Descriptor socket_;
};

}  // namespace touchfield
