// Prepared object: a model of the chain in its place in the world, with its balls, distances,
// colours and boundary stage.
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
  float cell = 0;                 ///< edge of the cells that surfaces are extracted on
  int resolution = 0;             ///< number of those along the longest side of the actor's box
  ExtractSettings measured;       ///< extraction of surfaces that volumes and levels are found on
  ExtractSettings shown;          ///< extraction of the surfaces that frames show
  float min_component_share = 0;  ///< share of the volume below which components are left out
  bool has_colors = false;        ///< whether any object of the chain has more than one colour
  bool contact = false;           ///< whether what stands at both ends stands in between
};

/// An object of the chain, or balls in flight, with which a leg was left.
struct PreparedObject {
  std::string name;
  Model model;         ///< balls in flight: their surface, without materials
  Transform to_scene;  ///< takes the coordinates of the model's file into the scene
  bool meta = false;   ///< passed through as balls only: its own mesh is never shown
  /// Azimuth of the front, radians from +z towards +x; nothing where the scene does not say it.
  std::optional<double> front;
  int missing_balls = 0;    ///< count that is still to be fitted (Fits::kCached)
  std::vector<Ball> balls;  ///< surface at field = 1
  /// Rotation of each ball since the pose that the leg's plan was made for; empty: it is that pose.
  std::vector<Mat3> ball_rotations;
  std::vector<std::uint32_t> ball_labels;    ///< one per ball: index into model.label_names
  std::vector<std::uint32_t> label_numbers;  ///< one per label: index into the actor's label_names
  std::map<std::string, Vec3> landmarks;     ///< places on the surface, by name
  double ball_volume = 0;                    ///< enclosed by the balls' surface
  float field_maximum = 1;
  std::shared_ptr<const ClosestPointQuery> closest;  ///< query of the model
  std::shared_ptr<const ClosestPointQuery> outer;    ///< query of faces that the solid leaves free
  std::vector<std::uint32_t> charts;                 ///< charts of the model's texture
  /// The model's colours without their detail; null where it has only one.
  std::shared_ptr<const ColorVolume> colors;
  BoundaryStage boundary;     ///< none for a meta-object and between legs made of distances
  ObjectDistances distances;  ///< measured where a leg to or from it is made of distances
};

/// Distances to the object's model, whose `closest` is set, and measures of their surface. Errors:
/// kInput where that encloses nothing; the engine's.
Result<ObjectDistances> measure_distances(const PreparedObject& object,
                                          const DistanceMeasure& measure, Engine& engine,
                                          const std::filesystem::path& cache);

/// Sets the fields that give a surface the object's colours: `outer`, `charts` and, where they are
/// asked for, `colors`. Faces that the solid hides are left out, where the distances know them.
void add_colors(PreparedObject& object, bool with_colors);

/// Index of each name among `all`, which has them all.
std::vector<std::uint32_t> label_numbers(const std::vector<std::string>& names,
                                         const std::vector<std::string>& all);

/// Label of each point of a model: that of its last face, as an index into the actor's names.
/// `numbers`: label_numbers() of the model's labels.
std::vector<std::uint32_t> model_labels(const Model& model, std::span<const std::uint32_t> numbers);

/// Label of the model's face nearest to each point, as an index into the actor's names.
std::vector<std::uint32_t> nearest_labels(const PreparedObject& object,
                                          std::span<const Vec3> points);

}  // namespace polymorph
