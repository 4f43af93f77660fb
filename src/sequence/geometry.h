// What one frame shows: each actor's balls, surface and mesh, as a closed form of the frame's
// number.
#pragma once

#include <string>
#include <vector>

#include "base/result.h"
#include "kernels/extract_surface.h"
#include "kernels/mesh.h"
#include "model/transfer.h"
#include "morph/flow.h"
#include "morph/smooth_map.h"
#include "morph/timeline.h"
#include "render/render.h"
#include "sequence/prepare.h"
#include "surface/mesh_io.h"

namespace polymorph {

/// An object's materials as the surface wears them.
struct ObjectLayer {
  std::size_t object = 0;  ///< of the actor
  float share = 1;         ///< mixed over what is below it
  TransferredMaterials materials;
};

/// One actor at one moment.
struct ActorGeometry {
  MorphState moment;
  std::vector<Ball> balls;  ///< empty while only a model shows
  float iso = 1;
  FrameMap map;  ///< of the balls, where the leg is made of distances; else no regression
  Mesh surface;  ///< of the balls, or blended with the model `moment.object`
  std::vector<Vec3> points;          ///< of the model `moment.object`, when one shows
  std::vector<Vec3> corner_normals;  ///< of those points; empty: the model's own
  /// Only where the scene asks for motion blur or for a layer that needs them: see wants_flow().
  Flow flow;                       ///< of the surface's points, to the next frame; empty = still
  std::vector<Vec3> displacement;  ///< of the model's points, to the next frame; empty = still
  /// Only where the scene asks for the layer: index into the actor's label_names, of each vertex.
  std::vector<std::uint32_t> surface_labels, point_labels;
  /// The surface's own look: what it comes from, and over it what it becomes. Three and more where
  /// it did not reach an object that it set out for. Empty: the common look.
  std::vector<ObjectLayer> layers;
  /// Of each vertex of the surface, without detail, mixed over those. Empty where nothing has any.
  std::vector<Vec3> colors;
  float color_share = 0;
  bool moves = true;  ///< it is another in the frames before and after
};

struct FrameGeometry {
  int frame = 1;
  float t = 0;                        ///< the scene's time [0, 1]
  std::string stage;                  ///< stage_names()
  std::vector<ActorGeometry> actors;  ///< as in PreparedScene
};

/// The balls of a leg at `time` in [0, 1] of their motion, and their level; no surface yet.
Result<ActorGeometry> balls_on_way(const PreparedScene& prepared, const PreparedActor& actor,
                                   SurfaceExtractor& extractor, int leg, float time);

/// The balls of a leg at `time` in [0, 1] of their motion, their level and their surface: what
/// shows in the volumetric stage. `moment` says only leg, time and u. `actor`: of `prepared`, of
/// which only the settings are needed. Errors: kResource.
Result<ActorGeometry> volume_at(const PreparedScene& prepared, const PreparedActor& actor,
                                SurfaceExtractor& extractor, int leg, float time);

/// The map of a leg that is made of distances, when its balls are `balls`.
FrameMap map_at(const PreparedActor& actor, const PreparedLeg& leg, float time,
                const std::vector<Ball>& balls);

/// The surface of a leg that is made of distances, on cells of edge `cell`: of `geometry` its map
/// and of its moment time and u count. Errors: kResource.
Result<Mesh> surface_between(const PreparedActor& actor, const PreparedLeg& leg,
                             const ActorGeometry& geometry, float cell,
                             const ExtractSettings& extract, SurfaceExtractor& extractor);

/// A model on its way to its balls' surface, at the beginning (`leaving`) or the end of a leg:
/// `way` 0 is the model, 1 what is taken for the balls' surface. For an object without a boundary
/// stage the model. Errors: kResource.
Result<ActorGeometry> boundary_at(const PreparedScene& prepared, const PreparedActor& actor,
                                  SurfaceExtractor& extractor, int leg, bool leaving, float way);

/// What is seen of an actor: its surface, its model where that shows, or both.
Mesh shown_mesh(const PreparedActor& actor, const ActorGeometry& geometry);

/// Does a frame with these settings show where things move?
inline bool wants_flow(const Scene& scene) {
  return scene.camera.shutter > 0 || aov_is_chosen(scene.image.aovs, "motion") ||
         aov_is_chosen(scene.image.aovs, "morph");
}

/// `frame` in [1, prepared.frame_count]. Errors: kResource.
Result<FrameGeometry> geometry_at(const PreparedScene& prepared, SurfaceExtractor& extractor,
                                  int frame);

/// The stages that the actors are in, each once, in the actors' order: "volume, boundary-in".
std::string stage_names(const PreparedScene& prepared, int frame);

/// Of all actors.
std::size_t ball_count(const FrameGeometry& geometry);
/// The balls' surfaces of all actors, one after the other: what golden frames keep the digest of.
Mesh surfaces_of(const FrameGeometry& geometry);

/// What each vertex of an actor's surface belongs to: index into actor.label_names. Of moving balls
/// by their shares (morph/labels.h), else by the nearest face of the model that the surface comes
/// from. Errors: the extractor's.
Result<std::vector<std::uint32_t>> surface_labels(const PreparedActor& actor,
                                                  const ActorGeometry& geometry,
                                                  SurfaceExtractor& extractor);

/// A frame as a mesh: of each actor its surface or, where it has none, its model.
struct FrameMesh {
  Mesh mesh;
  MeshTags tags;     ///< a part an actor; labels "beak", or "actor.beak" of several
  std::string what;  ///< "surface", "model" or both: "surface, model"
};
/// Errors: the extractor's.
Result<FrameMesh> mesh_of(const PreparedScene& prepared, const FrameGeometry& geometry,
                          SurfaceExtractor& extractor);

/// What the renderer is given for one frame; borrows from both arguments. The id AOV counts from 2
/// through the actors, for each its surface and then its objects' models.
RenderScene render_scene(const PreparedScene& prepared, const FrameGeometry& geometry);

}  // namespace polymorph
