#include <algorithm>
#include <functional>
#include <numeric>

#include <fmt/ranges.h>
#include <hdf5.h>

#include "sim/core/types.h"
#include "sim/store/hdf5_calls.h"
#include "sim/store/hdf5_wire.h"

namespace touchfield::hdf5 {

namespace {

// No zlib stream packs better than 1,032 to 1, so a dataset that promises more than that has lost its data.
constexpr std::uint64_t kLargestPacking = 1032;

std::string_view as_bytes(const void* begin, std::size_t size) { return {static_cast<const char*>(begin), size}; }

Shape extent(hid_t space, const std::string& place) {
  if (H5Sget_simple_extent_type(space) == H5S_NULL) {
    return {0};
  }
  const int rank = checked(H5Sget_simple_extent_ndims(space), place, "has no shape");
  std::vector<hsize_t> sizes(static_cast<std::size_t>(rank));
  checked(H5Sget_simple_extent_dims(space, sizes.data(), nullptr), place, "has no shape");
  return {sizes.begin(), sizes.end()};
}

/// Values of other types would change their meaning on the way.
PartKind kind_of(hid_t type) {
  switch (H5Tget_class(type)) {
    case H5T_FLOAT:
      return PartKind::kFloats;
    case H5T_INTEGER:
      return PartKind::kIntegers;
    case H5T_STRING:
      return H5Tis_variable_str(type) > 0 ? PartKind::kTexts : PartKind::kOther;
    case H5T_COMPOUND:
      for (const char* part : {"r", "i"}) {
        const int index = H5Tget_member_index(type, part);
        if (index < 0 || H5Tget_member_class(type, static_cast<unsigned>(index)) != H5T_FLOAT) {
          return PartKind::kOther;
        }
      }
      return H5Tget_nmembers(type) == 2 ? PartKind::kComplex : PartKind::kOther;
    default:
      return PartKind::kOther;
  }
}

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
  checked(H5Lget_info(group, name.c_str(), &info, H5P_DEFAULT), place, "cannot look up");
  if (info.type == H5L_TYPE_EXTERNAL) {
    fail(place, "is a link into another file, which is not followed");
  }
  if (info.type != H5L_TYPE_HARD && info.type != H5L_TYPE_SOFT) {
    fail(place, "is a link of a user-defined kind, which is not followed");
  }
}

/// The values of a dataset are its own, in its own file.
void require_own_values(hid_t data, const std::string& place) {
  const Handle list = checked_handle(H5Dget_create_plist(data), H5Pclose, place, "cannot open");
  if (H5Pget_layout(list.id()) == H5D_VIRTUAL) {
    fail(place, "is a virtual dataset with values in other files; they are not read");
  }
  if (H5Pget_external_count(list.id()) != 0) {
    fail(place, "has its values in another file (external storage), which is not read");
  }
  const int filters = checked(H5Pget_nfilters(list.id()), place, "has no list of filters");
  for (int i = 0; i < filters; ++i) {
    unsigned flags = 0;
    std::size_t count = 0;
    const H5Z_filter_t filter =
        H5Pget_filter2(list.id(), static_cast<unsigned>(i), &flags, &count, nullptr, 0, nullptr, nullptr);
    if (filter != H5Z_FILTER_SHUFFLE && filter != H5Z_FILTER_DEFLATE && filter != H5Z_FILTER_FLETCHER32) {
      fail(place, fmt::format("is packed by filter {}; only shuffle, deflate and fletcher32 are used", filter));
    }
  }
}

void require_plausible_size(hid_t data, hid_t type, const Shape& shape, const std::string& place) {
  // In floating point: the product of damaged sizes may not fit an integer.
  const double promised = std::accumulate(shape.begin(), shape.end(), static_cast<double>(H5Tget_size(type)),
                                          [](double a, std::uint64_t b) { return a * static_cast<double>(b); });
  const hsize_t held = H5Dget_storage_size(data);
  if (promised > static_cast<double>(kLargestPacking) * static_cast<double>(held)) {
    fail(place, fmt::format("promises shape [{}] but holds {} bytes", fmt::join(shape, ", "), held));
  }
}

/// For the library's iterations over links and attributes.
template <class Info>
herr_t collect_name(hid_t /*object*/, const char* name, const Info* /*info*/, void* names) {
  static_cast<std::vector<std::string>*>(names)->emplace_back(name);
  return 0;
}

/// In the order in which they were made; a group that another program made may not know it.
std::vector<std::string> link_names(hid_t group, const std::string& place) {
  H5G_info_t info{};
  checked(H5Gget_info(group, &info), place, "cannot list");
  const bool ordered = info.nlinks > 0 &&
                       H5Lget_name_by_idx(group, ".", H5_INDEX_CRT_ORDER, H5_ITER_INC, 0, nullptr, 0, H5P_DEFAULT) >= 0;
  std::vector<std::string> names;
  checked(H5Literate(group, ordered ? H5_INDEX_CRT_ORDER : H5_INDEX_NAME, H5_ITER_INC, nullptr,
                     collect_name<H5L_info_t>, &names),
          place, "cannot list");
  return names;
}

/// Texts one after another, each with its length before it.
template <class Texts>
std::string joined_texts(const Texts& texts) {
  std::string bytes;
  for (const std::string_view text : texts) {
    const std::uint64_t size = text.size();
    bytes.append(as_bytes(&size, sizeof size)).append(text);
  }
  return bytes;
}

class Sender {
 public:
  explicit Sender(const Emit& emit)
      : emit_(emit), links_(links_within_the_file()), complex_(complex_type()), text_(text_type()) {}

  void object(hid_t object, const std::string& place, int depth) {
    if (depth > kDeepestGroup) {
      fail(place, fmt::format("is more than {} groups deep", kDeepestGroup));
    }
    switch (H5Iget_type(object)) {
      case H5I_GROUP:
        return group(object, place, depth);
      case H5I_DATASET:
        return dataset(object, place);
      default:
        return part(place, PartKind::kOther, {}, "");
    }
  }

 private:
  using Read = std::function<herr_t(hid_t, void*)>;

  void number(std::uint64_t value) { emit_(as_bytes(&value, sizeof value)); }
  void text(std::string_view bytes) {
    number(bytes.size());
    emit_(bytes);
  }

  void part(const std::string& place, PartKind kind, const Shape& shape, std::string_view bytes) {
    if (++parts_ > kMostParts) {
      fail(place, fmt::format("is one of more than {} objects and attributes", kMostParts));
    }
    text(place);
    emit_(as_bytes(&kind, sizeof kind));
    number(shape.size());
    for (const std::uint64_t size : shape) {
      number(size);
    }
    text(bytes);
  }

  void group(hid_t group, const std::string& place, int depth) {
    const std::vector<std::string> names = link_names(group, place);
    part(place, PartKind::kGroup, {names.size()}, joined_texts(names));
    attributes(group, place);
    for (const std::string& name : names) {
      const std::string there = joined(place, name);
      require_own_link(group, name, there);
      object(checked_handle(H5Oopen(group, name.c_str(), links_.id()), H5Oclose, there, "cannot open").id(), there,
             depth + 1);
    }
  }

  void attributes(hid_t object, const std::string& place) {
    std::vector<std::string> names;
    checked(H5Aiterate2(object, H5_INDEX_NAME, H5_ITER_INC, nullptr, collect_name<H5A_info_t>, &names), place,
            "cannot list");
    for (const std::string& name : names) {
      const std::string there = attribute_place(place, name);
      const Handle attribute =
          checked_handle(H5Aopen(object, name.c_str(), H5P_DEFAULT), H5Aclose, there, "cannot open");
      const Handle type = checked_handle(H5Aget_type(attribute.id()), H5Tclose, there, "has no type");
      const Handle space = checked_handle(H5Aget_space(attribute.id()), H5Sclose, there, "has no shape");
      values(type.id(), space.id(), extent(space.id(), there), there,
             [&](hid_t memory, void* out) { return H5Aread(attribute.id(), memory, out); });
    }
  }

  void dataset(hid_t data, const std::string& place) {
    require_own_values(data, place);
    const Handle type = checked_handle(H5Dget_type(data), H5Tclose, place, "has no type");
    const Handle space = checked_handle(H5Dget_space(data), H5Sclose, place, "has no shape");
    const Shape shape = extent(space.id(), place);
    require_plausible_size(data, type.id(), shape, place);
    values(type.id(), space.id(), shape, place,
           [&](hid_t memory, void* out) { return H5Dread(data, memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, out); });
  }

  void values(hid_t type, hid_t space, const Shape& shape, const std::string& place, const Read& read) {
    const PartKind kind = kind_of(type);
    const auto length = static_cast<std::size_t>(checked(H5Sget_simple_extent_npoints(space), place, "has no shape"));
    switch (kind) {
      case PartKind::kFloats:
        return part(place, kind, shape, numbers<double>(H5T_NATIVE_DOUBLE, length, place, read));
      case PartKind::kIntegers:
        return part(place, kind, shape, numbers<std::int64_t>(H5T_NATIVE_INT64, length, place, read));
      case PartKind::kComplex:
        return part(place, kind, shape, numbers<Complex>(complex_.id(), length, place, read));
      case PartKind::kTexts:
        return part(place, kind, shape, texts(length, place, read));
      default:
        return part(place, PartKind::kOther, shape, "");
    }
  }

  template <class T>
  static std::string numbers(hid_t type, std::size_t length, const std::string& place, const Read& read) {
    std::string bytes(length * sizeof(T), '\0');
    checked(read(type, bytes.data()), place, "cannot read");
    return bytes;
  }

  std::string texts(std::size_t length, const std::string& place, const Read& read) const {
    std::vector<const char*> pointers(length, nullptr);
    checked(read(text_.id(), static_cast<void*>(pointers.data())), place, "cannot read");
    std::ranges::replace(pointers, nullptr, "");
    return joined_texts(pointers);  // what the library has allocated goes with the process
  }

  const Emit& emit_;
  Handle links_;
  Handle complex_;
  Handle text_;
  int parts_ = 0;
};

Handle open_for_reading(const std::string& path) {
  const Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  // Files are replaced whole, never written in place: a lock would only fail where a file system has none.
  checked(H5Pset_file_locking(access.id(), false, true), path, "cannot open without a lock");
  return checked_handle(H5Fopen(path.c_str(), H5F_ACC_RDONLY, access.id()), H5Fclose, path, "cannot open as HDF5");
}

}  // namespace

void send_content(const std::string& path, const Emit& emit) {
  const QuietErrors quiet;
  H5PLset_loading_state(0);  // no code from elsewhere is loaded for a file's sake
  const Handle file = open_for_reading(path);
  const std::string place = path + ": /";
  const Handle root = checked_handle(H5Oopen(file.id(), "/", H5P_DEFAULT), H5Oclose, place, "cannot open");
  Sender(emit).object(root.id(), place, 0);
}

}  // namespace touchfield::hdf5
