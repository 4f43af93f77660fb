// A page that plays a morph in a browser: one HTML file that evaluates the morph itself, from what
// carries its legs (docs/interchange.md, The web).
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "base/box.h"
#include "interchange/surface_frame.h"
#include "kernels/linear.h"
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

/// An object of a space, and the way of the whole from the reference to it.
struct PlaySpaceObject {
  Box box;
  double volume = 0;
  float min_part = 0;  ///< components of its surface with a smaller fraction of the volume go
  Vec3d from_center, to_center;
  Vec3d turn;               ///< axis times angle
  double log_scale = 0;     ///< natural logarithm
  std::vector<Vec3> balls;  ///< places of the reference's balls on it
};

/// Space in which an actor's objects, of which the first is the reference, are mixed by weights
/// (leg/weighted_surface.h).
struct PlaySpace {
  std::vector<PlaySpaceObject> objects;  ///< objects of the actor; empty: there is no space
  std::vector<float> masses;             ///< masses of the reference's balls
  std::vector<float> deviations;         ///< own part of their kernels' deviations
  Vec3 middle;                           ///< centre of the reference's box
  bool keeps_volume = true;
  bool contact = true;  ///< whether mixtures of objects that stand equally low do so, too
  float look = 0;       ///< weight of the common look
};

/// State of an actor in a frame.
struct PlayFrame {
  int leg = 0;
  float time = 0;
  float look = 0;              ///< weight of the common look
  std::vector<float> weights;  ///< weights of the objects of a space, which decide alone
};

struct PlayActor {
  std::string name;
  float cell = 0;  ///< edge of the surface's cells
  std::vector<PlayObject> objects;
  std::vector<PlayLeg> legs;  ///< none with a space
  PlaySpace space;
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
