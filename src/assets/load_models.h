// Models of a scene: reading, materials, placement in the scene, and checks.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "assets/loaded_scene.h"
#include "base/result.h"
#include "image/image.h"
#include "scene/load_scene.h"

namespace polymorph {

/// Reads the models and, if `textures`, their textures, and places them in the scene. `chain`:
/// chain_objects(scene). Errors: kInput.
Result<LoadedScene> load_models(const Scene& scene, std::span<const ChainObject> chain,
                                bool textures);

/// Computes the azimuth of an object's front in the scene, in radians from +z towards +x. Returns
/// nullopt if ObjectSettings::front is kAuto or the front faces straight up or down.
std::optional<double> front_azimuth(const ChainObject& object);

/// Rotates a model in file coordinates so that its axis `up` becomes +y. Its points keep their
/// order.
Model rotate_upright(Model model, UpAxis up);

/// Returns for each object the index of the first one of the same shape, size, rotation and sphere
/// settings. Such objects differ at most in position, colour and motion, so a report on the shape
/// of one holds for all.
std::vector<std::size_t> find_first_congruent(std::span<const ChainObject> chain);
/// Returns for each object the index of the first one of the same shape and sphere settings; size
/// and rotation may differ. A problem of one such object is a problem of all.
std::vector<std::size_t> find_first_similar(std::span<const ChainObject> chain);

/// Finds everything in the inputs (models, their spheres, landmarks, the environment, ...) that
/// could make prepare_scene() fail, and describes each problem in one line. Adds all objects to
/// `loaded`, with an empty model where loading failed. `cache_folder`: cache of spheres; empty:
/// none.
std::vector<std::string> find_problems(const Scene& scene, std::span<const ChainObject> chain,
                                       const std::filesystem::path& cache_folder,
                                       LoadedScene& loaded);

/// Reads the scene's environment picture; null if it has none. Errors: kInput.
Result<std::shared_ptr<const Image>> load_environment(const Scene& scene);

/// Returns one line for each blend that has a frame in which all weights are 0.
std::vector<std::string> find_weight_problems(const Scene& scene);

/// Returns an error line if the scene is a turntable of a frame (FrameSettings::still) beyond the
/// film's end; else an empty string.
std::string find_turntable_problem(const Scene& scene);

}  // namespace polymorph
