// Scenes of the command `demo`, made of models and effects of the program's data folder. An effect
// is an example scene whose settings and intermediate objects are applied to other objects.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/json.h"
#include "base/result.h"

namespace polymorph {

/// A model or effect that the command line can name.
struct NamedFile {
  std::string name;         ///< name on the command line
  std::string description;  ///< description of an effect's scene; empty for a model
  std::filesystem::path file;
};

/// Lists models/*.obj of the data folder, sorted by name.
std::vector<NamedFile> demo_models(const std::filesystem::path& data);

/// Lists the effects of effects/*.json that suit any two objects, sorted by name. Such an effect
/// has a single chain and no settings for parts of its own models (plan.labels, plan.landmarks).
/// Errors (kInput): a file that is unreadable or no JSON object.
Result<std::vector<NamedFile>> demo_effects(const std::filesystem::path& data);

/// Makes a scene that morphs `from` to `to`, each a demo model, a built-in shape or a model file.
/// It is small enough to render in seconds. `through` is an effect, or an object between the two,
/// or empty. The scene takes over the settings and intermediate objects of an effect; an effect's
/// source or target becomes an intermediate object, too, if it is a shape. Paths are relative to
/// `folder`, where the scene will be. Errors (kUsage): an unknown name; the message suggests the
/// nearest one.
Result<JsonValue> demo_scene(const std::filesystem::path& data, const std::string& from,
                             const std::string& to, const std::string& through,
                             const std::filesystem::path& folder);

}  // namespace polymorph
