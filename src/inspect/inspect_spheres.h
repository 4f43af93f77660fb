// Approximation of a model by spheres and balls, and measures of its quality (`polymorph spheres`).
#pragma once

#include <filesystem>
#include <string>

#include "inspect/inspection.h"
#include "spheres/spheres.h"

namespace polymorph {

struct SpheresRequest {
  std::string model;  ///< a file or a built-in shape
  SphereSettings settings;
  int grid = 192;                      ///< cells of the surface along the model's longest side
  int width = 480;                     ///< pixels of each of the three pictures
  bool measure = true;                 ///< whether to measure the quality, which takes time
  std::filesystem::path cache_folder;  ///< folder of stored approximations; empty: no cache
  /// Files to write; empty: none. `output` is a picture of the model, the spheres and the surface.
  std::string write_balls, write_surface, write_spheres, output;
};

/// A model, its approximation, and the measures of their difference.
struct SpheresResult {
  Model model;
  Approximation approximation;
  /// The fitted balls, or one ball per sphere if nothing is fitted. Without a fit it is empty if
  /// neither measures nor files need balls.
  std::vector<Ball> balls;
  float cell = 0;  ///< edge of the surface's cells
  Inspection report;
};

/// Fits spheres and balls to a model and measures how well they fit. Errors: those of load_model()
/// and approximate().
Result<SpheresResult> inspect_spheres(const SpheresRequest& request);

/// Writes the requested files. Errors: kOutput; kResource (the picture).
Status write_spheres(const SpheresRequest& request, const SpheresResult& result);

}  // namespace polymorph
