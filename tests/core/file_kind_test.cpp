#include "sim/core/file_kind.h"

#include <string>

#include "tests/support/testing.h"

namespace touchfield::file_kind_test {

using namespace std::string_literals;

TEST(FileKind, IsNamedByItsFirstBytes) {
  const auto kind = [](const std::string& bytes) { return foreign_kind(bytes).value_or("none"); };
  EXPECT_EQ(kind("version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 1\n"),
            "a Git LFS pointer, not the file itself: run git lfs pull");
  EXPECT_THAT(kind("<html lang=en>"), StartsWith("an HTML page"));
  EXPECT_THAT(kind("\xEF\xBB\xBF\r\n <!doctype HTML>"), StartsWith("an HTML page"));
  EXPECT_THAT(kind("\x1F\x8B\x08\0"s), StartsWith("a gzip file"));
  EXPECT_THAT(kind("PK\x03\x04"), StartsWith("a zip archive"));
  EXPECT_THAT(kind("\xFD"
                   "7zXZ\0"s),
              StartsWith("an xz file"));
  EXPECT_EQ(kind("%PDF-1.7\n"), "a PDF document");
  EXPECT_EQ(kind("\x89HDF\r\n\x1A\n"), "an HDF5 file");
  EXPECT_EQ(kind("\xFF\xFE"
                 "n\0"s),
            "UTF-16 text: save it as UTF-8");
  EXPECT_EQ(kind("\xFE\xFF\0n"s), "UTF-16 text: save it as UTF-8");
  EXPECT_EQ(kind("n\0a\0m\0"s), "UTF-16 text: save it as UTF-8");
  EXPECT_EQ(kind("\0n\0a\0m"s), "UTF-16 text: save it as UTF-8");
  EXPECT_EQ(kind("\xFF\xFE\0\0n\0\0\0"s), "UTF-32 text: save it as UTF-8");
}

TEST(FileKind, IsNothingElse) {
  for (const std::string& bytes : {""s, "n"s, "name: a\n"s, "version 1\n"s, "ply\n"s, "<VTKFile>"s, "<?xml?>"s,
                                   "\xEF\xBB\xBFname: a"s, std::string(80, '\0'), "PK"s, "\x1F"s}) {
    EXPECT_FALSE(foreign_kind(bytes)) << bytes;
  }
  EXPECT_EQ(message_of<InputError>([] { refuse_foreign("%PDF-1.4", "a.stl"); }), "a.stl: this is a PDF document");
  EXPECT_EQ(and_what_it_is("%PDF-1.4"), ": it is a PDF document");
  EXPECT_EQ(and_what_it_is("ply\n"), "");
}

}  // namespace touchfield::file_kind_test
