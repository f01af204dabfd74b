#include "sim/batch/run_files.h"

#include <fmt/format.h>

namespace touchfield {

std::optional<PictureFormat> picture_format(const Model& model, std::optional<PictureFormat> asked) {
  return asked || !model.scene.write.png ? asked : PictureFormat::kPng;
}

std::vector<std::string> run_files(const Model& model, std::optional<PictureFormat> asked) {
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
  if (const auto format = picture_format(model, asked)) {
    const std::string ending = to_string(*format);
    files.insert(files.end(), {"setup." + ending, "target." + ending});
    for (const MethodSpec& method : scene.solve.methods) {
      files.push_back(fmt::format("pressure_{}.{}", method.name, ending));
      for (const FieldGrid& field : model.fields) {
        files.push_back(fmt::format("field_{}_{}.{}", field.name, method.name, ending));
      }
    }
  }
  return files;
}

std::vector<std::string> study_files(PictureFormat format) {
  return {"study.log", "failed.json", "study.csv", "study.txt", "study." + to_string(format)};
}

}  // namespace touchfield
