#include "sim/store/hdf5_calls.h"

#include <fmt/format.h>
#include <hdf5.h>

#include "sim/core/errors.h"
#include "sim/core/types.h"

namespace touchfield::hdf5 {

namespace {

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

}  // namespace

void fail(const std::string& place, std::string_view what) { throw IoError(fmt::format("{}: {}", place, what)); }

void fail_with_reason(const std::string& place, std::string_view what) {
  fail(place, fmt::format("{} ({})", what, reason()));
}

Handle checked_handle(std::int64_t id, Handle::Close close, const std::string& place, std::string_view what) {
  return {checked(id, place, what), close};
}

std::string joined(const std::string& place, const std::string& name) {
  return place.ends_with('/') ? place + name : fmt::format("{}/{}", place, name);
}

std::string attribute_place(const std::string& place, const std::string& name) {
  return fmt::format("{}: attribute {}", place, name);
}

Handle complex_type() {
  Handle type(H5Tcreate(H5T_COMPOUND, sizeof(Complex)), H5Tclose);
  H5Tinsert(type.id(), "r", 0, H5T_NATIVE_DOUBLE);
  H5Tinsert(type.id(), "i", sizeof(double), H5T_NATIVE_DOUBLE);
  return type;
}

Handle text_type() {
  Handle type(H5Tcopy(H5T_C_S1), H5Tclose);
  H5Tset_size(type.id(), H5T_VARIABLE);
  H5Tset_cset(type.id(), H5T_CSET_UTF8);
  return type;
}

Handle::~Handle() {
  if (id_ >= 0) {
    close_(id_);
  }
}

}  // namespace touchfield::hdf5
