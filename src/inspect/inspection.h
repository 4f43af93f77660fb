// Descriptions of files: images, models, scenes and their frames.
#pragma once

#include <filesystem>
#include <string>

#include "base/json.h"
#include "base/result.h"
#include "kernels/engine.h"
#include "scene/scene.h"
#include "sequence/prepare/prepared_scene.h"

namespace polymorph {

/// The description of a file: for programs, and in lines for people.
struct Inspection {
  JsonValue json;
  std::string text;
};

/// Size, channels with their ranges, and attributes. Errors: those of read_image().
Result<Inspection> inspect_image(const std::string& file);

/// Counts, topology, size and problems; warnings go to the log. Errors: those of load_model().
Result<Inspection> inspect_model(const std::string& file);

/// Objects, and the frames of each stage. The JSON is null: scene_to_json() has every setting.
Inspection inspect_scene(const std::string& file, const Scene& scene);

/// The state of each actor in each frame.
Inspection inspect_timeline(const Scene& scene);

/// The plan of each leg: which limb becomes which, the turn, and how much is left between the ends;
/// where a chain ends with the object that it begins with, and for a blend, whether its plans are
/// consistent. Plans that only the comparison needs are made, or read from the folder `cache`.
Inspection inspect_plan(const PreparedScene& prepared, Engine& engine,
                        const std::filesystem::path& cache);

}  // namespace polymorph
