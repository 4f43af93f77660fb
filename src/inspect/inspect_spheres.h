// Quality of a model's approximation by spheres and balls (`polymorph spheres`).
#pragma once

#include <filesystem>
#include <string>

#include "inspect/inspection.h"
#include "spheres/spheres.h"

namespace polymorph {

struct SpheresRequest {
  std::string model;                                 ///< a file or a built-in shape
  std::string method = "medial", fit = "ellipsoid";  ///< the settings' names, for reports
  SphereSettings settings;
  int grid = 192;   ///< cells along the longest side, for the surface
  int width = 480;  ///< pixels of each of the three pictures
  bool measure = true;
  std::filesystem::path cache_folder;
  std::string write_balls, write_surface, write_spheres, output;  ///< files; empty: none
};

/// A model, its approximation, and the measures of their difference.
struct SpheresResult {
  Model model;
  Approximation approximation;
  std::vector<Ball> balls;  ///< fitted, or straight from the spheres
  float cell = 0;           ///< edge of the surface's cells
  Inspection report;
};

/// Fits spheres and balls to a model and measures how well they fit. Errors: those of load_model()
/// and approximate().
Result<SpheresResult> inspect_spheres(const SpheresRequest& request);

/// Writes the files that are asked for. Errors: kOutput; kResource (the picture).
Status write_spheres(const SpheresRequest& request, const SpheresResult& result);

}  // namespace polymorph
