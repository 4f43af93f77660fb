// True points: a file of named points on models that are known to correspond, with which
// correspondences are evaluated (`analyze --truth`, `bench morph`).
#pragma once

#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "base/result.h"
#include "mesh/mesh_view.h"
#include "scene/scene.h"

namespace polymorph {

/// Named points on a model.
struct TrueModel {
  std::string name;
  std::filesystem::path model;  ///< its file; absolute if Truth::file is
  UpAxis up = UpAxis::kY;       ///< axis of the file that points up
  /// Positions by name, in the coordinates of the model's file. They need not lie exactly on the
  /// model's surface.
  std::map<std::string, Vec3> points;
};

/// A file of true points. Points of the same name on two models correspond.
struct Truth {
  std::filesystem::path file;
  std::vector<TrueModel> models;
  /// Indices in `models` of the source and the target of each pair to evaluate.
  std::vector<std::pair<std::size_t, std::size_t>> pairs;
  /// Returns the entry whose file is `model`, else the entry called `name`, else null.
  const TrueModel* find(const std::filesystem::path& model, const std::string& name) const;
};

/// Reads {"models": {"NAME": {"model": PATH, "up": "y", "points": {"nose": [x, y, z], ...}}, ...},
/// "pairs": [["FROM", "TO"], ...]}, comments allowed. Paths are relative to the file. "up" (x, y or
/// z) and "pairs" may be missing. A folder means its truth.json. Errors (kInput) name line and
/// column.
Result<Truth> load_truth(const std::filesystem::path& file_or_folder);

/// Points of two models, in the order of their names; from[i] and to[i] have the same name.
struct PointPairs {
  std::vector<Vec3> from, to;
};
/// Finds the points whose names are on both models.
PointPairs pair_points(const TrueModel& from, const TrueModel& to);

/// Projects each point onto the surface of `mesh`, and moves it with its triangle when the mesh's
/// points move to `positions`. The mesh must have triangles.
std::vector<Vec3> move_with_mesh(const std::vector<Vec3>& points, MeshView mesh,
                                 std::span<const Vec3> positions);

}  // namespace polymorph
