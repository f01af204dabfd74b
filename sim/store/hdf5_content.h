#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "sim/store/hdf5_file.h"

namespace touchfield::hdf5 {

struct Part;
struct Parts;

/// A group of a file that has been read. Element types T are double, int, std::int64_t, unsigned char and Complex.
/// Every function throws InputError, naming file and place, if there is no such thing or it has another type or shape
/// than asked for.
class Content {
 public:
  Content(std::shared_ptr<const Parts> parts, std::string place) : parts_(std::move(parts)), place_(std::move(place)) {}

  const std::string& place() const { return place_; }  // "run.h5: /methods/surface", for messages

  Content open(const std::string& name) const;
  bool has(const std::string& name) const;
  std::vector<std::string> names() const;  // of everything in it, in the order it was made

  bool has_attribute(const std::string& name) const;
  std::string text_attribute(const std::string& name) const;
  double number_attribute(const std::string& name) const;
  int integer_attribute(const std::string& name) const;
  std::vector<std::string> texts_attribute(const std::string& name) const;

  /// The shape of a dataset, all of whose values are there.
  Shape shape(const std::string& name) const;
  /// Reads a dataset that must have this shape.
  template <class T>
  void read(const std::string& name, const Shape& shape, T* values) const;
  std::string read_text(const std::string& name) const;
  std::vector<std::string> read_texts(const std::string& name) const;

 private:
  const Part* find(const std::string& place) const;  // null if it is missing
  const Part& existing(const std::string& place) const;
  const Part& dataset(const std::string& place) const;

  std::shared_ptr<const Parts> parts_;
  std::string place_;
};

/// Reads all that an HDF5 file holds and returns its root. The library does not survive every damaged or forged file,
/// so it reads in a process of its own. It has 2 s and a second more for every 16 MiB of the file. It returns at most
/// 64 MiB and 64 times the size of the file. Links within the file lead to what they name. All that would lead out of
/// the file or into other programs is refused. These are external and user-defined links, external storage, virtual
/// datasets, and filters other than shuffle, deflate and fletcher32. A dataset that promises more than its bytes can
/// hold is refused too.
///
/// throws   InputError naming the file and what is wrong; IoError if no process can be started
Content read_content(const std::string& path);

}  // namespace touchfield::hdf5
