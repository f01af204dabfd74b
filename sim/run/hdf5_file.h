#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "sim/core/errors.h"

/// A thin layer over the HDF5 C library: identifiers that close themselves, and errors that name file, place and
/// HDF5's own reason. Element types T are double, int, std::int64_t, unsigned char and Complex (a compound {r, i}).
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

/// Keeps HDF5 from printing its errors while it lives.
class MutedErrors {
 public:
  MutedErrors();
  MutedErrors(const MutedErrors&) = delete;
  MutedErrors& operator=(const MutedErrors&) = delete;
  ~MutedErrors();

 private:
  int (*function_)(std::int64_t, void*) = nullptr;
  void* data_ = nullptr;
};

/// A group of a file that is being written. Links keep the order in which they were made. Every function throws IoError
/// if the library fails.
class Group {
 public:
  Group(Handle handle, std::string place) : handle_(std::move(handle)), place_(std::move(place)) {}

  const std::string& place() const { return place_; }  // "run.h5: /methods/surface", for messages

  Group create(const std::string& name) const;
  /// A soft link to another place of the same file.
  void link(const std::string& name, const std::string& target) const;

  void set_attribute(const std::string& name, const std::string& text) const;
  void set_attribute(const std::string& name, double value) const;
  void set_attribute(const std::string& name, int value) const;
  void set_attribute(const std::string& name, const std::vector<std::string>& texts) const;
  bool has_attribute(const std::string& name) const;

  /// A dataset in C order with the attribute `unit`; compressed if it is large.
  template <class T>
  void write(const std::string& name, const T* values, const Shape& shape, const std::string& unit) const;
  /// The same of double or Complex, stored in single precision if that changes no value.
  template <class T>
  void write_compact(const std::string& name, const T* values, const Shape& shape, const std::string& unit) const;
  void write_text(const std::string& name, const std::string& text) const;
  void write_texts(const std::string& name, const std::vector<std::string>& texts) const;

 private:
  Handle handle_;
  std::string place_;
};

/// A file built in memory: a full disk is then met by plain writes, not inside the library.
class MemoryFile {
 public:
  /// path   where the file is going to land, for messages
  explicit MemoryFile(std::string path);

  Group root() const;
  /// The file's bytes as it is now. Groups must be closed.
  std::string bytes() const;

 private:
  MutedErrors muted_;
  std::string path_;
  Handle file_;
};

struct Values;

/// A group of a file that is being read; the file stays open while it lives. Links within the file lead to what they
/// name. What would lead out of the file or into other programs is refused. These are external and user-defined links,
/// external storage, virtual datasets, and filters other than shuffle, deflate and fletcher32.
/// Every function throws InputError that names file and place. Causes are a thing that is missing or cannot be read, or
/// has another type or shape than asked for.
class Content {
 public:
  const std::string& place() const { return place_; }  // "run.h5: /methods/surface", for messages

  Content open(const std::string& name) const;
  bool has(const std::string& name) const;
  std::vector<std::string> names() const;  // of everything in it, in the order it was made

  bool has_attribute(const std::string& name) const;
  std::string text_attribute(const std::string& name) const;
  double number_attribute(const std::string& name) const;
  int integer_attribute(const std::string& name) const;
  std::vector<std::string> texts_attribute(const std::string& name) const;

  Shape shape(const std::string& name) const;  // of a dataset
  /// Reads a dataset that must have this shape.
  template <class T>
  void read(const std::string& name, const Shape& shape, T* values) const;
  std::string read_text(const std::string& name) const;
  std::vector<std::string> read_texts(const std::string& name) const;

 private:
  friend Content read_content(const std::string& path);

  Content(std::shared_ptr<const MutedErrors> muted, Handle group, std::string place)
      : muted_(std::move(muted)), group_(std::move(group)), place_(std::move(place)) {}
  Handle object(const std::string& name) const;
  Values dataset(const std::string& name) const;

  std::shared_ptr<const MutedErrors> muted_;
  Handle group_;
  std::string place_;
};

/// Opens an HDF5 file without a lock and returns its root.
/// throws   InputError naming the file and the library's reason
Content read_content(const std::string& path);

// What writing and reading share.

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
/// Of T in single precision.
template <class T>
Handle single_type();

std::uint64_t bytes_of(const Shape& shape, std::uint64_t element);

}  // namespace touchfield::hdf5
