#include <cstdlib>
#include <set>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/scene_support.h"

namespace touchfield {
namespace {

using testing::scene_from;
using testing::source_folder;
using testing::text_of;

struct Page {
  std::string file;  // in scenes/
  std::string (*made)();
};

class SchemaPage : public ::testing::TestWithParam<Page> {};

// The pages in scenes/ are made by the reader: `touchfield schema --format ...`, or this test with
// TOUCHFIELD_UPDATE_SCHEMA set, writes them anew.
TEST_P(SchemaPage, IsWhatTheReaderSays) {
  const auto file = source_folder() / "scenes" / GetParam().file;
  if (std::getenv("TOUCHFIELD_UPDATE_SCHEMA") != nullptr) std::ofstream(file, std::ios::binary) << GetParam().made();
  EXPECT_TRUE(text_of(file) == GetParam().made())
      << file << " is out of date: TOUCHFIELD_UPDATE_SCHEMA=1 writes it anew";
}

INSTANTIATE_TEST_SUITE_P(Scenes, SchemaPage,
                         ::testing::Values(Page{"README.md", schema_markdown}, Page{"schema.json", schema_json}),
                         [](const auto& info) { return info.param.file.substr(0, info.param.file.find('.')); });

// Every key of a schema, with its description.
void collect_keys(const nlohmann::json& schema, std::set<std::string>& keys) {
  if (schema.contains("properties")) {
    for (const auto& [key, property] : schema["properties"].items()) {
      keys.insert(key);
      EXPECT_FALSE(property.value("description", "").empty()) << key;
      collect_keys(property, keys);
    }
    EXPECT_EQ(schema["additionalProperties"], false);
  }
  if (schema.contains("items")) collect_keys(schema["items"], keys);
  for (const auto& part : schema.value("anyOf", nlohmann::json::array())) collect_keys(part, keys);
}

std::set<std::string> all_keys() {
  std::set<std::string> keys;
  collect_keys(nlohmann::json::parse(schema_json()), keys);
  return keys;
}

TEST(Schema, PageNamesEveryKey) {
  const auto keys = all_keys();
  EXPECT_GE(keys.size(), 60U);
  for (const std::string known : {"name", "sound_speed_m_s", "phases_file", "landmarks", "centre_mm", "random"}) {
    EXPECT_TRUE(keys.contains(known)) << known;
  }
  const std::string page = schema_markdown();
  for (const auto& key : keys) {
    EXPECT_NE(page.find("| `" + key + "` |"), std::string::npos) << key;
  }
}

// The template says that its last lines are a motion once their # is gone.
TEST(Schema, TheTemplatesCommentsAreAMotion) {
  std::istringstream lines(text_of(source_folder() / "scenes/template.yaml"));
  std::string text;
  bool moves = false;
  for (std::string line; std::getline(lines, line);) {
    moves = moves || line == "# motion:";
    text += (moves ? line.substr(2) : line) + "\n";
  }
  ASSERT_TRUE(moves);
  const Scene scene = scene_from(text);
  ASSERT_TRUE(scene.motion);
  EXPECT_EQ(scene.motion->changes.size(), 2U);
}

// The defaults that the schema tells editors are those the reader fills in.
TEST(Schema, DefaultsAreTheReaders) {
  const auto schema = nlohmann::json::parse(schema_json());
  EXPECT_EQ(schema["properties"]["frequency_khz"]["default"], 40);
  EXPECT_EQ(schema["properties"]["array"]["properties"]["grid"]["properties"]["count"]["default"],
            nlohmann::json::parse("[44, 34]"));
  EXPECT_EQ(schema["properties"]["solve"]["properties"]["iterations"]["maximum"], 100000);
  EXPECT_EQ(schema["properties"]["solve"]["properties"]["tolerance"]["default"], 1e-4);
  EXPECT_EQ(schema["properties"]["judge"]["default"], "auto");
  EXPECT_EQ(schema["properties"]["array"]["properties"]["level"]["exclusiveMinimum"], 0);
}

}  // namespace
}  // namespace touchfield
