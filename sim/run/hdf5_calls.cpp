#include <functional>
#include <numeric>
#include <type_traits>

#include <fmt/format.h>
#include <hdf5.h>

#include "sim/core/types.h"
#include "sim/run/hdf5_file.h"

namespace touchfield::hdf5 {

namespace {

static_assert(std::is_same_v<hid_t, std::int64_t> && std::is_same_v<herr_t, int>);
static_assert(sizeof(hsize_t) == sizeof(std::uint64_t));

/// part   type of the real and of the imaginary part
Handle complex_type(hid_t part) {
  const std::size_t size = H5Tget_size(part);
  Handle type(H5Tcreate(H5T_COMPOUND, 2 * size), H5Tclose);
  H5Tinsert(type.id(), "r", 0, part);
  H5Tinsert(type.id(), "i", size, part);
  return type;
}

}  // namespace

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

std::string joined(const std::string& place, const std::string& name) {
  return place.ends_with('/') ? place + name : fmt::format("{}/{}", place, name);
}

std::string attribute_place(const std::string& place, const std::string& name) {
  return fmt::format("{}: attribute {}", place, name);
}

Handle text_type() {
  Handle type(H5Tcopy(H5T_C_S1), H5Tclose);
  H5Tset_size(type.id(), H5T_VARIABLE);
  H5Tset_cset(type.id(), H5T_CSET_UTF8);
  return type;
}

template <class T>
Handle element_type() {
  if constexpr (std::is_same_v<T, Complex>) {
    return complex_type(H5T_NATIVE_DOUBLE);
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

template Handle element_type<double>();
template Handle element_type<int>();
template Handle element_type<std::int64_t>();
template Handle element_type<unsigned char>();
template Handle element_type<Complex>();

template <>
Handle single_type<double>() {
  return {H5Tcopy(H5T_NATIVE_FLOAT), H5Tclose};
}
template <>
Handle single_type<Complex>() {
  return complex_type(H5T_NATIVE_FLOAT);
}

std::uint64_t bytes_of(const Shape& shape, std::uint64_t element) {
  return std::accumulate(shape.begin(), shape.end(), element, std::multiplies<>());
}

Handle::~Handle() {
  if (id_ >= 0) {
    close_(id_);
  }
}

}  // namespace touchfield::hdf5
