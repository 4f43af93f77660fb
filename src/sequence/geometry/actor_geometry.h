// Actor geometry: the balls, surface, mesh and look of one actor in one frame.
#pragma once

#include <cstdint>
#include <vector>

#include "kernels/ball_set.h"
#include "kernels/mesh.h"
#include "kernels/types.h"
#include "model/transfer.h"
#include "morph/flow.h"
#include "morph/smooth_map.h"
#include "morph/timeline.h"
#include "sequence/prepare.h"

namespace polymorph {

/// An object's materials, transferred to the surface.
struct ObjectLayer {
  std::size_t object = 0;  ///< of the actor
  float share = 1;         ///< mixed over what is below it
  TransferredMaterials materials;
};

/// One actor at one moment.
struct ActorGeometry {
  MorphState moment;
  BallSet balls;  ///< empty while only a model shows
  float iso = 1;
  FrameMap map;          ///< of the balls, where the leg is made of distances; else no regression
  MorphSurface between;  ///< the field of such a leg's surface, its level included
  Mesh surface;          ///< of the balls, or blended with the model `moment.object`
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
  /// Of each vertex of the surface, without detail, mixed over those. Empty where nothing has any
  /// or they have no share.
  std::vector<Vec3> colors;
  float color_share = 0;
  bool moves = true;  ///< it is another in the frames before and after
};

/// The objects and legs of an actor by a MorphState's numbers.
inline const PreparedObject& object_of(const PreparedActor& actor, int object) {
  return actor.objects[static_cast<std::size_t>(object)];
}
inline const PreparedLeg& leg_of(const PreparedActor& actor, int leg) {
  return actor.legs[static_cast<std::size_t>(leg)];
}

}  // namespace polymorph
