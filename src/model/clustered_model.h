// Clustered simplification of a model made of many long triangles (mesh/vertex_clustering.h).
#pragma once

#include <optional>

#include "mesh/vertex_clustering.h"
#include "model/model.h"

namespace polymorph {

struct ClusteredModel {
  Model model;           ///< name, points and triangles only
  bool thinned = false;  ///< most of the long triangles are left out
};

/// Clusters a model of many long triangles; returns nothing for all other models.
inline std::optional<ClusteredModel> cluster_long_triangles(const Model& model) {
  std::optional<ClusteredMesh> clustered = cluster_long_triangles(MeshView(model));
  if (!clustered) return std::nullopt;
  ClusteredModel result;
  result.model.name = model.name;
  result.model.points = std::move(clustered->mesh.positions);
  result.model.triangles = std::move(clustered->mesh.triangles);
  result.thinned = clustered->thinned;
  return result;
}

}  // namespace polymorph
