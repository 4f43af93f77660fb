// Play page: one HTML file that plays a morph in a browser. It holds the fields and maps of the
// legs and extracts the surfaces itself (docs/interchange.md, The web).
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

/// An object of an actor, with its fields on grids. A leg is the morph from one object to the next.
/// The surface of a ball leg is a level set of the balls' field, that of a distance leg the zero
/// set of a mixture of both objects' signed distances (leg/leg.h).
struct PlayObject {
  std::string name;
  std::shared_ptr<const DistanceGrid> distances;  ///< null if its legs are ball legs
  std::shared_ptr<const DistanceGrid>
      smooth;  ///< distances without detail; null if this is no solid
  std::shared_ptr<const DistanceGrid>
      thinness;         ///< [0, 1]; null unless a solid in legs with distances
  Vec3 color{1, 1, 1};  ///< scene-linear; used if `colors` is empty
  Grid color_grid;
  std::vector<Vec3> colors;  ///< scene-linear, at the points of color_grid; or empty
};

/// State of a leg at one time.
struct PlayKey {
  float time = 0;                 ///< time of the leg's motion, [0, 1]
  float progress = 0;             ///< eased progress, [0, 1]; blends the colours
  float min_component_share = 0;  ///< components with a smaller fraction of the volume are removed
  /// Balls, one per pair, scaled so that their surface is where the field is 1.
  std::vector<Ball> balls;
  /// Field of a distance leg. A ball leg uses only `samples[].center` and `values` of its map: the
  /// points on both objects that correspond to each ball's centre.
  MorphSurface between;
  Box box;  ///< bounds of the surface
};

struct PlayLeg {
  int from = 0, to = 0;       ///< indices of the actor's objects
  bool distance = false;      ///< a distance leg, else a ball leg
  std::vector<PlayKey> keys;  ///< two or more, ascending times
};

/// An object of a PlaySpace, and the similarity transform that maps the reference to it (PathPart).
struct PlaySpaceObject {
  Box box;
  double volume = 0;
  float min_component_share = 0;  ///< components with a smaller fraction of the volume are removed
  Vec3d from_center, to_center;
  Vec3d axis_angle;         ///< rotation: axis times angle in radians
  double log_scale = 0;     ///< natural logarithm of the scale
  std::vector<Vec3> balls;  ///< positions of the reference's balls on this object
};

/// Data for mixing an actor's objects by weights (leg/weighted_surface.h). The first object is the
/// reference.
struct PlaySpace {
  std::vector<PlaySpaceObject> objects;  ///< objects of the actor; empty: there is no space
  std::vector<float> masses;             ///< masses of the reference's balls
  std::vector<float> deviations;         ///< ball_kernel_deviation() of the reference's balls
  Vec3 middle;                           ///< centre of the reference's box
  bool keeps_volume = true;              ///< the mixture has the weighted mean of the volumes
  /// If the lowest points of all objects are equally high, the mixture's is put at this height.
  bool contact = true;
  float look = 0;  ///< weight of the common look (PlayPage::look), [0, 1]
};

/// State of an actor in a frame.
struct PlayFrame {
  int leg = 0;     ///< index in PlayActor::legs
  float time = 0;  ///< time of the leg's motion, [0, 1]
  float look = 0;  ///< weight of the common look (PlayPage::look), [0, 1]
  /// Weights of the objects of the actor's PlaySpace; the other members are then unused. Empty if
  /// the actor has legs.
  std::vector<float> weights;
};

struct PlayActor {
  std::string name;
  float cell = 0;  ///< edge of the cells by which the surface is extracted
  std::vector<PlayObject> objects;
  std::vector<PlayLeg> legs;      ///< empty if the actor mixes objects by weights
  PlaySpace space;                ///< has no objects unless the actor mixes them by weights
  std::vector<PlayFrame> frames;  ///< one per frame, in order
};

struct PlayPage {
  std::string title;
  float fps = 24;
  FieldKind field = FieldKind::kGaussian;
  SurfaceMaterial look;  ///< the common look: a material that objects may take on as they morph
  FrameCamera camera;
  Box box;  ///< bounds of all objects
  bool has_ground = true;
  float ground = 0;  ///< height of the ground, if there is one
  std::vector<PlayActor> actors;
};

/// Encodes the page as HTML. Distances have errors of at most 1/80 of the surface's cell, colours
/// of 1/256, and a leg's changing values of 1/32766 of their range (1/1022 for the balls of a
/// distance leg, which are only displayed). All data is deflated.
std::string encode_play_page(const PlayPage& page);

}  // namespace polymorph
