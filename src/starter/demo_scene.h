// The scenes that `demo` composes: models and effects by name, from the program's data folder.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/json.h"
#include "base/result.h"

namespace polymorph {

struct NamedFile {
  std::string name;         ///< word of the command line
  std::string description;  ///< description of an effect's scene
  std::filesystem::path file;
};

/// models/*.obj of the data folder, in order of name.
std::vector<NamedFile> demo_models(const std::filesystem::path& data);

/// Effects of effects/*.json that any two objects can pass: one chain, and nothing about the parts
/// of its own models (plan.labels, plan.landmarks). In order of name. Errors: a file that cannot be
/// read.
Result<std::vector<NamedFile>> demo_effects(const std::filesystem::path& data);

/// A scene from `from` to `to`, each a demo model, a built-in shape or a model file, small enough
/// for seconds. `through`: an effect, whose settings and objects on the way are taken over, with
/// ends that are shapes as objects on the way too; or an object, which is formed on the way; or
/// empty. Paths are relative to `folder`, where the scene will be. Errors (kUsage): an unknown
/// name; the message has the nearest.
Result<JsonValue> demo_scene(const std::filesystem::path& data, const std::string& from,
                             const std::string& to, const std::string& through,
                             const std::filesystem::path& folder);

}  // namespace polymorph
