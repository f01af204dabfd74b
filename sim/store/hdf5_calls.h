#pragma once

#include <cstdint>
#include <string>
#include <string_view>

/// What the writer and the reader share: calls of the C library whose failures are IoErrors.
namespace touchfield::hdf5 {

/// An HDF5 identifier; closed by its owner.
class Handle {
 public:
  using Close = int (*)(std::int64_t);

  Handle(std::int64_t id, Close close) : id_(id), close_(close) {}
  Handle(Handle&& other) noexcept : id_(other.id_), close_(other.close_) { other.id_ = -1; }
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
  Handle& operator=(Handle&&) = delete;
  ~Handle();

  std::int64_t id() const { return id_; }

 private:
  std::int64_t id_;
  Close close_;
};

/// throws   IoError "PLACE: WHAT"
[[noreturn]] void fail(const std::string& place, std::string_view what);

/// throws   IoError "PLACE: WHAT (REASON)" with the most detailed of the errors that the library has noted
[[noreturn]] void fail_with_reason(const std::string& place, std::string_view what);

/// The result of a library call, or its error.
template <class Result>
Result checked(Result result, const std::string& place, std::string_view what) {
  if (result < 0) {
    fail_with_reason(place, what);
  }
  return result;
}

Handle checked_handle(std::int64_t id, Handle::Close close, const std::string& place, std::string_view what);

std::string joined(const std::string& place, const std::string& name);
std::string attribute_place(const std::string& place, const std::string& name);

/// In memory: Complex as {r, i}, and texts of variable length as pointers.
Handle complex_type();
Handle text_type();

}  // namespace touchfield::hdf5
