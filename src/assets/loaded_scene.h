// Loaded scene: its objects' models in scene coordinates, with the transforms from their files.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "base/box.h"
#include "model/model.h"
#include "model/transform.h"
#include "scene/scene.h"

namespace polymorph {

/// Transform of an object from its file's coordinates to those of the scene.
struct ObjectPlacement {
  Transform to_scene;            ///< upright() (load_object.h), followed by all `steps`
  std::vector<Transform> steps;  ///< transforms that follow upright(), in order of application
  Box box;                       ///< bounding box in the file's coordinates
  std::vector<Vec3> vertices;    ///< vertices as in the file; empty unless a landmark names one
};

/// Maximum number of poses (meshes of a sequence that takes part in a morph) per object that are in
/// memory besides the reference mesh.
inline constexpr int kMaxCachedPoses = 2;

/// A mesh of a sequence.
struct MeshFile {
  std::filesystem::path file;
  int number = 0;          ///< number in the sequence (ObjectSettings::range)
  std::string digest;      ///< model_digest() of the mesh as it was read
  std::string velocities;  ///< hash of the velocities that the file stores; empty: none
  /// Hash of its faces. In two meshes with equal hashes, points of equal index correspond.
  std::string topology;
  std::string problem;  ///< reason why the mesh cannot be shown; empty if it can
};

/// Textures that are in use, by pixel_digest().
struct TexturePool {
  std::mutex mutex;
  std::map<std::string, std::weak_ptr<const Texture>> textures;
};

/// A mesh sequence of a scene. Each mesh is read when it is shown.
struct MeshSequence {
  ObjectSettings object;         ///< settings of the sequence
  std::vector<MeshFile> files;   ///< files in the order of play
  int reference = 0;             ///< index of the first mesh that can be shown; plans use its pose
  std::vector<Transform> steps;  ///< ObjectPlacement::steps, the same for all meshes
  std::uint64_t max_bytes = 0;   ///< model_bytes() (memory_estimate.h) of the largest mesh
  std::size_t max_triangles = 0, max_textures = 0;  ///< maxima over the meshes
  /// Pool from which meshes with equal textures share them.
  std::shared_ptr<TexturePool> textures;
};

/// The models of all actors, loaded and arranged.
struct LoadedScene {
  /// One model per object of chain_objects(scene). For a mesh sequence it has no faces, only the
  /// outermost points of all its meshes, and the names of all their labels.
  std::vector<Model> models;
  std::vector<std::shared_ptr<const MeshSequence>> sequences;  ///< one per model; null: none
  /// One per model: the reference mesh of a sequence in a morph; empty for every other object.
  std::vector<Model> references;
  std::vector<ObjectPlacement> placements;  ///< one per model
  std::vector<std::string> warnings;        ///< one line each, about the files

  /// Returns the model that an object's balls are fitted to; it is empty for a sequence that plays
  /// alone.
  const Model& fitted_model(std::size_t object) const {
    return sequences[object] ? references[object] : models[object];
  }
};

}  // namespace polymorph
