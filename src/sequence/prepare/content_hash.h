// Content hash of everything that decides a frame's pixels; files that carry it are up to date.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "base/program_identity.h"
#include "image/image.h"
#include "model/model.h"
#include "scene/load_scene.h"
#include "scene/scene.h"
#include "sequence/prepare/loaded_scene.h"

namespace polymorph {

/// Hash of a model's content.
std::string model_digest(const Model& model);

/// A scene and the contents of its files.
struct SceneInputs {
  const Scene& scene;
  std::span<const ChainObject> chain;  ///< chain_objects(scene)
  std::span<const Model> models;       ///< one per object, as load_models() gives them
  const Image* environment = nullptr;
  /// One per object, too, where landmarks may name vertices.
  std::span<const ObjectPlacing> placings = {};
  /// One per object, too, where any is a mesh sequence.
  std::span<const std::shared_ptr<const MeshSequence>> sequences = {};
};

/// Hash of the scene's settings, its files' contents and the program. Contents count and not
/// spellings: neither the files' places nor the folder that the program was started from changes
/// it, nor does `output`: the bits of a PNG are looked up in the file (run/status.h).
std::string content_hash(const SceneInputs& inputs, std::string_view program = program_identity());

/// Hash of the part that is the same in all frames of a film: the contents of the scene's files
/// but the meshes of sequences, and the program.
std::string inputs_hash(const SceneInputs& inputs, std::string_view program = program_identity());
/// The other part: the settings as text.
std::string settings_text(const Scene& scene);

}  // namespace polymorph
