// Content hash of everything that decides a frame's pixels. A frame file that carries the scene's
// current hash is up to date.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "assets/loaded_scene.h"
#include "base/program_identity.h"
#include "image/image.h"
#include "model/model.h"
#include "scene/load_scene.h"
#include "scene/scene.h"

namespace polymorph {

/// Hashes a model's content.
std::string model_digest(const Model& model);

/// A scene and the contents of its files.
struct SceneInputs {
  const Scene& scene;
  std::span<const ChainObject> chain;  ///< chain_objects(scene)
  std::span<const Model> models;       ///< one per object, as load_models() gives them
  const Image* environment = nullptr;  ///< null if the scene has none
  /// One per object; needed if landmarks name vertices.
  std::span<const ObjectPlacement> placements = {};
  /// One per object; needed if any is a mesh sequence.
  std::span<const std::shared_ptr<const MeshSequence>> sequences = {};
};

/// Hashes the scene's settings, its files' contents and the program. The files' paths, the working
/// folder, the description and the settings `output` do not change the hash. output.png_bits
/// decides pixels, too, but is compared with the frame's file instead (film/status.h).
std::string content_hash(const SceneInputs& inputs, std::string_view program = program_identity());

/// Hashes the inputs that all frames of a film share: the program and the contents of the scene's
/// files, without the meshes of sequences, of which each frame shows one.
std::string inputs_hash(const SceneInputs& inputs, std::string_view program = program_identity());
/// Writes the scene's settings as text, without paths, the description and `output`.
std::string settings_text(const Scene& scene);

}  // namespace polymorph
