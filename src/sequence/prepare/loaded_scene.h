// Loaded scene: the models of its objects, in their places, and the way there from their files.
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

/// The way from an object's file to its place in the scene.
struct ObjectPlacing {
  Transform to_scene;            ///< takes the file's coordinates into the scene
  std::vector<Transform> steps;  ///< the same, after it was turned upright, step by step
  Box box;                       ///< box in the file's coordinates
  std::vector<Vec3> vertices;    ///< the file's own, where landmarks name any
};

/// Poses of one object of a morph that are in memory beside the reference.
inline constexpr int kKeptPoses = 2;

/// A mesh of a sequence.
struct MeshFile {
  std::filesystem::path file;
  int number = 0;
  std::string digest;      ///< hash of its content as it was read
  std::string velocities;  ///< hash of those that it stores; empty: none
  std::string topology;    ///< hash of its faces: vertices of meshes that share it correspond
  std::string problem;     ///< reason why it cannot be shown; empty if it can
};

/// Pictures by what they show (pixel_digest()), as long as anybody uses them.
struct TexturePool {
  std::mutex mutex;
  std::map<std::string, std::weak_ptr<const Image>> images;
};

/// A mesh sequence in its place in the scene. Its meshes are read one by one, when they are shown.
struct MeshSequence {
  ObjectSettings object;
  std::vector<MeshFile> files;   ///< files in the order of play
  int reference = 0;             ///< first mesh that can be shown; a morph is planned for its pose
  std::vector<Transform> steps;  ///< ObjectPlacing::steps, the same for all
  std::uint64_t max_bytes = 0;   ///< memory of the largest mesh with its textures
  std::size_t max_triangles = 0, max_textures = 0;
  /// Textures in use, so that meshes that show the same pictures share them.
  std::shared_ptr<TexturePool> textures;
};

/// The models of all actors, loaded and arranged.
struct LoadedScene {
  /// Actor by actor, in chain order. A mesh sequence has the outermost points of all its meshes
  /// here, without faces, and the names of all their labels.
  std::vector<Model> models;
  std::vector<std::shared_ptr<const MeshSequence>> sequences;  ///< one per model; null: none
  /// One per model: the reference mesh of a sequence in a morph, empty for every other object.
  std::vector<Model> references;
  std::vector<ObjectPlacing> placings;  ///< one per model
  std::vector<std::string> warnings;

  /// The model that the object's balls are fitted to; without faces for a sequence that plays
  /// alone.
  const Model& fitted_model(std::size_t object) const {
    return sequences[object] ? references[object] : models[object];
  }
};

}  // namespace polymorph
