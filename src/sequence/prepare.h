// Scene preparation before the first frame: models, spheres, balls, plans, camera.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/box.h"
#include "base/result.h"
#include "field/distance_cache.h"
#include "kernels/engine.h"
#include "leg/blend.h"
#include "leg/project.h"
#include "mesh/closest.h"
#include "model/model.h"
#include "model/transfer.h"
#include "morph/plan.h"
#include "morph/timeline.h"
#include "render/materials/color_volume.h"
#include "render/render.h"
#include "scene/scene.h"
#include "sequence/memory_estimate.h"
#include "spheres/spheres.h"

namespace polymorph {

/// An object of the chain, in its place in the world.
struct PreparedObject {
  std::string name;
  Model model;
  bool meta = false;
  std::size_t sphere_count = 0;
  int missing_balls = 0;                   ///< that are still to be fitted (Fits::kCached)
  std::vector<Ball> balls;                 ///< surface at field = 1
  std::vector<std::uint32_t> ball_labels;  ///< one per ball: index into model.label_names
  double ball_volume = 0;                  ///< enclosed by the balls' surface
  float field_maximum = 1;
  std::shared_ptr<const ClosestPointQuery> closest;  ///< of the model
  std::shared_ptr<const ClosestPointQuery> outer;    ///< of its faces that the solid does not hide
  std::vector<std::uint32_t> charts;                 ///< of the model's texture
  /// The model's colours without their detail; null where it has only one.
  std::shared_ptr<const ColorVolume> colors;
  /// What its boundary stages need; none of them for a meta-object.
  BoundaryMethod boundary = BoundaryMethod::kCut;  ///< as it turned out
  std::vector<Vec3> shrink_targets;                ///< crossfade: one per model point
  Projection projection;                           ///< project
  BlendField blend;                                ///< blend
  /// Of the model, where a leg to or from it is made of distances.
  ObjectDistances distances;
};

/// The way from one object to another.
struct PreparedLeg {
  std::size_t from = 0, to = 0;  ///< of the actor's objects
  MorphPlan plan;
  bool distance = false;  ///< made of both objects' distances
  float until = 1;        ///< of the motion's time: then the balls are left to the next leg
  /// Levels that keep the volume at even eased times, nearly; empty: not known.
  std::vector<float> levels;
};

/// One chain, in its place in the world.
struct PreparedActor {
  std::string name;
  Timeline timeline;
  /// The chain's, then those that are no model but balls in flight, which a leg was left with: such
  /// a one's `model` is its surface, without materials.
  std::vector<PreparedObject> objects;
  std::vector<PreparedLeg> legs;
  /// Of all its objects, each name once.
  std::vector<std::string> label_names;
  Box box;         ///< of all its objects
  float cell = 0;  ///< edge of its surfaces' cells
};

/// What the hashes of a sequence's frames are made of (film.h).
struct SequenceHashes {
  std::string scene;               ///< content_hash()
  std::string inputs;              ///< inputs_hash()
  std::optional<Framing> framing;  ///< where the camera moves, if the models alone decide it
};

/// kCached: an object whose fit is not in the cache gets the balls of its spheres instead.
enum class Fits : std::uint8_t { kMake, kCached };

struct PreparedScene {
  Scene scene;
  Fits fits = Fits::kMake;
  SequenceHashes hashes;
  int frame_count = 0;
  std::vector<PreparedActor> actors;
  Box box;  ///< of all objects
  ExtractSettings extract;
  Camera camera;                   ///< of the first frame
  std::optional<Framing> framing;  ///< where the camera moves
  std::shared_ptr<const Image> environment;
  std::vector<std::string> warnings;
  MemoryEstimate memory;
};

/// `cache_folder` empty: no sphere cache. With Fits::kCached what comes out is good for estimates
/// alone. Errors: kInput (models), kResource, among it that the scene needs more than `limit`,
/// which is told once the models are read.
Result<PreparedScene> prepare_scene(const Scene& scene, Engine& engine,
                                    const std::filesystem::path& cache_folder,
                                    const MemoryLimit& limit = {}, Fits fits = Fits::kMake);

}  // namespace polymorph
