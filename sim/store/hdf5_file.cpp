#include "sim/store/hdf5_file.h"

#include <algorithm>
#include <functional>
#include <numeric>
#include <type_traits>
#include <utility>

#include <fmt/format.h>
#include <hdf5.h>

#include "sim/core/errors.h"
#include "sim/core/types.h"
#include "sim/store/hdf5_calls.h"

namespace touchfield::hdf5 {

namespace {

static_assert(std::is_same_v<hid_t, std::int64_t> && std::is_same_v<herr_t, int>);
static_assert(sizeof(hsize_t) == sizeof(std::uint64_t));

constexpr std::uint64_t kCompressFrom = 1 << 15;   // [bytes]; below, chunks cost more than they save
constexpr std::uint64_t kChunk = 1 << 20;          // [bytes]
constexpr std::size_t kMemoryIncrement = 1 << 24;  // [bytes] by which a file in memory grows

template <class T>
Handle element_type() {
  if constexpr (std::is_same_v<T, Complex>) {
    return complex_type();
  } else if constexpr (std::is_same_v<T, double>) {
    return {H5Tcopy(H5T_NATIVE_DOUBLE), H5Tclose};
  } else if constexpr (std::is_same_v<T, int>) {
    return {H5Tcopy(H5T_NATIVE_INT), H5Tclose};
  } else if constexpr (std::is_same_v<T, std::int64_t>) {
    return {H5Tcopy(H5T_NATIVE_INT64), H5Tclose};
  } else {
    static_assert(std::is_same_v<T, unsigned char>);
    return {H5Tcopy(H5T_NATIVE_UINT8), H5Tclose};
  }
}

Handle scalar_space() { return {H5Screate(H5S_SCALAR), H5Sclose}; }

Handle simple_space(const Shape& shape, const std::string& place) {
  const std::vector<hsize_t> extent(shape.begin(), shape.end());
  return checked_handle(H5Screate_simple(static_cast<int>(extent.size()), extent.data(), nullptr), H5Sclose, place,
                        "cannot describe its shape");
}

/// HDF5 ends a text at its first zero byte; one inside would lose the rest.
std::vector<const char*> c_texts(const std::vector<std::string>& texts, const std::string& place) {
  std::vector<const char*> pointers;
  for (const auto& text : texts) {
    if (text.find('\0') != std::string::npos) {
      fail(place, "a text with a zero byte cannot be stored");
    }
    pointers.push_back(text.c_str());
  }
  return pointers;
}

std::uint64_t bytes_of(const Shape& shape, std::uint64_t element) {
  return std::accumulate(shape.begin(), shape.end(), element, std::multiplies<>());
}

/// Compressed if it is large, in chunks of about kChunk bytes, cut along the slowest indices first.
Handle storage(const Shape& shape, std::uint64_t element, const std::string& place) {
  Handle list(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
  H5Pset_obj_track_times(list.id(), false);  // the same run gives the same bytes
  if (bytes_of(shape, element) >= kCompressFrom) {
    Shape chunk = shape;
    for (auto& length : chunk) {
      length = std::max<std::uint64_t>(1, length / ((bytes_of(chunk, element) + kChunk - 1) / kChunk));
    }
    const std::vector<hsize_t> extent(chunk.begin(), chunk.end());
    checked(H5Pset_chunk(list.id(), static_cast<int>(extent.size()), extent.data()), place, "cannot set its chunks");
    checked(H5Pset_shuffle(list.id()), place, "cannot set its filter");
    checked(H5Pset_deflate(list.id(), 1), place, "cannot set its compression");
  }
  return list;
}

void write_attribute(hid_t object, const std::string& name, hid_t type, const Handle& space, const void* value,
                     const std::string& place) {
  const Handle attribute = checked_handle(H5Acreate2(object, name.c_str(), type, space.id(), H5P_DEFAULT, H5P_DEFAULT),
                                          H5Aclose, place, "cannot create");
  checked(H5Awrite(attribute.id(), type, value), place, "cannot write");
}

void write_text_attribute(hid_t object, const std::string& name, const std::string& text, const std::string& place) {
  write_attribute(object, name, text_type().id(), scalar_space(),
                  static_cast<const void*>(c_texts({text}, place).data()), place);
}

/// Creates a dataset, writes it and names its unit.
void write_dataset(hid_t group, const std::string& name, const Handle& type, const Handle& space, const Handle& list,
                   const void* values, const std::string& unit, const std::string& place) {
  const Handle data =
      checked_handle(H5Dcreate2(group, name.c_str(), type.id(), space.id(), H5P_DEFAULT, list.id(), H5P_DEFAULT),
                     H5Dclose, place, "cannot create");
  checked(H5Dwrite(data.id(), type.id(), H5S_ALL, H5S_ALL, H5P_DEFAULT, values), place, "cannot write");
  write_text_attribute(data.id(), "unit", unit, place);
}

void keep_order(const Handle& list, const std::string& place) {
  checked(H5Pset_link_creation_order(list.id(), H5P_CRT_ORDER_TRACKED | H5P_CRT_ORDER_INDEXED), place,
          "cannot keep an order");
  H5Pset_obj_track_times(list.id(), false);
}

Handle create_in_memory(const std::string& path) {
  const Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  checked(H5Pset_fapl_core(access.id(), kMemoryIncrement, false), path, "cannot build in memory");
  const Handle creation(H5Pcreate(H5P_FILE_CREATE), H5Pclose);
  keep_order(creation, path);
  return checked_handle(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, creation.id(), access.id()), H5Fclose, path,
                        "cannot create");
}

}  // namespace

Group Group::create(const std::string& name) const {
  const std::string place = joined(place_, name);
  const Handle list(H5Pcreate(H5P_GROUP_CREATE), H5Pclose);
  keep_order(list, place);
  return {checked_handle(H5Gcreate2(handle_.id(), name.c_str(), H5P_DEFAULT, list.id(), H5P_DEFAULT), H5Gclose, place,
                         "cannot create"),
          place};
}

void Group::link(const std::string& name, const std::string& target) const {
  checked(H5Lcreate_soft(target.c_str(), handle_.id(), name.c_str(), H5P_DEFAULT, H5P_DEFAULT), joined(place_, name),
          "cannot link");
}

void Group::set_attribute(const std::string& name, const std::string& text) const {
  write_text_attribute(handle_.id(), name, text, attribute_place(place_, name));
}

void Group::set_attribute(const std::string& name, double value) const {
  write_attribute(handle_.id(), name, H5T_NATIVE_DOUBLE, scalar_space(), &value, attribute_place(place_, name));
}

void Group::set_attribute(const std::string& name, int value) const {
  write_attribute(handle_.id(), name, H5T_NATIVE_INT, scalar_space(), &value, attribute_place(place_, name));
}

void Group::set_attribute(const std::string& name, const std::vector<std::string>& texts) const {
  const std::string place = attribute_place(place_, name);
  write_attribute(handle_.id(), name, text_type().id(), simple_space({texts.size()}, place),
                  static_cast<const void*>(c_texts(texts, place).data()), place);
}

bool Group::has_attribute(const std::string& name) const {
  return checked(H5Aexists(handle_.id(), name.c_str()), attribute_place(place_, name), "cannot look up") > 0;
}

template <class T>
void Group::write(const std::string& name, const T* values, const Shape& shape, const std::string& unit) const {
  const std::string place = joined(place_, name);
  write_dataset(handle_.id(), name, element_type<T>(), simple_space(shape, place), storage(shape, sizeof(T), place),
                values, unit, place);
}

void Group::write_text(const std::string& name, const std::string& text) const {
  const std::string place = joined(place_, name);
  write_dataset(handle_.id(), name, text_type(), scalar_space(), storage({}, sizeof(char*), place),
                static_cast<const void*>(c_texts({text}, place).data()), "text", place);
}

void Group::write_texts(const std::string& name, const std::vector<std::string>& texts) const {
  const std::string place = joined(place_, name);
  const Shape shape = {texts.size()};
  write_dataset(handle_.id(), name, text_type(), simple_space(shape, place), storage(shape, sizeof(char*), place),
                static_cast<const void*>(c_texts(texts, place).data()), "text", place);
}

template void Group::write(const std::string&, const double*, const Shape&, const std::string&) const;
template void Group::write(const std::string&, const int*, const Shape&, const std::string&) const;
template void Group::write(const std::string&, const std::int64_t*, const Shape&, const std::string&) const;
template void Group::write(const std::string&, const unsigned char*, const Shape&, const std::string&) const;
template void Group::write(const std::string&, const Complex*, const Shape&, const std::string&) const;

QuietErrors::QuietErrors() {
  H5Eget_auto2(H5E_DEFAULT, &function_, &data_);
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
}

QuietErrors::~QuietErrors() { H5Eset_auto2(H5E_DEFAULT, function_, data_); }

MemoryFile::MemoryFile(std::string path) : path_(std::move(path)), file_(create_in_memory(path_)) {}

Group MemoryFile::root() const {
  const std::string place = path_ + ": /";
  return {checked_handle(H5Gopen2(file_.id(), "/", H5P_DEFAULT), H5Gclose, place, "cannot open"), place};
}

std::string MemoryFile::bytes() const {
  checked(H5Fflush(file_.id(), H5F_SCOPE_GLOBAL), path_, "cannot finish");
  const ssize_t size = checked(H5Fget_file_image(file_.id(), nullptr, 0), path_, "cannot measure");
  std::string bytes(static_cast<std::size_t>(size), '\0');
  checked(H5Fget_file_image(file_.id(), bytes.data(), bytes.size()), path_, "cannot copy");
  return bytes;
}

}  // namespace touchfield::hdf5
