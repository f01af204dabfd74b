#include "sim/batch/run_files.h"

#include <fmt/format.h>

namespace touchfield {

std::vector<std::string> run_files(const Model& model) {
  const Scene& scene = model.scene;
  std::vector<std::string> files = {"run.log", "failed.json", "metrics.csv"};
  if (scene.write.h5) {
    files.emplace_back("run.h5");
  }
  if (scene.write.vtp) {
    files.insert(files.end(), {"surface.vtp", "array.vtp", "judge.vtp"});
  }
  if (scene.write.vti) {
    for (const FieldGrid& field : model.fields) {
      files.push_back(field.name + ".vti");
    }
  }
  if (scene.write.png) {
    files.emplace_back("target.png");
    for (const MethodSpec& method : scene.solve.methods) {
      files.push_back(fmt::format("pressure_{}.png", method.name));
      for (const FieldGrid& field : model.fields) {
        files.push_back(fmt::format("field_{}_{}.png", field.name, method.name));
      }
    }
  }
  return files;
}

std::vector<std::string> study_files() { return {"study.log", "failed.json", "study.csv", "study.txt", "study.png"}; }

}  // namespace touchfield
