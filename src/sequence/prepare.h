// Everything that is done once before the first frame: models, spheres, balls, plans, camera.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "base/box.h"
#include "base/result.h"
#include "kernels/extract_surface.h"
#include "model/closest.h"
#include "model/model.h"
#include "model/transfer.h"
#include "morph/plan.h"
#include "morph/timeline.h"
#include "render/render.h"
#include "scene/scene.h"
#include "spheres/spheres.h"
#include "surface/blend.h"
#include "surface/project.h"

namespace polymorph {

/// An object of the chain, in its place in the world.
struct PreparedObject {
  std::string name;
  Model model;
  bool meta = false;
  std::size_t sphere_count = 0;
  std::vector<Ball> balls;  ///< surface at field = 1
  double model_volume = 0;
  double ball_volume = 0;  ///< enclosed by the balls' surface
  float field_maximum = 1;
  std::shared_ptr<const ClosestPointQuery> closest;  ///< of the model
  std::vector<std::uint32_t> charts;                 ///< of the model's texture
  /// What its boundary stages need; none of them for a meta-object.
  BoundaryMethod boundary = BoundaryMethod::kCut;  ///< as it turned out
  std::vector<Vec3> shrink_targets;                ///< crossfade: one a model point
  Projection projection;                           ///< project
  BlendField blend;                                ///< blend
};

struct PreparedScene {
  Scene scene;
  std::string hash;  ///< of all settings and models that decide the pixels
  Timeline timeline;
  std::vector<PreparedObject> objects;
  std::vector<MorphPlan> plans;  ///< one a leg
  Box box;                       ///< of all objects
  float cell = 0;                ///< edge of the surface's cells
  ExtractSettings extract;
  Camera camera;
  GroundSettings ground;
  std::shared_ptr<const Image> environment;
  std::vector<std::string> warnings;
};

/// The chain's models, loaded and arranged.
struct LoadedScene {
  std::vector<Model> models;  ///< in chain order
  std::vector<std::string> warnings;
};
Result<LoadedScene> load_models(const Scene& scene, bool textures);

/// What is wrong with the models, their spheres and the environment, one line each: everything that
/// could stop prepare_scene() but the machine. `loaded` gets what could be loaded, empty models
/// where not.
std::vector<std::string> find_problems(const Scene& scene,
                                       const std::filesystem::path& cache_folder,
                                       LoadedScene& loaded);

/// `cache_folder` empty: no sphere cache. Errors: kInput (models), kResource.
Result<PreparedScene> prepare_scene(const Scene& scene, SurfaceExtractor& extractor,
                                    const std::filesystem::path& cache_folder);

/// An object's materials as the surface wears them.
struct Clothes {
  int object = -1;  ///< of the chain
  TransferredMaterials materials;
};

/// The geometry of one frame.
struct FrameGeometry {
  Moment moment;
  std::vector<Ball> balls;  ///< empty while only a model shows
  float iso = 1;
  Mesh surface;                      ///< of the balls, or blended with the model `moment.object`
  std::vector<Vec3> points;          ///< of the model `moment.object`, when one shows
  std::vector<Vec3> corner_normals;  ///< of those points; empty: the model's own
  /// The surface's own look: what it comes from and, mixed with it by moment.u, what it becomes.
  Clothes own, other;
};
/// The balls of a leg at `time` in [0, 1] of their motion, their level and their surface: what
/// shows in the volumetric stage. `geometry.moment` says only leg, time and u.
Result<FrameGeometry> volume_at(const PreparedScene& prepared, SurfaceExtractor& extractor, int leg,
                                float time);

Result<FrameGeometry> geometry_at(const PreparedScene& prepared, SurfaceExtractor& extractor,
                                  int frame);

/// What the renderer is given for one frame; borrows from both arguments.
RenderScene render_scene(const PreparedScene& prepared, const FrameGeometry& geometry);

}  // namespace polymorph
