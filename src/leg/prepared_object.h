// Prepared object: a model in scene coordinates, with its balls, distances, colours and boundary
// stage. The objects through which an actor morphs, in their order, are its chain.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/matrix_decompositions.h"
#include "field/distance_cache.h"
#include "kernels/engine.h"
#include "leg/boundary_stage.h"
#include "mesh/closest.h"
#include "model/color_volume.h"
#include "model/model.h"
#include "model/transform.h"

namespace polymorph {

/// Settings that the objects and legs of an actor have in common.
struct LegSettings {
  float cell = 0;            ///< edge of the cells that surfaces are extracted on
  int resolution = 0;        ///< number of cells along the longest side of the actor's box
  ExtractSettings measured;  ///< extraction of surfaces that volumes and levels are measured on
  ExtractSettings shown;     ///< extraction of the surfaces that frames show
  float min_component_share = 0;  ///< fraction of the volume; smaller components are left out
  /// True if objects keep their own colours and at least one object has several.
  bool has_colors = false;
  bool contact = false;  ///< keeps the surface on the floor if both objects stand on it
};

/// An object of the chain, or balls in flight: the balls of a leg that is left before its end, at
/// the time at which the next leg takes over (leg/make_leg.h: make_flight_object).
struct PreparedObject {
  std::string name;
  Model model;         ///< balls in flight: their surface, without materials
  Transform to_scene;  ///< takes the coordinates of the model's file into the scene
  bool meta = false;   ///< true: shown as balls only, never as its own mesh
  /// Azimuth of the front, radians from +z towards +x, if the scene sets it.
  std::optional<double> front;
  /// Number of balls still to be fitted (Fits::kCached, sequence/prepare/prepared_scene.h).
  int missing_balls = 0;
  std::vector<Ball> balls;  ///< surface at field = 1
  /// Rotation of each ball since the pose that the leg's plan was made for; empty in that pose.
  std::vector<Mat3> ball_rotations;
  std::vector<std::uint32_t> ball_labels;    ///< one per ball: index into model.label_names
  std::vector<std::uint32_t> label_numbers;  ///< one per label: index into the actor's label_names
  std::map<std::string, Vec3> landmarks;     ///< points on the surface, by name
  double ball_volume = 0;                    ///< volume enclosed by the balls' surface
  float field_maximum = 1;                   ///< find_field_maximum() (field/level.h) of the balls
  std::shared_ptr<const ClosestPointQuery>
      closest;  ///< closest points of all faces; null: not needed
  std::shared_ptr<const ClosestPointQuery> outer;  ///< closest points of list_outer_faces()
  std::vector<std::uint32_t> charts;               ///< find_texture_charts() (model/transfer.h)
  /// The model's colours without their detail; null if it has one colour or a common look.
  std::shared_ptr<const ColorVolume> colors;
  BoundaryStage boundary;     ///< empty for a meta-object and between legs made of distances
  ObjectDistances distances;  ///< measured if a leg to or from the object is made of distances
};

/// Computes the distances to the object's model, whose `closest` must be set, and measures of their
/// surface. Reads and writes them in the cache. Errors: kInput if the surface encloses nothing; the
/// engine's.
Result<ObjectDistances> measure_distances(const PreparedObject& object,
                                          const DistanceMeasure& measure, Engine& engine,
                                          const std::filesystem::path& cache);

/// Sets the members with which the object's colours are transferred to a surface: `outer`, `charts`
/// and, if `with_colors`, `colors`. Faces inside the solid are left out if `distances.face_classes`
/// is known. Colours are read and written in the cache, unless that is empty.
void prepare_transfer(PreparedObject& object, bool with_colors, const std::filesystem::path& cache);

/// Returns the index in `all` of each of `names`; `all` must contain them.
std::vector<std::uint32_t> label_numbers(const std::vector<std::string>& names,
                                         const std::vector<std::string>& all);

/// Returns the label of each point of a model, as an index into the actor's label_names: the label
/// of the last triangle that has the point. `numbers`: label_numbers() of the model's label_names.
std::vector<std::uint32_t> model_labels(const Model& model, std::span<const std::uint32_t> numbers);

/// Returns the label of the model's face nearest to each point, as an index into the actor's
/// label_names.
std::vector<std::uint32_t> nearest_labels(const PreparedObject& object,
                                          std::span<const Vec3> points);

}  // namespace polymorph
