// The scene that `init` writes: a user's own models, and the settings that most scenes change.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/json.h"
#include "base/result.h"

namespace polymorph {

/// Name of a file for a scene in `folder`: relative, so that scene and models can move together.
std::string relative_name(const std::filesystem::path& file, const std::filesystem::path& folder);

/// A scene from the first model file to the last through those between, for a scene file in
/// `folder`. Errors (kInput): a file that is missing or no model, or whose name JSON cannot hold.
Result<JsonValue> initial_scene(const std::vector<std::string>& models,
                                const std::filesystem::path& folder);

}  // namespace polymorph
