// Models of a scene: read, coloured, turned and put in their places; and what is wrong with them.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/result.h"
#include "image/image.h"
#include "scene/load_scene.h"
#include "sequence/prepare/loaded_scene.h"

namespace polymorph {

/// `chain`: chain_objects(scene).
Result<LoadedScene> load_models(const Scene& scene, std::span<const ChainObject> chain,
                                bool textures);

/// The azimuth of an object's front in its place, radians from +z towards +x; nothing where the
/// scene does not say which side that is, or it looks straight up or down.
std::optional<double> front_azimuth(const ChainObject& object);

/// Turns a model, as it was read, so that its axis `up` points up. Its points keep their order.
Model turned_upright(Model model, UpAxis up);

/// For each object the index of the first that has the same shape, size and spheres: they differ at
/// most in their places, colours and motions. What is said about the shape of one holds for all.
std::vector<std::size_t> find_alike(std::span<const ChainObject> chain);
/// For each object the index of the first of the same shape that also may be turned otherwise and
/// of another size: what is wrong with one is wrong with all.
std::vector<std::size_t> find_similar(std::span<const ChainObject> chain);

/// Finds what is wrong with the models, their spheres and the environment, one line each:
/// everything that could stop prepare_scene() but the machine. `loaded` gets what could be loaded,
/// empty models where not.
std::vector<std::string> find_problems(const Scene& scene, std::span<const ChainObject> chain,
                                       const std::filesystem::path& cache_folder,
                                       LoadedScene& loaded);

/// The scene's environment picture; null where it has none. Errors: kInput.
Result<std::shared_ptr<const Image>> load_environment(const Scene& scene);

/// Names the blends that have a frame in which all weights are 0.
std::vector<std::string> weight_problems(const Scene& scene);

/// Reason for which a turntable cannot show its scene; empty if it can.
std::string turntable_problem(const Scene& scene);

}  // namespace polymorph
