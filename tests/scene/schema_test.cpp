#include <algorithm>
#include <functional>
#include <set>
#include <sstream>

#include <nlohmann/json.hpp>

#include "sim/core/errors.h"
#include "sim/scene/scene_table.h"
#include "sim/scene/schema_info.h"
#include "tests/support/scene_support.h"
#include "tests/support/testing.h"

namespace touchfield {
namespace {

TEST(Schema, FileForEditorsIsWhatTheReaderSays) {
  EXPECT_TRUE(text_of(source_folder() / "scenes/schema.json") == schema_json())
      << "out of date: touchfield schema --format json > scenes/schema.json";
}

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
    EXPECT_NE(schema_text(key).find(key + "\n  "), std::string::npos) << key;
  }
}

TEST(Schema, OneKeyIsFoundByTheEndOfItsPath) {
  const std::string iterations = schema_text("solve.iterations");
  EXPECT_THAT(iterations, ::testing::StartsWith("solve.iterations\n  "));
  EXPECT_THAT(iterations, ::testing::HasSubstr("value: a whole number from 1 to 100000\n  default, example: `30`\n"));
  EXPECT_THAT(schema_text("hand.pose"), ::testing::HasSubstr("body.hand.pose\n"));
  EXPECT_THAT(schema_text("solve.methods[0].surface"), ::testing::HasSubstr("\n    iterations: "));
  EXPECT_THAT([] { schema_text("solve.iteratons"); },
              ::testing::ThrowsMessage<InputError>(::testing::HasSubstr("did you mean iterations?")));
}

// A scene in which the examples of all keys have what they refer to.
constexpr const char* kWholeScene =
    "name: whole\n"
    "array: {grid: {}}\n"
    "body: {hand: {}}\n"
    "target: {box: {centre_mm: [0, 0, 200], size_mm: [9, 9, 9]}, pressure_pa: 3000}\n"
    "solve: {methods: [surface]}\n";

using Wrap = std::function<schema::Node(const schema::Node&)>;
using Visit = std::function<void(const std::string& path, const schema::Node& root)>;

// Calls visit for each key below a type that the page lists, with a map of the scene's top that has the key's example.
void visit_examples(const schema::TypeInfo& type, const std::string& path, const Wrap& wrap, const Visit& visit,
                    std::set<const schema::MapInfo*>& listed) {
  for (const schema::TypeInfo& part : type.of) {
    const Wrap inside = [&](const schema::Node& node) {
      const std::vector<schema::Node> items(std::max<std::size_t>(type.fewest, 1), node);
      return wrap(type.kind == schema::TypeInfo::Kind::kList ? schema::list(items) : node);
    };
    visit_examples(part, path, inside, visit, listed);
  }
  if (!type.map || !listed.insert(type.map.get()).second) return;
  for (const schema::KeyInfo& key : type.map->keys) {
    const std::string name = path.empty() ? key.name : path + "." + key.name;
    const Wrap inside = [&](const schema::Node& node) { return wrap(schema::example_with(*type.map, key.name, node)); };
    const schema::Node example = schema::example_of(key);
    EXPECT_NE(example.kind, schema::Node::Kind::kNull) << name;
    visit(name, inside(example));
    visit_examples(key.type, name, inside, visit, listed);
  }
}

// What the examples of some keys need besides, by the end of the key's path or of its map's.
std::vector<std::string> needed_by(const std::string& path) {
  if (path.starts_with("array.calibration")) {
    return {"array.grid=null", "array.positions={points_mm: [[-5, 0, 0], [5, 0, 0]]}"};
  }
  for (const std::string edge : {"body.edge_mm", "bodies.edge_mm", "evaluation.edge_mm"}) {
    if (path.starts_with(edge + ".")) return {(edge[3] == 'i' ? "bodies.0.edge_mm" : edge) + ".near_target=1.2"};
  }
  return {};
}

// The example of every key is what the reader takes, and a part of the resolved scene, which reads back the same. The
// files that examples name are there.
TEST(Schema, ExamplesAreReadAndReadBack) {
  const TempFolder folder;
  folder.write("array.csv", "x_mm,y_mm\n-5,0\n5,0\n");
  folder.write("calibration.csv", "channel,gain,phase_rad\n0,1,0\n1,0.9,0.2\n");
  folder.write("phases.txt", "0\n");
  folder.write("mask.txt", "1\n");
  std::filesystem::create_directory(folder.path() / "tracked");
  folder.write("tracked/a.stl", "");
  folder.write("tracked/times.csv", "file,time_s\na.stl,0\n");
  // A list of one box, a default, the numbers of a file, a rotation.
  const std::set<std::string> kWrittenOtherwise = {"boxes", "restarts", "phases_file", "quaternion_wxyz"};
  std::set<std::string> paths;
  std::set<const schema::MapInfo*> listed;
  const auto visit = [&](const std::string& path, const schema::Node& top) {
    const std::string chosen = path.substr(0, path.find('.'));
    std::vector<std::string> changes = needed_by(path);
    changes.insert(changes.begin(), chosen + "=" + schema::flow_text(top.find(chosen)->value));
    if (chosen == "bodies") changes.push_back("body=null");
    SCOPED_TRACE(path);
    const std::string resolved = resolved_yaml(read_scene_text(kWholeScene, path, folder.path(), changes));
    EXPECT_EQ(resolved_yaml(scene_from(resolved)), resolved);
    const std::string key = path.substr(path.rfind('.') + 1);
    if (!kWrittenOtherwise.contains(key)) {
      EXPECT_THAT(resolved, HasSubstr(key + ":"));
    }
    paths.insert(path);
  };
  visit_examples(
      schema::scene_codec().type, "", [](const schema::Node& top) { return top; }, visit, listed);
  EXPECT_GT(paths.size(), 250U);
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

}  // namespace
}  // namespace touchfield
