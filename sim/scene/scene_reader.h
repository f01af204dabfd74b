#pragma once

#include <set>
#include <string>
#include <vector>

#include "sim/scene/scene.h"

namespace touchfield {

/// Reads and checks a scene file, or a scene that comes with the program.
///
/// path        of the file; if there is none, a name of shipped_scenes()
/// overrides   "key.path=value" as --set takes them, value in YAML; a list element is named by its number from 0
/// returns     the scene, paths in it resolved against the scene file's folder
/// throws      InputError whose message lists every problem, one per line, as `file:line:column: path: what, rule`
///             (a problem in an override: `--set key.path: ...`)
Scene read_scene(const std::string& path, const std::vector<std::string>& overrides = {});

/// The same for a scene's text, as a run or a sweep keeps it.
///
/// name       what messages call the text; empty: a program wrote it, and they name no line of it
/// folder     what relative paths in the text and in the overrides count from
/// changes    what messages call an override, instead of --set
Scene read_scene_text(const std::string& text, const std::string& name, const std::string& folder,
                      const std::vector<std::string>& overrides = {}, const std::string& changes = "--set");

/// The scene as YAML text with every default written out; read back it gives the same scene.
std::string resolved_yaml(const Scene& scene);

/// The shape of a body as YAML text: its mesh in its own frame, but for the edge lengths.
std::string shape_text(const BodySpec& body);

/// Files that a scene names and whose content its text does not hold: meshes, their tables of times, runs to start
/// from.
std::set<std::string> named_files(const Scene& scene);

/// The schema, made from the reader's own table: a Markdown page, and a JSON Schema for editors.
std::string schema_markdown();
/// The keys whose paths end with this one: meaning, value, default, example. Throws InputError if there are none.
std::string schema_text(const std::string& key);
std::string schema_json();

}  // namespace touchfield
