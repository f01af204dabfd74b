#include "sim/jobs/run_model.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "sim/core/files.h"
#include "sim/jobs/felt_result.h"
#include "sim/model/stages.h"
#include "sim/pictures/figures.h"
#include "sim/run/run_file.h"
#include "sim/run/run_text.h"
#include "sim/run/text_table.h"
#include "sim/run/vtk_files.h"
#include "sim/view/view_page.h"

namespace touchfield {

namespace {

const std::string kSceneHeader =
    "# The scene of this run with all defaults. Compute it again: touchfield run scene.yaml\n";

/// Files for ParaView, and one that opens them together: the skin that was evaluated, the array, the fields.
void write_vtk(const WriteSpec& write, const Run& run, const RunDirectory& directory) {
  std::vector<std::string> together;
  if (write.vtp) {
    write_surface_vtp(directory.file("surface.vtp"), run);
    write_array_vtp(directory.file("array.vtp"), run);
    if (run.evaluation_model) {
      write_evaluation_vtp(directory.file("evaluation.vtp"), run);
    }
    together = {run.evaluation_model ? "evaluation.vtp" : "surface.vtp", "array.vtp"};
  }
  if (write.vti) {
    for (const FieldResult& field : run.fields) {
      if (field.grid.size() == 1) {
        continue;  // nothing to see
      }
      together.push_back(field.grid.name + ".vti");
      write_field_vti(directory.file(together.back()), run, field);
    }
  }
  if (!together.empty()) {
    write_blocks(directory.file("run.vtm"), together);
  }
}

constexpr std::size_t kLongest = 100'000'000;  // of a picture [bytes]

/// The pictures, and the page that shows them.
void draw(const Run& run, const RunDirectory& directory, Progress& progress) {
  timed(progress, "draw pictures", [&] {
    const std::string overview = directory.file("overview.png");
    draw_figures(directory.path(), run);
    write_text_file(directory.file("scene.yaml"), kSceneHeader + run.scene);
    write_text_file(directory.file("report.html"),
                    run_page(run, has_overview(run) ? read_whole_file(overview, kLongest) : ""));
  });
}

void write_tables(const WriteSpec& write, const Run& run, const RunDirectory& directory) {
  if (write.h5) {
    write_run_file(directory.file("run.h5"), run);
  }
  write_metrics_csv(directory.file("metrics.csv"), run);
}

void write_results(Run& run, const WriteSpec& write, const RunDirectory& directory, Progress& progress) {
  timed(progress, run.seconds, "write", "write results", [&] {
    write_vtk(write, run, directory);
    write_tables(write, run, directory);
  });
  if (write.png) {
    draw(run, directory, progress);
  }
}

std::vector<std::string> run_files(const Scene& scene) {
  std::vector<std::string> files = {"run.log", "failed.json", "metrics.csv"};
  if (scene.write.h5) {
    files.emplace_back("run.h5");
  }
  if (scene.write.vtp) {
    files.insert(files.end(), {"surface.vtp", "array.vtp", "evaluation.vtp"});
  }
  if (scene.write.vti) {
    for (const FieldSpec& field : scene.fields) {
      files.push_back(field.name + ".vti");
    }
  }
  if (scene.write.vtp || scene.write.vti) {
    files.emplace_back("run.vtm");
  }
  if (scene.write.png) {
    files.insert(files.end(), {"scene.yaml", "report.html", "overview.png"});
    for (const FieldSpec& field : scene.fields) {
      files.push_back(fmt::format("field_{}.png", field.name));
    }
  }
  if (scene.felt) {
    std::ranges::copy(felt_files(scene.write), std::back_inserter(files));
  }
  return files;
}

Json run_result(const Run& run, const std::string& directory) {
  Json result = {{"name", run.name},
                 {"directory", directory},
                 {"faces", run.mesh.face_count()},
                 {"channels", run.array.size()},
                 {"methods", method_values(run)},
                 {"seconds", stage_values(run.seconds)},
                 {"warnings", run.warnings},
                 {"notes", run.notes}};
  result.update(levels_value(run));
  return result;
}

}  // namespace

Job<Run> run_job(const Model& model, const SolveOptions& options) {
  const Scene& scene = model.fixed->scene;
  const auto compute = [&model, &scene, options](RunDirectory& directory, Progress& progress) {
    std::vector<std::string> names;
    std::ranges::transform(scene.solve.methods, std::back_inserter(names), &MethodSpec::name);
    directory.plan(names);
    const auto keep = [&](const Run& so_far) {
      write_tables(scene.write, so_far, directory);
      directory.finished(so_far.methods.back().name);
    };
    Run run = solve_model(model, options, keep, progress);
    add_felt(run, scene, directory, progress);
    write_results(run, scene.write, directory, progress);
    return run;
  };
  return {scene.name, run_files(scene), compute, run_result, [](const Run& run, const Json& value, bool terse) {
            return methods_table(run) + levels_text(run) + (terse ? value["directory"].get<std::string>() + "\n" : "");
          }};
}

Job<Run> written_job(Run run, const Scene& scene) {
  return {scene.name, run_files(scene),
          [run = std::move(run), write = scene.write](RunDirectory& directory, Progress& progress) mutable {
            write_results(run, write, directory, progress);
            return std::move(run);
          }};
}

}  // namespace touchfield
