// HDF5 files that would lead the reader out of themselves, or round in circles.

#include "sim/store/hdf5_content.h"

#include <array>
#include <filesystem>
#include <functional>

#include <hdf5.h>

#include "tests/support/files.h"
#include "tests/support/testing.h"

namespace touchfield::hdf5_content_test {

constexpr auto kUserDefined = static_cast<H5L_type_t>(H5L_TYPE_UD_MIN + 1);  // the least is that of external links
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

class Hdf5Content : public ::testing::Test {
 protected:
  /// What reading a file says that `fill` has written beside other.h5, which holds a dataset `secret`.
  std::string refusal(const std::function<void(hid_t)>& fill) const {
    write_file(directory_.file("other.h5"), [](hid_t other) { write_values(other, "secret", H5P_DEFAULT); });
    write_file(path_, fill);
    return message_of<InputError>([&] { hdf5::read_content(path_); });
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
  const hdf5::Content content = hdf5::read_content(path_);
  for (const char* name : {"values", "soft", "hard"}) {
    std::array<double, kValues.size()> values{};
    content.read(name, {values.size()}, values.data());
    EXPECT_EQ(values, kValues) << name;
  }
}

TEST_F(Hdf5Content, ALinkIntoAnotherFileIsRefused) {
  EXPECT_THAT(
      refusal([](hid_t file) { H5Lcreate_external("other.h5", "/secret", file, "values", H5P_DEFAULT, H5P_DEFAULT); }),
      AllOf(HasSubstr(path_ + ": /values"), HasSubstr("into another file")));
}

// The soft link comes first and leads through the other, which has not been looked at by then.
TEST_F(Hdf5Content, ASoftLinkByWayOfAnotherFileIsRefused) {
  EXPECT_THAT(refusal([](hid_t file) {
                H5Lcreate_soft("/b/secret", file, "a", H5P_DEFAULT, H5P_DEFAULT);
                H5Lcreate_external("other.h5", "/", file, "b", H5P_DEFAULT, H5P_DEFAULT);
              }),
              AllOf(HasSubstr(path_ + ": /a"), HasSubstr("cannot open")));
}

TEST_F(Hdf5Content, AUserDefinedLinkIsRefused) {
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
  EXPECT_THAT(refusal([](hid_t file) { H5Lcreate_ud(file, "values", kUserDefined, "", 0, H5P_DEFAULT, H5P_DEFAULT); }),
              AllOf(HasSubstr(path_ + ": /values"), HasSubstr("user-defined")));
}

TEST_F(Hdf5Content, ValuesInAnotherFileAreRefused) {
  EXPECT_THAT(refusal([&](hid_t file) {
                const hid_t list = H5Pcreate(H5P_DATASET_CREATE);
                H5Pset_external(list, directory_.file("values.bin").c_str(), 0, H5F_UNLIMITED);
                write_values(file, "values", list);
                H5Pclose(list);
              }),
              AllOf(HasSubstr(path_ + ": /values"), HasSubstr("external storage")));
}

TEST_F(Hdf5Content, AVirtualDatasetIsRefused) {
  EXPECT_THAT(refusal([](hid_t file) {
                const hsize_t size = kValues.size();
                const hid_t space = H5Screate_simple(1, &size, nullptr);
                const hid_t list = H5Pcreate(H5P_DATASET_CREATE);
                H5Pset_virtual(list, space, "other.h5", "/secret", space);
                H5Dclose(H5Dcreate2(file, "values", H5T_NATIVE_DOUBLE, space, H5P_DEFAULT, list, H5P_DEFAULT));
                H5Pclose(list);
                H5Sclose(space);
              }),
              AllOf(HasSubstr(path_ + ": /values"), HasSubstr("virtual dataset")));
}

TEST_F(Hdf5Content, AFilterThatNoRunUsesIsRefused) {
  EXPECT_THAT(refusal([](hid_t file) {
                const hsize_t size = kValues.size();
                const hid_t list = H5Pcreate(H5P_DATASET_CREATE);
                H5Pset_chunk(list, 1, &size);
                H5Pset_scaleoffset(list, H5Z_SO_FLOAT_DSCALE, 2);
                write_values(file, "values", list);
                H5Pclose(list);
              }),
              AllOf(HasSubstr(path_ + ": /values"), HasSubstr("packed by filter 6")));
}

TEST_F(Hdf5Content, AGroupWithinItselfIsRefused) {
  EXPECT_THAT(refusal([](hid_t file) { H5Lcreate_hard(file, "/", file, "a", H5P_DEFAULT, H5P_DEFAULT); }),
              AllOf(HasSubstr(path_ + ": /a/a/a"), HasSubstr("16 groups deep")));
}

// Ten ways at each of the 16 levels.
TEST_F(Hdf5Content, AMazeIsRefused) {
  EXPECT_THAT(refusal([](hid_t file) {
                for (int way = 0; way < 10; ++way) {
                  H5Lcreate_hard(file, "/", file, std::to_string(way).c_str(), H5P_DEFAULT, H5P_DEFAULT);
                }
              }),
              HasSubstr("16 groups deep"));
}

// The same numbers under so many names that they would fill the memory.
TEST_F(Hdf5Content, AFileThatUnfoldsWithoutEndIsRefused) {
#ifdef TOUCHFIELD_ADDRESS_SANITIZER
  GTEST_SKIP() << "the sanitizer's allocator ends a process that lacks memory";
#endif
  write_file(path_, [](hid_t file) {
    const hsize_t size = 1 << 20;
    const hid_t space = H5Screate_simple(1, &size, nullptr);
    const hid_t list = H5Pcreate(H5P_DATASET_CREATE);
    H5Pset_chunk(list, 1, &size);
    H5Pset_deflate(list, 9);
    const hid_t data = H5Dcreate2(file, "values", H5T_NATIVE_DOUBLE, space, H5P_DEFAULT, list, H5P_DEFAULT);
    const std::vector<double> zeros(size, 0.0);
    H5Dwrite(data, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, zeros.data());
    H5Dclose(data);
    H5Pclose(list);
    H5Sclose(space);
    for (int i = 0; i < 100; ++i) {
      H5Lcreate_hard(file, "values", file, std::to_string(i).c_str(), H5P_DEFAULT, H5P_DEFAULT);
    }
  });
  EXPECT_THAT(message_of<InputError>([&] { hdf5::read_content(path_); }),
              AllOf(HasSubstr(path_), AnyOf(HasSubstr("gives more than"), HasSubstr("takes more than"))));
}

}  // namespace touchfield::hdf5_content_test
