// Look of a leg's surface: the materials, colours and normals that it takes over from the objects.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "base/result.h"
#include "kernels/engine.h"
#include "leg/leg.h"
#include "model/transfer.h"

namespace polymorph {

/// Shares of a leg's colours, by its progress: the source's detail goes, then the colours that are
/// left turn into the target's, then the target's detail comes. Detail of both at once would show a
/// face on a back; half way, where maps stretch most, it would be torn.
struct ColorFade {
  float color;           ///< share of the target
  float source, target;  ///< shares of either's detail
};
ColorFade color_fade(float u);

/// An object's materials, transferred to a surface.
struct ObjectLayer {
  std::shared_ptr<const PreparedObject> object;
  float share = 1;  ///< share over the layers below it
  TransferredMaterials materials;
};
/// The object's materials on a surface whose vertices correspond to the points `origins` of it.
ObjectLayer object_layer(std::shared_ptr<const PreparedObject> object,
                         std::span<const Triangle> triangles, const Origins& origins,
                         float share = 1);

/// A surface's own look.
struct SurfaceLook {
  /// The objects that it comes from, and over them those that it becomes. Three and more where it
  /// did not reach an object that it set out for. Empty: the common look.
  std::vector<ObjectLayer> layers;
  /// Colour of each vertex, without detail, mixed over those. Empty where nothing has any or they
  /// have no share.
  std::vector<Vec3> colors;
  float color_share = 0;
};
/// Colour of an object at a place of its model, without detail.
Vec3 plain_color(const PreparedObject& object, Vec3 at);

/// A model's own normals on a surface that is nearly the model. Else a smoothly shaded model would
/// show its faces as soon as it moves.
struct EndNormals {
  const PreparedObject& object;
  const AffineMap& map;              ///< linear part of the map from the surface to the object
  const std::vector<Vec3>& origins;  ///< places of the surface's points on it
  float weight = 1;
};
/// Mixes them into the surface's normals. Returns the object's points closest to the origins;
/// empty where the model has no normals of its own.
std::vector<ClosestPoint> add_end_normals(const EndNormals& end, std::vector<Vec3>& normals);

/// Weight of the model's own normals where the surface is `distance` of the progress away from it.
float end_normals_weight(float distance);

/// Makes the look of a leg's surface, where `own_look` asks for it, and mixes the models' own
/// normals into the surface's near the leg's ends, where that is nearly the model: both from the
/// positions of its points on both objects. Errors: the engine's.
Result<SurfaceLook> leg_look(const Leg& leg, bool own_look, LegSurface& surface, Engine& engine);

}  // namespace polymorph
