// Sphere approximation of a model, and conversion of spheres to the balls of a field.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include "base/result.h"
#include "field/level.h"
#include "kernels/engine.h"
#include "kernels/types.h"
#include "mesh/inside.h"
#include "model/model.h"
#include "scene/scene.h"

namespace polymorph {

/// A geometric sphere. (A Ball, by contrast, is a source of a field.)
struct Sphere {
  Vec3 center;
  float radius = 0;
};

/// A node of a sphere tree.
struct SphereNode {
  Sphere sphere;
  std::int32_t parent = -1;  ///< index into nodes, -1 for a root
  std::int16_t level = 0;    ///< 0 for a root, increasing towards the leaves
  bool leaf = false;         ///< whether it is part of the flat approximation (SphereTree)
};

/// A hierarchy of spheres, parents before children. Its leaves are the flat approximation, the list
/// of spheres of Gilbert 2010.
struct SphereTree {
  std::vector<SphereNode> nodes;
  std::vector<Sphere> leaves() const;
};

/// Spheres that approximate a model, and balls fitted to it.
struct Approximation {
  SphereTree tree;
  std::vector<Ball> balls;  ///< the fit, with its surface at field = 1; empty if not requested
};

/// Approximates the inside of `model` by spheres, and fits balls to it if the settings ask for it
/// (docs/method.md, Spheres and Fit).
/// - `octree`: divides a cube around the bounding box (settings.root_margin) into 2^(R-1) cells per
///   axis. Each of these cells whose centre is inside gives one sphere.
/// - `active`: goes from the root cell down. A cell with MORE than 4 of its 8 corners inside gives
///   one sphere, and its children are dropped (Gilbert 2010, 5.1.3.2).
/// - `hubbard`, `medial`: give settings.balls spheres; with an error > 0, `medial` gives the
///   smallest number of spheres with at most this error.
///
/// Spheres of `octree` and `active` have the volumes of their cells. R is settings.resolution; 0
/// selects the finest resolution that gives at most 8000 spheres (with a fit: settings.balls).
/// Fitted balls enclose the model's volume to 0.2 %. Errors (kInput): nothing of the model is
/// inside, or too little for the method; the message says what to do. `proxy`, if given, is the
/// result of make_solid_proxy() for the same arguments.
Result<Approximation> approximate(const Model& model, const SphereSettings& settings,
                                  const std::optional<Model>* proxy = nullptr);

/// Continues the fit from the balls of a similar model, for example the previous pose, in a
/// fraction of a fit's time. Balls keep their indices. Errors: as approximate().
Result<std::vector<Ball>> refit(const Model& model, const SphereSettings& settings,
                                const std::vector<Ball>& balls);

/// Calls refit() through the disk cache, as approximate_cached() does; the balls are part of the
/// key.
Result<std::vector<Ball>> refit_cached(const Model& model, const SphereSettings& settings,
                                       const std::vector<Ball>& balls,
                                       const std::filesystem::path& cache_folder);

/// Makes the closed model that approximate() uses in place of a model that is not solid:
/// solidify(model) if the settings ask for it, or, for a shell (model/repair/shell.h), a solid
/// around its faces that is thick enough to be extracted. Returns nullopt for other models. Errors:
/// kInput.
Result<std::optional<Model>> make_solid_proxy(const Model& model, const SphereSettings& settings);

/// Calls approximate() through the disk cache in `cache_folder` (empty: no cache). The key is a
/// hash of the points, triangles, settings and algorithm version; a damaged or foreign file causes
/// a warning and a new computation.
Result<Approximation> approximate_cached(const Model& model, const SphereSettings& settings,
                                         const std::filesystem::path& cache_folder,
                                         const std::optional<Model>* proxy = nullptr);

/// Tests whether approximate_cached() would find its result in the folder.
bool is_cached(const Model& model, const SphereSettings& settings,
               const std::filesystem::path& cache_folder);

/// Returns POLYMORPH_CACHE_DIR, else XDG_CACHE_HOME/polymorph, else ~/.cache/polymorph; empty if
/// none of them is set.
std::filesystem::path default_cache_folder();

/// Converts spheres to balls of the chosen field kind without a fit. For a sphere of radius R and
/// blobbiness B, a Gaussian ball has a = B / R^2 and w = B (Blinn 1982: a lone ball's surface is at
/// r = R). A Wyvill ball has a = 1 / (4 R^2) and w = 2 magnitude / threshold; an inverse-square
/// ball has w = blob_constant * magnitude * R^2 / threshold.
std::vector<Ball> convert_to_balls(const std::vector<Sphere>& spheres, const FieldSettings& field);

/// Converts spheres to balls as convert_to_balls() does. If `field` asks for it, equalizes the
/// field, and matches `measure.volume` (if positive) on a surface with cells of edge
/// `measure.cell`. Errors: as extract_surface().
Result<std::vector<Ball>> make_unfitted_balls(const std::vector<Sphere>& spheres,
                                              SphereMethod method, FieldSettings field,
                                              const VolumeMeasure& measure, Engine& engine);

}  // namespace polymorph
