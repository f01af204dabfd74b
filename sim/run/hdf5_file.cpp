#include "sim/run/hdf5_file.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <type_traits>

#include <fmt/ranges.h>
#include <hdf5.h>

#include "sim/core/types.h"

namespace touchfield::hdf5 {

namespace {

constexpr std::uint64_t kCompressFrom = 1 << 15;   // [bytes]; below, chunks cost more than they save
constexpr std::uint64_t kChunk = 1 << 20;          // [bytes]
constexpr std::size_t kMemoryIncrement = 1 << 24;  // [bytes] by which a file in memory grows

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
      fail<IoError>(place, "a text with a zero byte cannot be stored");
    }
    pointers.push_back(text.c_str());
  }
  return pointers;
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
///
/// stored, type   of an element in the file and of `values`
void write_dataset(hid_t group, const std::string& name, const Handle& stored, const Handle& type, const Handle& space,
                   const Handle& list, const void* values, const std::string& unit, const std::string& place) {
  const Handle data =
      checked_handle(H5Dcreate2(group, name.c_str(), stored.id(), space.id(), H5P_DEFAULT, list.id(), H5P_DEFAULT),
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
  const Handle type = element_type<T>();
  write_dataset(handle_.id(), name, type, type, simple_space(shape, place), storage(shape, sizeof(T), place), values,
                unit, place);
}

template <class T>
void Group::write_compact(const std::string& name, const T* values, const Shape& shape, const std::string& unit) const {
  const auto* numbers = reinterpret_cast<const double*>(values);
  const bool single = std::all_of(numbers, numbers + bytes_of(shape, sizeof(T) / sizeof(double)), [](double value) {
    return std::isnan(value) || static_cast<double>(static_cast<float>(value)) == value;
  });
  if (!single) {
    write(name, values, shape, unit);
    return;
  }
  const std::string place = joined(place_, name);
  write_dataset(handle_.id(), name, single_type<T>(), element_type<T>(), simple_space(shape, place),
                storage(shape, sizeof(T) / 2, place), values, unit, place);
}

void Group::write_text(const std::string& name, const std::string& text) const {
  const std::string place = joined(place_, name);
  const Handle type = text_type();
  write_dataset(handle_.id(), name, type, type, scalar_space(), storage({}, sizeof(char*), place),
                static_cast<const void*>(c_texts({text}, place).data()), "text", place);
}

void Group::write_texts(const std::string& name, const std::vector<std::string>& texts) const {
  const std::string place = joined(place_, name);
  const Shape shape = {texts.size()};
  const Handle type = text_type();
  write_dataset(handle_.id(), name, type, type, simple_space(shape, place), storage(shape, sizeof(char*), place),
                static_cast<const void*>(c_texts(texts, place).data()), "text", place);
}

template void Group::write(const std::string&, const double*, const Shape&, const std::string&) const;
template void Group::write(const std::string&, const int*, const Shape&, const std::string&) const;
template void Group::write(const std::string&, const std::int64_t*, const Shape&, const std::string&) const;
template void Group::write(const std::string&, const unsigned char*, const Shape&, const std::string&) const;
template void Group::write(const std::string&, const Complex*, const Shape&, const std::string&) const;
template void Group::write_compact(const std::string&, const double*, const Shape&, const std::string&) const;
template void Group::write_compact(const std::string&, const Complex*, const Shape&, const std::string&) const;

MutedErrors::MutedErrors() {
  H5Eget_auto2(H5E_DEFAULT, &function_, &data_);
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
}

MutedErrors::~MutedErrors() { H5Eset_auto2(H5E_DEFAULT, function_, data_); }

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

namespace {

/// A link that leads into another file is not followed, not even by way of a soft link.
Handle links_within_the_file() {
  Handle list(H5Pcreate(H5P_LINK_ACCESS), H5Pclose);
  H5Pset_elink_cb(
      list.id(),
      [](const char*, const char*, const char*, const char*, unsigned*, hid_t, void*) -> herr_t { return -1; },
      nullptr);
  return list;
}

void require_own_link(hid_t group, const std::string& name, const std::string& place) {
  H5L_info_t info{};
  checked<InputError>(H5Lget_info(group, name.c_str(), &info, H5P_DEFAULT), place, "cannot look up");
  if (info.type == H5L_TYPE_EXTERNAL) {
    fail<InputError>(place, "is a link into another file, which is not followed");
  }
  if (info.type != H5L_TYPE_HARD && info.type != H5L_TYPE_SOFT) {
    fail<InputError>(place, "is a link of a user-defined kind, which is not followed");
  }
}

/// The values of a dataset are its own, in its own file, and no plugin is loaded to read them.
void require_own_values(hid_t data, const std::string& place) {
  const Handle list = checked_handle<InputError>(H5Dget_create_plist(data), H5Pclose, place, "cannot open");
  if (H5Pget_layout(list.id()) == H5D_VIRTUAL) {
    fail<InputError>(place, "is a virtual dataset with values in other files; they are not read");
  }
  if (H5Pget_external_count(list.id()) != 0) {
    fail<InputError>(place, "has its values in another file (external storage), which is not read");
  }
  const int filters = checked<InputError>(H5Pget_nfilters(list.id()), place, "has no list of filters");
  for (int i = 0; i < filters; ++i) {
    unsigned flags = 0;
    std::size_t count = 0;
    const H5Z_filter_t filter =
        H5Pget_filter2(list.id(), static_cast<unsigned>(i), &flags, &count, nullptr, 0, nullptr, nullptr);
    if (filter != H5Z_FILTER_SHUFFLE && filter != H5Z_FILTER_DEFLATE && filter != H5Z_FILTER_FLETCHER32) {
      fail<InputError>(place,
                       fmt::format("is packed by filter {}; only shuffle, deflate and fletcher32 are read", filter));
    }
  }
}

Shape extent(hid_t space, const std::string& place) {
  if (H5Sget_simple_extent_type(space) == H5S_NULL) {
    return {0};
  }
  const int rank = checked<InputError>(H5Sget_simple_extent_ndims(space), place, "has no shape");
  std::vector<hsize_t> sizes(static_cast<std::size_t>(rank));
  checked<InputError>(H5Sget_simple_extent_dims(space, sizes.data(), nullptr), place, "has no shape");
  return {sizes.begin(), sizes.end()};
}

bool is_complex(hid_t type) {
  if (H5Tget_class(type) != H5T_COMPOUND || H5Tget_nmembers(type) != 2) {
    return false;
  }
  return std::ranges::all_of(std::array{"r", "i"}, [&](const char* part) {
    const int index = H5Tget_member_index(type, part);
    return index >= 0 && H5Tget_member_class(type, static_cast<unsigned>(index)) == H5T_FLOAT;
  });
}

template <class T>
constexpr const char* kElements = std::is_same_v<T, Complex>       ? "complex numbers {r, i}"
                                  : std::is_same_v<T, double>      ? "floats"
                                  : std::is_same_v<T, const char*> ? "texts of variable length"
                                                                   : "integers";

/// Values of other types would change their meaning on the way.
template <class T>
bool holds(hid_t type) {
  if constexpr (std::is_same_v<T, Complex>) {
    return is_complex(type);
  } else if constexpr (std::is_same_v<T, const char*>) {
    return H5Tget_class(type) == H5T_STRING && H5Tis_variable_str(type) > 0;
  } else {
    return H5Tget_class(type) == (std::is_same_v<T, double> ? H5T_FLOAT : H5T_INTEGER);
  }
}

}  // namespace

/// A dataset or an attribute that is open.
struct Values {
  Handle data;
  Handle type;
  Handle space;
  Shape shape;
  std::string place;

  bool is_attribute() const { return H5Iget_type(data.id()) == H5I_ATTR; }
  std::size_t count() const { return bytes_of(shape, 1); }
  template <class T>
  void require_elements() const {
    if (!holds<T>(type.id())) {
      fail<InputError>(place, fmt::format("does not hold {}", kElements<T>));
    }
  }
  void read(const Handle& memory, void* out) const {
    checked<InputError>(is_attribute() ? H5Aread(data.id(), memory.id(), out)
                                       : H5Dread(data.id(), memory.id(), H5S_ALL, H5S_ALL, H5P_DEFAULT, out),
                        place, "cannot read");
  }
};

namespace {

Values values_of(Handle data, const std::string& place) {
  const bool attribute = H5Iget_type(data.id()) == H5I_ATTR;
  const hid_t type = attribute ? H5Aget_type(data.id()) : H5Dget_type(data.id());
  Handle space = checked_handle<InputError>(attribute ? H5Aget_space(data.id()) : H5Dget_space(data.id()), H5Sclose,
                                            place, "has no shape");
  Shape shape = extent(space.id(), place);
  return {std::move(data), checked_handle<InputError>(type, H5Tclose, place, "has no type"), std::move(space),
          std::move(shape), place};
}

/// Reads all values as T, in whose range they must be.
template <class T>
void copy(const Values& values, T* out) {
  values.require_elements<T>();
  if constexpr (std::is_same_v<T, int> || std::is_same_v<T, unsigned char>) {
    std::vector<std::int64_t> wide(values.count());
    copy(values, wide.data());
    for (std::size_t i = 0; i < wide.size(); ++i) {
      if (!std::in_range<T>(wide[i])) {
        fail<InputError>(values.place, fmt::format("[{}] = {} is out of range", i, wide[i]));
      }
      out[i] = static_cast<T>(wide[i]);
    }
  } else {
    values.read(element_type<T>(), static_cast<void*>(out));
  }
}

std::vector<std::string> texts_of(const Values& values) {
  values.require_elements<const char*>();
  const Handle type = text_type();
  std::vector<char*> pointers(values.count(), nullptr);
  values.read(type, static_cast<void*>(pointers.data()));
  std::vector<std::string> texts;
  std::ranges::transform(pointers, std::back_inserter(texts), [](const char* text) { return text ? text : ""; });
  if (!pointers.empty()) {
    H5Dvlen_reclaim(type.id(), values.space.id(), H5P_DEFAULT, static_cast<void*>(pointers.data()));
  }
  return texts;
}

std::string one_text(const Values& values) {
  std::vector<std::string> texts = texts_of(values);
  if (texts.size() != 1) {
    fail<InputError>(values.place, fmt::format("must be one text, has {}", texts.size()));
  }
  return std::move(texts.front());
}

Values attribute_of(const Handle& group, const std::string& name, const std::string& place) {
  const std::string there = attribute_place(place, name);
  if (checked<InputError>(H5Aexists(group.id(), name.c_str()), there, "cannot look up") == 0) {
    fail<InputError>(there, "is missing");
  }
  return values_of(
      checked_handle<InputError>(H5Aopen(group.id(), name.c_str(), H5P_DEFAULT), H5Aclose, there, "cannot open"),
      there);
}

template <class T>
T number_of(const Values& values) {
  if (values.count() != 1) {
    fail<InputError>(values.place, fmt::format("must be one number, has {}", values.count()));
  }
  T value{};
  copy(values, &value);
  return value;
}

}  // namespace

Handle Content::object(const std::string& name) const {
  const std::string place = joined(place_, name);
  if (!has(name)) {
    fail<InputError>(place, "is missing");
  }
  require_own_link(group_.id(), name, place);
  return checked_handle<InputError>(H5Oopen(group_.id(), name.c_str(), links_within_the_file().id()), H5Oclose, place,
                                    "cannot open");
}

Values Content::dataset(const std::string& name) const {
  const std::string place = joined(place_, name);
  Handle data = object(name);
  if (H5Iget_type(data.id()) != H5I_DATASET) {
    fail<InputError>(place, "is not a dataset");
  }
  require_own_values(data.id(), place);
  return values_of(std::move(data), place);
}

Content Content::open(const std::string& name) const {
  Handle group = object(name);
  if (H5Iget_type(group.id()) != H5I_GROUP) {
    fail<InputError>(joined(place_, name), "is not a group");
  }
  return {muted_, std::move(group), joined(place_, name)};
}

bool Content::has(const std::string& name) const {
  return checked<InputError>(H5Lexists(group_.id(), name.c_str(), H5P_DEFAULT), joined(place_, name),
                             "cannot look up") > 0;
}

std::vector<std::string> Content::names() const {
  H5G_info_t info{};
  checked<InputError>(H5Gget_info(group_.id(), &info), place_, "cannot list");
  // A group that another program made may not know its order.
  const bool ordered = info.nlinks > 0 && H5Lget_name_by_idx(group_.id(), ".", H5_INDEX_CRT_ORDER, H5_ITER_INC, 0,
                                                             nullptr, 0, H5P_DEFAULT) >= 0;
  std::vector<std::string> names;
  const auto collect = [](hid_t, const char* name, const H5L_info_t*, void* out) -> herr_t {
    static_cast<std::vector<std::string>*>(out)->emplace_back(name);
    return 0;
  };
  checked<InputError>(
      H5Literate(group_.id(), ordered ? H5_INDEX_CRT_ORDER : H5_INDEX_NAME, H5_ITER_INC, nullptr, collect, &names),
      place_, "cannot list");
  return names;
}

bool Content::has_attribute(const std::string& name) const {
  return checked<InputError>(H5Aexists(group_.id(), name.c_str()), attribute_place(place_, name), "cannot look up") > 0;
}

std::string Content::text_attribute(const std::string& name) const {
  return one_text(attribute_of(group_, name, place_));
}
double Content::number_attribute(const std::string& name) const {
  return number_of<double>(attribute_of(group_, name, place_));
}
int Content::integer_attribute(const std::string& name) const {
  return number_of<int>(attribute_of(group_, name, place_));
}
std::vector<std::string> Content::texts_attribute(const std::string& name) const {
  return texts_of(attribute_of(group_, name, place_));
}

Shape Content::shape(const std::string& name) const { return dataset(name).shape; }

template <class T>
void Content::read(const std::string& name, const Shape& expected, T* values) const {
  const Values held = dataset(name);
  if (held.shape != expected) {
    fail<InputError>(held.place, fmt::format("has shape [{}], must have [{}]", fmt::join(held.shape, ", "),
                                             fmt::join(expected, ", ")));
  }
  copy(held, values);
}

std::string Content::read_text(const std::string& name) const { return one_text(dataset(name)); }

std::vector<std::string> Content::read_texts(const std::string& name) const { return texts_of(dataset(name)); }

template void Content::read(const std::string&, const Shape&, double*) const;
template void Content::read(const std::string&, const Shape&, int*) const;
template void Content::read(const std::string&, const Shape&, std::int64_t*) const;
template void Content::read(const std::string&, const Shape&, unsigned char*) const;
template void Content::read(const std::string&, const Shape&, Complex*) const;

Content read_content(const std::string& path) {
  auto muted = std::make_shared<const MutedErrors>();
  const Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  // Files are replaced whole, never written in place: a lock would only fail where a file system has none.
  checked<InputError>(H5Pset_file_locking(access.id(), false, true), path, "cannot open without a lock");
  const Handle file = checked_handle<InputError>(H5Fopen(path.c_str(), H5F_ACC_RDONLY, access.id()), H5Fclose, path,
                                                 "is damaged or cut off: HDF5 cannot open it");
  const std::string place = path + ": /";
  return {std::move(muted),
          checked_handle<InputError>(H5Oopen(file.id(), "/", H5P_DEFAULT), H5Oclose, place, "cannot open"), place};
}

}  // namespace touchfield::hdf5
