#pragma once

#include <stdexcept>

namespace touchfield {

/// Base of every error a user may see. The message is complete: field, value, rule and place.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// What the user can fix: a scene, a mesh, a command line. Exit code 2.
class InputError : public Error {
 public:
  using Error::Error;
};

/// A computation that has no trustworthy result, e.g. a singular system. Exit code 1.
class NumericalError : public Error {
 public:
  using Error::Error;
};

/// A file that could not be read or written although the input was right. Exit code 1.
class IoError : public Error {
 public:
  using Error::Error;
};

/// A device that is missing, refused, silent or lost. Exit code 4.
class DeviceError : public Error {
 public:
  using Error::Error;
};

/// Something this build was made without. Exit code 3.
class NotBuiltError : public Error {
 public:
  using Error::Error;
};

}  // namespace touchfield
