// Scene of the command `init`: the user's models, and the settings that most scenes change.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/json.h"
#include "base/result.h"

namespace polymorph {

/// Makes a file's name relative to `folder`, so that a scene there and its models can be moved
/// together.
std::string relative_name(const std::filesystem::path& file, const std::filesystem::path& folder);

/// Makes a scene that morphs the first model file to the last, through those between. There must be
/// at least two. The scene file will be in `folder`. Errors (kInput): a file that is missing or no
/// model, or a name that is not UTF-8.
Result<JsonValue> initial_scene(const std::vector<std::string>& models,
                                const std::filesystem::path& folder);

}  // namespace polymorph
