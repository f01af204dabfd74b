#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "sim/store/hdf5_calls.h"

/// A thin layer over the HDF5 C library: identifiers that close themselves, and errors that name file, place and
/// HDF5's own reason. Element types T are double, int, std::int64_t, unsigned char and Complex (a compound {r, i}).
/// Every function throws IoError if the library fails.
namespace touchfield::hdf5 {

using Shape = std::vector<std::uint64_t>;  // slowest index first, as HDF5 counts

/// A group of a file that is being written. Links keep the order in which they were made.
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
  void write_text(const std::string& name, const std::string& text) const;
  void write_texts(const std::string& name, const std::vector<std::string>& texts) const;

 private:
  Handle handle_;
  std::string place_;
};

/// Keeps HDF5 from printing its errors while it lives.
class QuietErrors {
 public:
  QuietErrors();
  QuietErrors(const QuietErrors&) = delete;
  QuietErrors& operator=(const QuietErrors&) = delete;
  ~QuietErrors();

 private:
  int (*function_)(std::int64_t, void*) = nullptr;
  void* data_ = nullptr;
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
  QuietErrors quiet_;
  std::string path_;
  Handle file_;
};

}  // namespace touchfield::hdf5
