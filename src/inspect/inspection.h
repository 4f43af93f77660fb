// Descriptions of files: images, models, scenes and their frames.
#pragma once

#include <filesystem>
#include <string>

#include "base/json.h"
#include "base/result.h"
#include "kernels/engine.h"
#include "model/repair/diagnose.h"
#include "scene/scene.h"
#include "sequence/prepare/prepared_scene.h"

namespace polymorph {

/// Description of a file, as JSON and as text.
struct Inspection {
  JsonValue json;
  std::string text;  ///< lines, each with a newline
};

/// Describes an image: size, channels with their ranges, attributes. Errors: those of read_image().
Result<Inspection> inspect_image(const std::string& file);

/// Describes a model: counts, topology, size, problems. Logs the warnings of its loading. Errors:
/// those of load_model().
Result<Inspection> inspect_model(const std::string& file);

/// Converts the main results of a diagnosis to JSON: counts, topology, volume and area.
JsonValue to_json(const Diagnosis& diagnosis);
/// Returns "closed, genus 1" or "not closed".
std::string describe_topology(const Diagnosis& diagnosis);

/// Describes a scene: its objects, and the frames of each stage. The JSON is null, because
/// scene_to_json() has every setting.
Inspection inspect_scene(const std::string& file, const Scene& scene);

/// Describes the state of each actor in each frame.
Inspection inspect_timeline(const Scene& scene);

/// Describes the plan of each leg: the matched limbs, the rotation, and the distance that remains
/// between matched balls. Measures the consistency of plans that form a cycle (morph/plan_cycle.h):
/// the plans of an actor whose last object is its first one, and those of a blend of three objects
/// or more. The plans that only a blend's cycles need are made with `engine`, or read from the
/// folder `cache`.
Inspection inspect_plan(const PreparedScene& prepared, Engine& engine,
                        const std::filesystem::path& cache);

}  // namespace polymorph
