// A page that plays a morph in a browser: one HTML file that evaluates the morph itself, from what
// carries its legs (docs/interchange.md, The web).
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "base/box.h"
#include "interchange/surface_frame.h"
#include "kernels/morph_surface.h"
#include "kernels/types.h"

namespace polymorph {

/// An object, as the page draws it.
struct PlayObject {
  std::string name;
  std::shared_ptr<const DistanceGrid> distances;  ///< null if its legs are ball legs
  std::shared_ptr<const DistanceGrid> smooth;     ///< without detail; null unless a solid
  std::shared_ptr<const DistanceGrid> thinness;   ///< null unless a solid with distances
  Vec3 color{1, 1, 1};                            ///< scene-linear; where there is no volume
  Grid color_grid;
  std::vector<Vec3> colors;  ///< scene-linear, at the grid's points, x fastest; or empty
};

/// State of a leg at one time.
struct PlayKey {
  float time = 0;      ///< time of the leg's motion, [0, 1]
  float progress = 0;  ///< eased progress, [0, 1]; blends the colours
  float min_part = 0;  ///< components with a smaller fraction of the volume are removed
  /// Balls with their surface at field = 1, one per pair.
  std::vector<Ball> balls;
  /// The field between the objects, for a distance leg. A ball leg uses only `samples[].center` and
  /// `values` of its map: where each ball's surroundings come from and go to.
  MorphSurface between;
  Box box;  ///< bounds of the surface
};

struct PlayLeg {
  int from = 0, to = 0;  ///< indices of the actor's objects
  bool distance = false;
  std::vector<PlayKey> keys;  ///< two or more, ascending times
};

/// State of an actor in a frame.
struct PlayFrame {
  int leg = 0;
  float time = 0;
  float look = 0;  ///< weight of the common look
};

struct PlayActor {
  std::string name;
  float cell = 0;  ///< edge of the surface's cells
  std::vector<PlayObject> objects;
  std::vector<PlayLeg> legs;
  std::vector<PlayFrame> frames;
};

struct PlayPage {
  std::string title;
  float fps = 24;
  FieldKind field = FieldKind::kGaussian;
  SurfaceMaterial look;  ///< the common one
  FrameCamera camera;
  Box box;  ///< bounds of all objects
  bool has_ground = true;
  float ground = 0;  ///< height
  std::vector<PlayActor> actors;
};

/// Encodes the whole page. Distances are exact to 1/80 of the surface's cell, colours to 1/256,
/// moving values to 1/32766 of their range or better; all of it is deflated.
std::string encode_play_page(const PlayPage& page);

}  // namespace polymorph
