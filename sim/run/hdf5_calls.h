#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "sim/core/errors.h"

/// What writing and reading of HDF5 files share.
namespace touchfield::hdf5 {

using Shape = std::vector<std::uint64_t>;  // slowest index first, as HDF5 counts

/// An HDF5 identifier; closed by its owner.
class Handle {
 public:
  using Close = int (*)(std::int64_t);

  Handle(std::int64_t id, Close close) : id_(id), close_(close) {}
  Handle(Handle&& other) noexcept : id_(std::exchange(other.id_, -1)), close_(other.close_) {}
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
  Handle& operator=(Handle&&) = delete;
  ~Handle();

  std::int64_t id() const { return id_; }

 private:
  std::int64_t id_;
  Close close_;
};

/// The most detailed of the errors that the library has noted.
std::string reason();

template <class Failure>
[[noreturn]] void fail(const std::string& place, std::string_view what) {
  throw Failure(place + ": " + std::string(what));
}

/// The result of a library call, or its error: "PLACE: WHAT (REASON)".
template <class Failure = IoError, class Result>
Result checked(Result result, const std::string& place, std::string_view what) {
  if (result < 0) {
    fail<Failure>(place, std::string(what) + " (" + reason() + ")");
  }
  return result;
}

template <class Failure = IoError>
Handle checked_handle(std::int64_t id, Handle::Close close, const std::string& place, std::string_view what) {
  return {checked<Failure>(id, place, what), close};
}

/// "a/b", or what messages call an attribute.
std::string joined(const std::string& place, const std::string& name);
std::string attribute_place(const std::string& place, const std::string& name);

/// The type in memory of texts of variable length, as pointers, and of elements T; Complex as {r, i}.
Handle text_type();
template <class T>
Handle element_type();

std::uint64_t bytes_of(const Shape& shape, std::uint64_t element);

}  // namespace touchfield::hdf5
