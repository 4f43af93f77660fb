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

/// An object as its legs need it.
struct PlayObject {
  std::string name;
  std::shared_ptr<const DistanceGrid> distances;  ///< null where its legs are made of balls
  std::shared_ptr<const DistanceGrid> thinness;   ///< of a solid with distances
  Vec3 color{1, 1, 1};                            ///< scene-linear; where there is no volume
  Grid color_grid;
  std::vector<Vec3> colors;  ///< scene-linear, at the grid's points, x fastest; or empty
};

/// One moment of a leg.
struct PlayKey {
  float time = 0;      ///< of the leg's motion, [0, 1]
  float progress = 0;  ///< eased, [0, 1]: by which colours change
  /// At field = 1, one per pair.
  std::vector<Ball> balls;
  /// Of a leg made of distances: the field between the objects. Of a leg made of balls only
  /// `samples[].center` and `values` of its map: where each ball's surroundings come from and go
  /// to.
  MorphSurface between;
  Box box;  ///< that the surface stays in
};

struct PlayLeg {
  int from = 0, to = 0;  ///< of the actor's objects
  bool distance = false;
  float min_part = 0;         ///< parts with a smaller share of the volume are left out
  std::vector<PlayKey> keys;  ///< by rising time, two or more
};

/// What an actor shows in a frame.
struct PlayFrame {
  int leg = 0;
  float time = 0;
  float look = 0;  ///< share of the common look
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
  Box box;  ///< of all objects
  bool has_ground = true;
  float ground = 0;  ///< height
  std::vector<PlayActor> actors;
};

/// The whole file. Distances are right to 1/80 of the surface's cell, colours to 1/256, what moves
/// to 1/32766 of its range or better; all of it deflated.
std::string encode_play_page(const PlayPage& page);

}  // namespace polymorph
