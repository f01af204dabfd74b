
#include "tests/support/scene_support.h"
#include "tests/support/testing.h"

namespace touchfield {
namespace {

std::vector<std::string> problems_with(const std::vector<std::string>& overrides,
                                       const std::string& text = kSmallScene) {
  const TempFolder folder;
  return problems_of(folder.write("scene.yaml", text), overrides);
}

TEST(SceneOverrides, LaterOnesSeeEarlierOnes) {
  const Scene scene = scene_from(kSmallScene, {"body.place.at_mm=[0, 0, 250]", "body.place.at_mm.2=150",
                                               "body.place.at_mm[0]=10", "name=a", "name=b"});
  EXPECT_EQ(scene.bodies.at(0).place.at, Vector3(0.01, 0, 0.15));
  EXPECT_EQ(scene.name, "b");
}

TEST(SceneOverrides, NameItemsByNumber) {
  const std::string text =
      "name: items\n"
      "array: {grid: {}}\n"
      "body: {sphere: {radius_mm: 8}, edge_mm: 2}\n"
      "target: {boxes: [{at: top, size_mm: [1, 1, 1]}, {at: bottom, size_mm: [2, 2, 2]}]}\n"
      "solve: {methods: [paper, {focus: {as: f}}]}\n";
  const Scene scene =
      scene_from(text, {"target.boxes.1.size_mm.0=5", "solve.methods[0]=unscattered", "solve.methods.1.focus.as=g"});
  EXPECT_EQ(scene.target->boxes[1].size, Vector3(5e-3, 2e-3, 2e-3));
  EXPECT_EQ(scene.target->boxes[0].size, Vector3(1e-3, 1e-3, 1e-3));
  EXPECT_EQ(scene.solve.methods[0].kind->name, "unscattered");
  EXPECT_EQ(scene.solve.methods[1].name, "g");
}

TEST(SceneOverrides, NullTakesAKeyAway) {
  const Scene scene = scene_from(kSmallScene, {"array.grid=null", "array.plane_wave={}", "evaluation=~"});
  EXPECT_TRUE(std::holds_alternative<PlaneWaveArray>(scene.array.layout));
  EXPECT_EQ(scene.evaluation.kind, EvaluationSpec::Kind::kAuto);
  // What was taken away can be given anew.
  const Scene again = scene_from(kSmallScene, {"array.grid=null", "array.grid.count=[2, 3]"});
  EXPECT_THAT(std::get<GridArray>(again.array.layout).count, ElementsAre(2, 3));
}

TEST(SceneOverrides, TheOtherQuantityOfATargetIsTakenAwayFirst) {
  const std::string target = "target={box: {at: top, size_mm: [4, 4, 4]}, ";
  const auto refused = [&](const std::string& of_scene, const std::string& change) {
    return problems_with({target + of_scene + "}", change});
  };
  EXPECT_THAT(refused("pressure_pa: 300", "target.radiation_pa=30"),
              ElementsAre("--set target.radiation_pa=30: target.radiation_pa: cannot be given with "
                          "pressure_pa; take that away, in changes of a scene by target.pressure_pa: null or "
                          "--set target.pressure_pa=null"));
  EXPECT_THAT(refused("radiation_pa: 30", "target.pressure_pa=best"),
              ElementsAre(StartsWith("--set target.pressure_pa=best: target.pressure_pa: cannot be given with "
                                     "radiation_pa; take that away")));
  const Scene scene =
      scene_from(kSmallScene, {target + "pressure_pa: 300}", "target.pressure_pa=null", "target.radiation_pa=30"});
  EXPECT_EQ(scene.target->quantity, TargetQuantity::kRadiation);
  EXPECT_EQ(scene.target->pressure, 30.0);
}

TEST(SceneOverrides, ProblemsNameTheOverride) {
  const std::string target = "target={box: {at: top, size_mm: [4, 4, 4]}}";
  EXPECT_THAT(problems_with({"solve.methods=[focus]", target}), IsEmpty());
  const std::pair<std::vector<std::string>, std::string> table[] = {
      {{"array.level=2"}, "--set array.level=2: array.level = 2 must be > 0 and <= 1"},
      {{"medium={humidty_percent: 3}"}, "medium.humidty_percent: unknown key, did you mean humidity_percent?"},
      {{"array.at_mm=1,-2,3"}, ": array.at_mm = 1,-2,3 must be a list of 3 numbers; write [1,-2,3]"},
      {{"write=h5, vtp"}, "; write [h5,vtp]"},
      {{"array.plane_wave={}"}, "--set array.plane_wave={}: array: grid and plane_wave given, must be exactly one of"},
      {{"body.edge_mm=null"}, "scene.yaml:3:7: body.edge_mm: missing, must be given with sphere"},
      {{"solve.methods=[focus]", target, "target=null"}, "solve.methods[0]: focus needs a target"}};
  for (const auto& [overrides, phrase] : table) {
    EXPECT_THAT(problems_with(overrides), ElementsAre(HasSubstr(phrase)));
  }
  EXPECT_THAT(problems_with({"frequency_khz=0"}, kSmallScene + "evaluation: nobody\n"),
              ElementsAre(HasSubstr("scene.yaml:5:13: evaluation = nobody must be one of auto, same, none or a map"),
                          "--set frequency_khz=0: frequency_khz = 0 must be 1 to 200"));
}

TEST(SceneOverrides, PathsThatLeadNowhereAreRefused) {
  std::vector<std::pair<std::string, std::string>> table = {
      {"name=", "no value; null removes a key"},
      {"name=[1", "not YAML: end of sequence flow not found"},
      {"name.first=a", "name is small, not a map or list"},
      {"solve.methods.1=paper", "solve.methods.1 names no item of solve.methods, which has 1"},
      {"solve.methods.first=paper", "solve.methods.first names no item of solve.methods, which has 1"},
      {"solve.methods.0=null", "solve.methods.0: null removes keys, not items of a list"},
      {"body.place.at_mm.2=250", "body.place.at_mm is not a list in the scene, give it as a whole"},
      {"target.box=null", "target is not in the scene, nothing to remove"},
      {"array.gird=null", "array.gird: unknown key, did you mean grid?"}};
  for (const char* text : {"", "name", "=5", ".name=5", "array..level=1", "array.=1", "array[=1", "a]b=1", "a[0]b=1"}) {
    table.emplace_back(text, "must be key.path=value");
  }
  for (const auto& [text, phrase] : table) {
    EXPECT_THAT(problems_with({text}), ElementsAre(StartsWith("--set " + text + ": " + phrase)));
  }
}

}  // namespace
}  // namespace touchfield
