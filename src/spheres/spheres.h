// Sphere approximation of a model, and conversion of spheres to the balls of a field.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "kernels/engine.h"
#include "kernels/types.h"
#include "mesh/inside.h"
#include "model/model.h"
#include "scene/scene.h"

namespace polymorph {

/// A shape (a Ball is a field source).
struct Sphere {
  Vec3 center;
  float radius = 0;
};

struct SphereNode {
  Sphere sphere;
  std::int32_t parent = -1;  ///< index into nodes, -1 for a root
  std::int16_t level = 0;    ///< 0 = the root cube
  bool leaf = false;         ///< part of the flat approximation
};

/// Parents stand before children. `leaves()` in array order is the report's flat list.
struct SphereTree {
  std::vector<SphereNode> nodes;
  std::vector<Sphere> leaves() const;
};

/// A model as spheres, and as balls fitted to it.
struct Approximation {
  SphereTree tree;
  std::vector<Ball> balls;  ///< fitted, surface at field = 1; empty when not fitted
};

/// Approximates the inside of `model` by spheres, and fits balls to it where the settings ask for
/// it (method: docs/method.md, Spheres and Fit).
/// `octree`: a cube around the bounding box (settings.root_margin), 2^(R-1) cells per axis at the
/// finest level; a finest cell whose centre is inside gives one sphere. `active`: from the root
/// down, a cell with MORE than 4 of its 8 corners inside gives one sphere and its children are
/// dropped (report 5.1.3.2). Both: resolution 0 takes the finest one that gives at most 8000
/// spheres (with a fit: settings.balls); a sphere's radius is that of the ball with its cell's
/// volume. `hubbard`, `medial`: settings.balls spheres; `medial` with an error > 0: as few as keep
/// it. Fitted balls enclose the model's volume to 0.2 %. Errors (kInput): nothing of the model is
/// inside, or too little for the method - says what to do.
/// `stand_in`, where given, is solid_stand_in() of the same.
Result<Approximation> approximate(const Model& model, const SphereSettings& settings,
                                  const std::optional<Model>* stand_in = nullptr);

/// What approximate() stands balls for instead of the model itself: solidify(model) where that is
/// asked for, a solid as thick as cells show around the faces of a shell (model/repair/shell.h),
/// else nothing. Errors: kInput.
Result<std::optional<Model>> solid_stand_in(const Model& model, const SphereSettings& settings);

/// approximate(), through the disk cache in `cache_folder` (empty: no cache). The key is a hash of
/// the points, triangles, settings and algorithm version; damaged or foreign files are one warning
/// and a rebuild.
Result<Approximation> approximate_cached(const Model& model, const SphereSettings& settings,
                                         const std::filesystem::path& cache_folder,
                                         const std::optional<Model>* stand_in = nullptr);

/// Does approximate_cached() have its answer in the folder?
bool is_cached(const Model& model, const SphereSettings& settings,
               const std::filesystem::path& cache_folder);

/// POLYMORPH_CACHE_DIR, else XDG_CACHE_HOME/polymorph, else ~/.cache/polymorph; empty when none can
/// be had.
std::filesystem::path default_cache_folder();

/// Balls of the wanted field for these spheres, without a fit: with blobbiness B a Gaussian ball
/// has a = B / R^2 and w = B (Blinn 1982: a lone ball's surface is at r = R); an inverse-square
/// ball has w = blob_constant * magnitude * R^2 / threshold.
std::vector<Ball> balls_of(const std::vector<Sphere>& spheres, const FieldSettings& field);

/// balls_of(), evened and brought to `volume` where the field's settings ask for it, on a surface
/// of cells of edge `cell`. Errors: as extract_surface().
Result<std::vector<Ball>> unfitted_balls(const std::vector<Sphere>& spheres, SphereMethod method,
                                         double volume, FieldSettings field, float cell,
                                         const ExtractSettings& extract, Engine& engine);

}  // namespace polymorph
