// Colour volume: a model's low-pass filtered diffuse colour as a smooth function of space.
#pragma once

#include <span>
#include <vector>

#include "kernels/types.h"
#include "model/model.h"
#include "model/repair/face_classes.h"

namespace polymorph {

/// Scene-linear colours at the points of a grid. They are interpolated trilinearly within the grid
/// and constant beyond it.
struct ColorVolume {
  Grid grid;
  std::vector<Vec3> colors;  ///< one per grid point, x fastest

  Vec3 at(Vec3 p) const;
};

/// Tests whether all faces have one colour and no texture.
bool is_one_color(const Model& model);

/// Computes, at each grid point, a weighted mean of the colours (texture times material) of the
/// model's surface. Hidden faces (FaceClass::kHidden in `classes`, one per triangle) are left out.
/// The weights are three Gaussians with standard deviations of 1.5, 4.5 and 13.5 % of the box's
/// diagonal; the wider ones matter only where the narrower ones do not reach the surface. Seams
/// between texture charts leave no trace, because the mean is taken in space. Deterministic.
ColorVolume make_color_volume(const Model& model, std::span<const FaceClass> classes);

}  // namespace polymorph
