#include "sim/output/hdf5_file.h"

#include <algorithm>
#include <array>
#include <functional>
#include <numeric>
#include <type_traits>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <hdf5.h>

#include "sim/core/errors.h"
#include "sim/core/types.h"

namespace touchfield::hdf5 {

namespace {

static_assert(std::is_same_v<hid_t, std::int64_t> && std::is_same_v<herr_t, int>);
static_assert(sizeof(hsize_t) == sizeof(std::uint64_t));

constexpr std::uint64_t kCompressFrom = 1 << 15;   // [bytes]; below, chunks cost more than they save
constexpr std::uint64_t kChunk = 1 << 20;          // [bytes]
constexpr std::size_t kMemoryIncrement = 1 << 24;  // [bytes] by which a file in memory grows
// No zlib stream packs better than 1,032 to 1, so a dataset that promises more than that has lost its data.
constexpr std::uint64_t kLargestPacking = 1032;
constexpr std::uint64_t kLargestText = 1 << 26;  // [bytes]

/// The most detailed of the errors that the library has noted.
std::string reason() {
  std::string text = "no reason given";
  H5Ewalk2(
      H5E_DEFAULT, H5E_WALK_UPWARD,
      [](unsigned depth, const H5E_error2_t* error, void* out) -> herr_t {
        if (depth == 0 && error->desc != nullptr) {
          *static_cast<std::string*>(out) = error->desc;
        }
        return 0;
      },
      &text);
  return text;
}

[[noreturn]] void fail(const std::string& place, std::string_view what) {
  throw IoError(fmt::format("{}: {}", place, what));
}

/// The result of a library call, or its error.
template <class Result>
Result checked(Result result, const std::string& place, std::string_view what) {
  if (result < 0) {
    fail(place, fmt::format("{} ({})", what, reason()));
  }
  return result;
}

Handle checked_handle(hid_t id, Handle::Close close, const std::string& place, std::string_view what) {
  return {checked(id, place, what), close};
}

std::string joined(const std::string& place, const std::string& name) {
  return place.ends_with('/') ? place + name : fmt::format("{}/{}", place, name);
}

std::string attribute_place(const std::string& place, const std::string& name) {
  return fmt::format("{}: attribute {}", place, name);
}

template <class T>
Handle element_type() {
  if constexpr (std::is_same_v<T, Complex>) {
    Handle type(H5Tcreate(H5T_COMPOUND, sizeof(Complex)), H5Tclose);
    H5Tinsert(type.id(), "r", 0, H5T_NATIVE_DOUBLE);
    H5Tinsert(type.id(), "i", sizeof(double), H5T_NATIVE_DOUBLE);
    return type;
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

/// True if values of the file's type become a T without a change of meaning.
template <class T>
bool converts(hid_t file_type) {
  const H5T_class_t kind = H5Tget_class(file_type);
  if constexpr (std::is_same_v<T, Complex>) {
    if (kind != H5T_COMPOUND || H5Tget_nmembers(file_type) != 2) {
      return false;
    }
    for (const char* part : {"r", "i"}) {
      const int index = H5Tget_member_index(file_type, part);
      if (index < 0 || H5Tget_member_class(file_type, static_cast<unsigned>(index)) != H5T_FLOAT) {
        return false;
      }
    }
    return true;
  } else {
    return kind == (std::is_same_v<T, double> ? H5T_FLOAT : H5T_INTEGER);
  }
}

template <class T>
const char* type_name() {
  return std::is_same_v<T, Complex> ? "complex numbers {r, i}" : std::is_same_v<T, double> ? "floats" : "integers";
}

Handle text_type() {
  Handle type(H5Tcopy(H5T_C_S1), H5Tclose);
  H5Tset_size(type.id(), H5T_VARIABLE);
  H5Tset_cset(type.id(), H5T_CSET_UTF8);
  return type;
}

Handle scalar_space() { return {H5Screate(H5S_SCALAR), H5Sclose}; }

Handle simple_space(const Shape& shape, const std::string& place) {
  const std::vector<hsize_t> extent(shape.begin(), shape.end());
  return checked_handle(H5Screate_simple(static_cast<int>(extent.size()), extent.data(), nullptr), H5Sclose, place,
                        "cannot describe its shape");
}

Shape extent(hid_t space, const std::string& place) {
  const int rank = checked(H5Sget_simple_extent_ndims(space), place, "has no shape");
  std::vector<hsize_t> sizes(static_cast<std::size_t>(rank));
  checked(H5Sget_simple_extent_dims(space, sizes.data(), nullptr), place, "has no shape");
  return {sizes.begin(), sizes.end()};
}

/// HDF5 ends a text at its first zero byte; one inside would lose the rest.
const char* c_text(const std::string& text, const std::string& place) {
  if (text.find('\0') != std::string::npos) {
    fail(place, "a text with a zero byte cannot be stored");
  }
  return text.c_str();
}

std::vector<const char*> c_texts(const std::vector<std::string>& texts, const std::string& place) {
  std::vector<const char*> pointers;
  pointers.reserve(texts.size());
  for (const auto& text : texts) {
    pointers.push_back(c_text(text, place));
  }
  return pointers;
}

/// Chunks of about kChunk bytes, cut along the slowest indices first.
std::vector<hsize_t> chunk_shape(const Shape& shape, std::uint64_t element) {
  std::vector<hsize_t> chunk(shape.begin(), shape.end());
  for (auto& length : chunk) {
    const std::uint64_t bytes = std::accumulate(chunk.begin(), chunk.end(), element, std::multiplies<>());
    const std::uint64_t pieces = (bytes + kChunk - 1) / kChunk;
    length = std::max<hsize_t>(1, length / pieces);
  }
  return chunk;
}

Handle storage(const Shape& shape, std::uint64_t element, const std::string& place) {
  Handle list(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
  H5Pset_obj_track_times(list.id(), false);  // the same run gives the same bytes
  if (std::accumulate(shape.begin(), shape.end(), element, std::multiplies<>()) >= kCompressFrom) {
    const auto chunk = chunk_shape(shape, element);
    checked(H5Pset_chunk(list.id(), static_cast<int>(chunk.size()), chunk.data()), place, "cannot set its chunks");
    checked(H5Pset_shuffle(list.id()), place, "cannot set its filter");
    checked(H5Pset_deflate(list.id(), 1), place, "cannot set its compression");
  }
  return list;
}

void write_attribute(hid_t object, const std::string& name, hid_t type, hid_t space, const void* value,
                     const std::string& place) {
  const Handle attribute = checked_handle(H5Acreate2(object, name.c_str(), type, space, H5P_DEFAULT, H5P_DEFAULT),
                                          H5Aclose, place, "cannot create");
  checked(H5Awrite(attribute.id(), type, value), place, "cannot write");
}

/// Creates a dataset, writes it and names its unit.
void write_dataset(hid_t group, const std::string& name, hid_t type, hid_t space, hid_t list, const void* values,
                   const std::string& unit, const std::string& place) {
  const Handle data = checked_handle(H5Dcreate2(group, name.c_str(), type, space, H5P_DEFAULT, list, H5P_DEFAULT),
                                     H5Dclose, place, "cannot create");
  checked(H5Dwrite(data.id(), type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values), place, "cannot write");
  const Handle text = text_type();
  const char* pointer = c_text(unit, place);
  write_attribute(data.id(), "unit", text.id(), scalar_space().id(), static_cast<const void*>(&pointer), place);
}

/// Reads the texts of a dataset or an attribute: `read` fills an array of pointers that the library allocated.
std::vector<std::string> read_variable_texts(hid_t file_type, hid_t space, const std::string& place,
                                             const std::function<herr_t(hid_t, char**)>& read) {
  if (H5Tget_class(file_type) != H5T_STRING || H5Tis_variable_str(file_type) <= 0) {
    fail(place, "does not hold texts of variable length");
  }
  const hssize_t count = checked(H5Sget_simple_extent_npoints(space), place, "has no shape");
  if (static_cast<std::uint64_t>(count) > kLargestText) {
    fail(place, fmt::format("promises {} texts", count));
  }
  const Handle type = text_type();
  std::vector<char*> pointers(static_cast<std::size_t>(count), nullptr);
  checked(read(type.id(), pointers.data()), place, "cannot read");
  std::vector<std::string> texts;
  texts.reserve(pointers.size());
  for (const char* pointer : pointers) {
    texts.emplace_back(pointer == nullptr ? "" : pointer);
  }
  H5Dvlen_reclaim(type.id(), space, H5P_DEFAULT, static_cast<void*>(pointers.data()));
  return texts;
}

Handle open_attribute(hid_t object, const std::string& name, const std::string& place) {
  return checked_handle(H5Aopen(object, name.c_str(), H5P_DEFAULT), H5Aclose, place, "cannot open");
}

std::vector<std::string> attribute_texts(hid_t object, const std::string& name, const std::string& place) {
  const Handle attribute = open_attribute(object, name, place);
  const Handle type(H5Aget_type(attribute.id()), H5Tclose);
  const Handle space(H5Aget_space(attribute.id()), H5Sclose);
  return read_variable_texts(type.id(), space.id(), place, [&](hid_t memory, char** out) {
    return H5Aread(attribute.id(), memory, static_cast<void*>(out));
  });
}

template <class T>
T attribute_number(hid_t object, const std::string& name, const std::string& place) {
  const Handle attribute = open_attribute(object, name, place);
  const Handle type(H5Aget_type(attribute.id()), H5Tclose);
  const Handle space(H5Aget_space(attribute.id()), H5Sclose);
  if (!converts<T>(type.id()) || H5Sget_simple_extent_npoints(space.id()) != 1) {
    fail(place, fmt::format("is not one of {}", type_name<T>()));
  }
  T value{};
  checked(H5Aread(attribute.id(), element_type<T>().id(), &value), place, "cannot read");
  return value;
}

Handle open_dataset(hid_t group, const std::string& name, const std::string& place) {
  return checked_handle(H5Dopen2(group, name.c_str(), H5P_DEFAULT), H5Dclose, place, "cannot open");
}

std::vector<std::string> dataset_texts(hid_t group, const std::string& name, const std::string& place) {
  const Handle data = open_dataset(group, name, place);
  const Handle type(H5Dget_type(data.id()), H5Tclose);
  const Handle space(H5Dget_space(data.id()), H5Sclose);
  return read_variable_texts(type.id(), space.id(), place, [&](hid_t memory, char** out) {
    return H5Dread(data.id(), memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, static_cast<void*>(out));
  });
}

Handle create_in_memory(const std::string& path) {
  const Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  checked(H5Pset_fapl_core(access.id(), kMemoryIncrement, false), path, "cannot build in memory");
  const Handle creation(H5Pcreate(H5P_FILE_CREATE), H5Pclose);
  checked(H5Pset_link_creation_order(creation.id(), H5P_CRT_ORDER_TRACKED | H5P_CRT_ORDER_INDEXED), path,
          "cannot keep an order");
  H5Pset_obj_track_times(creation.id(), false);
  return checked_handle(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, creation.id(), access.id()), H5Fclose, path,
                        "cannot create");
}

Handle open_for_reading(const std::string& path) {
  const Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  // Files are replaced whole, never written in place: a lock would only fail where a file system has none.
  checked(H5Pset_file_locking(access.id(), false, true), path, "cannot open without a lock");
  return checked_handle(H5Fopen(path.c_str(), H5F_ACC_RDONLY, access.id()), H5Fclose, path, "cannot open as HDF5");
}

Group root_of(const Handle& file, const std::string& path) {
  const std::string place = path + ": /";
  return {checked_handle(H5Gopen2(file.id(), "/", H5P_DEFAULT), H5Gclose, place, "cannot open"), place};
}

}  // namespace

Handle::~Handle() {
  if (id_ >= 0) {
    close_(id_);
  }
}

Group Group::create(const std::string& name) const {
  const std::string place = joined(place_, name);
  const Handle list(H5Pcreate(H5P_GROUP_CREATE), H5Pclose);
  checked(H5Pset_link_creation_order(list.id(), H5P_CRT_ORDER_TRACKED | H5P_CRT_ORDER_INDEXED), place,
          "cannot keep an order");
  H5Pset_obj_track_times(list.id(), false);
  return {checked_handle(H5Gcreate2(handle_.id(), name.c_str(), H5P_DEFAULT, list.id(), H5P_DEFAULT), H5Gclose, place,
                         "cannot create"),
          place};
}

Group Group::open(const std::string& name) const {
  const std::string place = joined(place_, name);
  return {checked_handle(H5Gopen2(handle_.id(), name.c_str(), H5P_DEFAULT), H5Gclose, place, "cannot open"), place};
}

bool Group::has(const std::string& name) const {
  return checked(H5Lexists(handle_.id(), name.c_str(), H5P_DEFAULT), joined(place_, name), "cannot look up") > 0;
}

std::vector<std::string> Group::names() const {
  H5G_info_t info{};
  checked(H5Gget_info(handle_.id(), &info), place_, "cannot list");
  // A group that another program made may not know the order.
  const H5_index_t order = info.nlinks > 0 && H5Lget_name_by_idx(handle_.id(), ".", H5_INDEX_CRT_ORDER, H5_ITER_INC, 0,
                                                                 nullptr, 0, H5P_DEFAULT) < 0
                               ? H5_INDEX_NAME
                               : H5_INDEX_CRT_ORDER;
  std::vector<std::string> names;
  const auto collect = [](hid_t /*group*/, const char* name, const H5L_info_t* /*info*/, void* out) -> herr_t {
    static_cast<std::vector<std::string>*>(out)->emplace_back(name);
    return 0;
  };
  checked(H5Literate(handle_.id(), order, H5_ITER_INC, nullptr, collect, &names), place_, "cannot list");
  return names;
}

void Group::link(const std::string& name, const std::string& target) const {
  checked(H5Lcreate_soft(target.c_str(), handle_.id(), name.c_str(), H5P_DEFAULT, H5P_DEFAULT), joined(place_, name),
          "cannot link");
}

void Group::set_attribute(const std::string& name, const std::string& text) const {
  const std::string place = attribute_place(place_, name);
  const char* pointer = c_text(text, place);
  write_attribute(handle_.id(), name, text_type().id(), scalar_space().id(), static_cast<const void*>(&pointer), place);
}

void Group::set_attribute(const std::string& name, double value) const {
  write_attribute(handle_.id(), name, H5T_NATIVE_DOUBLE, scalar_space().id(), &value, attribute_place(place_, name));
}

void Group::set_attribute(const std::string& name, int value) const {
  write_attribute(handle_.id(), name, H5T_NATIVE_INT, scalar_space().id(), &value, attribute_place(place_, name));
}

void Group::set_attribute(const std::string& name, const std::vector<std::string>& texts) const {
  const std::string place = attribute_place(place_, name);
  const auto pointers = c_texts(texts, place);
  write_attribute(handle_.id(), name, text_type().id(), simple_space({pointers.size()}, place).id(),
                  static_cast<const void*>(pointers.data()), place);
}

bool Group::has_attribute(const std::string& name) const {
  return checked(H5Aexists(handle_.id(), name.c_str()), attribute_place(place_, name), "cannot look up") > 0;
}

std::string Group::text_attribute(const std::string& name) const {
  const std::string place = attribute_place(place_, name);
  const auto texts = attribute_texts(handle_.id(), name, place);
  if (texts.size() != 1) {
    fail(place, fmt::format("must be one text, has {}", texts.size()));
  }
  return texts.front();
}

double Group::number_attribute(const std::string& name) const {
  return attribute_number<double>(handle_.id(), name, attribute_place(place_, name));
}

int Group::integer_attribute(const std::string& name) const {
  return attribute_number<int>(handle_.id(), name, attribute_place(place_, name));
}

std::vector<std::string> Group::texts_attribute(const std::string& name) const {
  return attribute_texts(handle_.id(), name, attribute_place(place_, name));
}

template <class T>
void Group::write(const std::string& name, const T* values, const Shape& shape, const std::string& unit) const {
  const std::string place = joined(place_, name);
  const Handle type = element_type<T>();
  write_dataset(handle_.id(), name, type.id(), simple_space(shape, place).id(), storage(shape, sizeof(T), place).id(),
                values, unit, place);
}

void Group::write_text(const std::string& name, const std::string& text) const {
  const std::string place = joined(place_, name);
  const char* pointer = c_text(text, place);
  write_dataset(handle_.id(), name, text_type().id(), scalar_space().id(), storage({}, sizeof(pointer), place).id(),
                static_cast<const void*>(&pointer), "text", place);
}

void Group::write_texts(const std::string& name, const std::vector<std::string>& texts) const {
  const std::string place = joined(place_, name);
  const auto pointers = c_texts(texts, place);
  const Shape shape = {pointers.size()};
  write_dataset(handle_.id(), name, text_type().id(), simple_space(shape, place).id(),
                storage(shape, sizeof(char*), place).id(), static_cast<const void*>(pointers.data()), "text", place);
}

Shape Group::shape(const std::string& name) const {
  const std::string place = joined(place_, name);
  const Handle data = open_dataset(handle_.id(), name, place);
  const Handle space(H5Dget_space(data.id()), H5Sclose);
  const Handle type(H5Dget_type(data.id()), H5Tclose);
  Shape shape = extent(space.id(), place);
  // In floating point: the product of damaged sizes may not fit an integer.
  const double promised = std::accumulate(shape.begin(), shape.end(), static_cast<double>(H5Tget_size(type.id())),
                                          [](double a, std::uint64_t b) { return a * static_cast<double>(b); });
  if (promised > static_cast<double>(kLargestPacking) * static_cast<double>(H5Dget_storage_size(data.id()))) {
    fail(place,
         fmt::format("promises shape [{}] but holds {} bytes", fmt::join(shape, ", "), H5Dget_storage_size(data.id())));
  }
  return shape;
}

template <class T>
void Group::read(const std::string& name, const Shape& expected, T* values) const {
  const std::string place = joined(place_, name);
  const Shape found = shape(name);
  if (found != expected) {
    fail(place, fmt::format("has shape [{}], must have [{}]", fmt::join(found, ", "), fmt::join(expected, ", ")));
  }
  const Handle data = open_dataset(handle_.id(), name, place);
  const Handle type(H5Dget_type(data.id()), H5Tclose);
  if (!converts<T>(type.id())) {
    fail(place, fmt::format("does not hold {}", type_name<T>()));
  }
  checked(H5Dread(data.id(), element_type<T>().id(), H5S_ALL, H5S_ALL, H5P_DEFAULT, values), place, "cannot read");
}

std::string Group::read_text(const std::string& name) const {
  const auto texts = read_texts(name);
  if (texts.size() != 1) {
    fail(joined(place_, name), fmt::format("must be one text, has {}", texts.size()));
  }
  return texts.front();
}

std::vector<std::string> Group::read_texts(const std::string& name) const {
  return dataset_texts(handle_.id(), name, joined(place_, name));
}

template void Group::write(const std::string&, const double*, const Shape&, const std::string&) const;
template void Group::write(const std::string&, const int*, const Shape&, const std::string&) const;
template void Group::write(const std::string&, const std::int64_t*, const Shape&, const std::string&) const;
template void Group::write(const std::string&, const unsigned char*, const Shape&, const std::string&) const;
template void Group::write(const std::string&, const Complex*, const Shape&, const std::string&) const;
template void Group::read(const std::string&, const Shape&, double*) const;
template void Group::read(const std::string&, const Shape&, int*) const;
template void Group::read(const std::string&, const Shape&, std::int64_t*) const;
template void Group::read(const std::string&, const Shape&, unsigned char*) const;
template void Group::read(const std::string&, const Shape&, Complex*) const;

QuietErrors::QuietErrors() {
  H5Eget_auto2(H5E_DEFAULT, &function_, &data_);
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
}

QuietErrors::~QuietErrors() { H5Eset_auto2(H5E_DEFAULT, function_, data_); }

MemoryFile::MemoryFile(std::string path) : path_(std::move(path)), file_(create_in_memory(path_)) {}

Group MemoryFile::root() const { return root_of(file_, path_); }

std::string MemoryFile::bytes() const {
  checked(H5Fflush(file_.id(), H5F_SCOPE_GLOBAL), path_, "cannot finish");
  const ssize_t size = checked(H5Fget_file_image(file_.id(), nullptr, 0), path_, "cannot measure");
  std::string bytes(static_cast<std::size_t>(size), '\0');
  checked(H5Fget_file_image(file_.id(), bytes.data(), bytes.size()), path_, "cannot copy");
  return bytes;
}

InputFile::InputFile(std::string path) : path_(std::move(path)), file_(open_for_reading(path_)) {}

Group InputFile::root() const { return root_of(file_, path_); }

}  // namespace touchfield::hdf5
