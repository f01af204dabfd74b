// HDF5 files whose values lie elsewhere, or would need code from elsewhere.

#include "sim/run/hdf5_file.h"

#include <fcntl.h>
#include <sys/file.h>

#include <hdf5.h>

#include "sim/core/child_process.h"
#include "tests/support/files.h"
#include "tests/support/testing.h"

namespace touchfield::hdf5_file_test {

constexpr auto kUserDefined = static_cast<H5L_type_t>(H5L_TYPE_UD_MIN + 1);  // the least is that of external links
constexpr H5Z_filter_t kForeignFilter = 300;
constexpr std::array<double, 4> kValues = {1, 2, 3, 4};

/// A file that `fill` writes with the C library.
void write_file(const std::string& path, const std::function<void(hid_t)>& fill) {
  const hid_t file = H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
  ASSERT_GE(file, 0);
  fill(file);
  ASSERT_EQ(H5Fget_obj_count(file, H5F_OBJ_ALL), 1);  // no identifier is left open
  H5Fclose(file);
}

/// Four numbers, stored as `list` says.
void write_values(hid_t file, const char* name, hid_t list) {
  const hsize_t size = kValues.size();
  const hid_t space = H5Screate_simple(1, &size, nullptr);
  const hid_t data = H5Dcreate2(file, name, H5T_NATIVE_DOUBLE, space, H5P_DEFAULT, list, H5P_DEFAULT);
  ASSERT_GE(data, 0);
  ASSERT_GE(H5Dwrite(data, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, kValues.data()), 0);
  H5Dclose(data);
  H5Sclose(space);
}

/// The values after `change` has set how they are stored.
std::function<void(hid_t)> stored(const std::function<void(hid_t)>& change) {
  return [change](hid_t file) {
    const hid_t list = H5Pcreate(H5P_DATASET_CREATE);
    change(list);
    write_values(file, "values", list);
    H5Pclose(list);
  };
}

/// Leaves the values as they are under the number of a plugin's filter.
void pack_by_plugin(hid_t list) {
  const H5Z_class2_t kind = {
      .version = H5Z_CLASS_T_VERS,
      .id = kForeignFilter,
      .encoder_present = 1,
      .decoder_present = 1,
      .name = "foreign",
      .can_apply = nullptr,
      .set_local = nullptr,
      .filter = [](unsigned, std::size_t, const unsigned*, std::size_t bytes, std::size_t*, void**) { return bytes; }};
  ASSERT_GE(H5Zregister(&kind), 0);
  const hsize_t size = kValues.size();
  H5Pset_chunk(list, 1, &size);
  H5Pset_filter(list, kForeignFilter, H5Z_FLAG_MANDATORY, 0, nullptr);
}

void write_virtual(hid_t file) {
  const hsize_t size = kValues.size();
  const hid_t space = H5Screate_simple(1, &size, nullptr);
  const hid_t list = H5Pcreate(H5P_DATASET_CREATE);
  H5Pset_virtual(list, space, "other.h5", "/secret", space);
  H5Dclose(H5Dcreate2(file, "values", H5T_NATIVE_DOUBLE, space, H5P_DEFAULT, list, H5P_DEFAULT));
  H5Pclose(list);
  H5Sclose(space);
}

void write_user_defined_link(hid_t file) {
  const H5L_class_t kind = {.version = H5L_LINK_CLASS_T_VERS,
                            .id = kUserDefined,
                            .comment = "to the root",
                            .create_func = nullptr,
                            .move_func = nullptr,
                            .copy_func = nullptr,
                            .trav_func = [](const char*, hid_t group, const void*, std::size_t, hid_t, hid_t) -> hid_t {
                              return H5Oopen(group, "/", H5P_DEFAULT);
                            },
                            .del_func = nullptr,
                            .query_func = nullptr};
  ASSERT_GE(H5Lregister(&kind), 0);
  H5Lcreate_ud(file, "values", kUserDefined, "", 0, H5P_DEFAULT, H5P_DEFAULT);
}

class Hdf5Content : public ::testing::Test {
 protected:
  static std::array<double, kValues.size()> values_in(const std::string& path, const std::string& name) {
    std::array<double, kValues.size()> values{};
    hdf5::read_content(path).read(name, {values.size()}, values.data());
    return values;
  }

  TemporaryDirectory directory_;
  std::string path_ = directory_.file("x.h5");
};

TEST_F(Hdf5Content, LinksWithinTheFileAreFollowed) {
  write_file(path_, [](hid_t file) {
    write_values(file, "values", H5P_DEFAULT);
    H5Lcreate_soft("/values", file, "soft", H5P_DEFAULT, H5P_DEFAULT);
    H5Lcreate_hard(file, "values", file, "hard", H5P_DEFAULT, H5P_DEFAULT);
  });
  for (const char* name : {"values", "soft", "hard"}) EXPECT_EQ(values_in(path_, name), kValues) << name;
}

TEST_F(Hdf5Content, WhatLeadsOutOfTheFileIsRefused) {
  write_file(directory_.file("other.h5"), [](hid_t other) { write_values(other, "secret", H5P_DEFAULT); });
  const auto external = [](const char* target, const char* name) {
    return [=](hid_t file) { H5Lcreate_external("other.h5", target, file, name, H5P_DEFAULT, H5P_DEFAULT); };
  };
  const auto by_way_of_another = [&](hid_t file) {
    H5Lcreate_soft("/b/secret", file, "values", H5P_DEFAULT, H5P_DEFAULT);
    external("/", "b")(file);
  };
  const std::vector<std::pair<std::function<void(hid_t)>, std::string>> cases = {
      {external("/secret", "values"), "into another file"},
      {by_way_of_another, "cannot open"},
      {write_user_defined_link, "user-defined"},
      {stored([&](hid_t list) { H5Pset_external(list, directory_.file("values.bin").c_str(), 0, H5F_UNLIMITED); }),
       "external storage"},
      {write_virtual, "virtual dataset"},
      {stored(pack_by_plugin), "packed by filter 300"}};
  for (const auto& [fill, phrase] : cases) {
    write_file(path_, fill);
    H5Zunregister(kForeignFilter);
    EXPECT_THAT(message_of<InputError>([&] { values_in(path_, "values"); }),
                AllOf(HasSubstr(path_ + ": /values"), HasSubstr(phrase)));
  }
}

TEST_F(Hdf5Content, AForeignLockIsNotInTheWay) {
  write_file(path_, [](hid_t file) { write_values(file, "values", H5P_DEFAULT); });
  const Descriptor other(::open(path_.c_str(), O_RDWR | O_CLOEXEC));
  ASSERT_EQ(::flock(other.number(), LOCK_EX), 0);
  EXPECT_EQ(values_in(path_, "values"), kValues);
}

TEST_F(Hdf5Content, AnotherShapeIsRefused) {
  const hdf5::MemoryFile file(path_);
  const std::vector<double> zeros(1 << 16, 0.0);  // chunked
  file.root().write("zeros", zeros.data(), {zeros.size()}, "1");
  write_bytes(path_, file.bytes());
  const hdf5::Content content = hdf5::read_content(path_);
  EXPECT_EQ(content.shape("zeros"), (hdf5::Shape{zeros.size()}));
  std::vector<double> out(3);
  EXPECT_THAT(message_of<InputError>([&] { content.read("zeros", {3}, out.data()); }),
              AllOf(HasSubstr("zeros"), HasSubstr("[65536]"), HasSubstr("[3]")));
}

}  // namespace touchfield::hdf5_file_test
