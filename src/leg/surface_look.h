// Look of a leg's surface: the materials, colours and normals transferred from its objects.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "base/result.h"
#include "kernels/engine.h"
#include "leg/leg.h"
#include "model/transfer.h"

namespace polymorph {

/// Weights of both objects' colours in a leg's surface. First the source's detail fades out, then
/// its colours without detail change to the target's, then the target's detail fades in. Detail of
/// both at once would show, say, a face on a back, and half way, where maps stretch most, detail
/// would be torn.
struct ColorFade {
  float color;           ///< weight of the target in the colours without detail
  float source, target;  ///< weight of each object's detail
};
/// Computes the weights at the eased progress u.
ColorFade color_fade(float u);

/// An object's materials, transferred to a surface.
struct ObjectLayer {
  std::shared_ptr<const PreparedObject> object;
  float opacity = 1;                                  ///< [0, 1], over the layers below
  std::shared_ptr<const MaterialTransfer> materials;  ///< borrows from the object
};
/// Makes the layer of an object's materials on a surface whose vertices correspond to the points
/// `origins` of the object.
ObjectLayer object_layer(std::shared_ptr<const PreparedObject> object,
                         std::span<const Triangle> triangles, const Origins& origins,
                         float opacity = 1);

/// Look of a surface made from the materials of its objects.
struct SurfaceLook {
  /// Layers from the bottom: the source, then the target. There are more in a mixture of several
  /// objects, or if an earlier leg was left before its target. Empty: the surface has the scene's
  /// common look.
  std::vector<ObjectLayer> layers;
  /// Colour of each vertex without detail, mixed over the layers with the weight `color_opacity`.
  /// Empty if no object has several colours or the weight is 0.
  std::vector<Vec3> colors;
  float color_opacity = 0;
};
/// Returns the object's colour without detail at a point of its model.
Vec3 plain_color(const PreparedObject& object, Vec3 at);

/// Input of add_end_normals(): a surface that is nearly the model of `object`.
struct EndNormals {
  const PreparedObject& object;
  const AffineMap& map;              ///< map from the surface to the object; only its rows are used
  const std::vector<Vec3>& origins;  ///< the surface's points, mapped to the object
  float weight = 1;                  ///< weight of the model's normals
};
/// Mixes the model's own normals into those of the surface. Without them a smoothly shaded model
/// would show its faces as soon as it moves. Returns the model's points closest to the origins; an
/// empty list if the model has no normals of its own.
std::vector<ClosestPoint> add_end_normals(const EndNormals& end, std::vector<Vec3>& normals);

/// Computes EndNormals::weight. `distance`: eased progress between the surface and the end of the
/// leg at which the model is, [0, 1].
float end_normals_weight(float distance);

/// Computes the look of a leg's surface from the positions of its points on both objects; empty
/// unless `own_look`. Near an end of the leg, mixes the normals of the model there into the
/// surface's (add_end_normals()). Errors: the engine's.
Result<SurfaceLook> leg_look(const Leg& leg, bool own_look, LegSurface& surface, Engine& engine);

}  // namespace polymorph
