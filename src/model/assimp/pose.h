// Pose of an animated scene of Assimp at a moment: its nodes, skins and morph targets.
#pragma once

#include <assimp/scene.h>

#include <map>
#include <vector>

#include "model/assimp/gltf_keys.h"

/// Places of nodes and weights of morph targets at a moment.
struct Pose {
  std::map<const aiNode*, aiMatrix4x4> locals;   ///< transforms of nodes that the animation moves
  std::map<const aiNode*, aiMatrix4x4> globals;  ///< transforms of all nodes to the scene
  std::map<const aiNode*, std::vector<double>> weights;        ///< weights of morph targets
  std::map<const aiNode*, std::vector<const aiNode*>> joints;  ///< those of a node's bones

  /// A node's transform relative to its parent.
  const aiMatrix4x4& local(const aiNode& node) const;
};

/// Computes the pose of a glTF file's scene at a time. `playing`: indices of its animations that
/// play.
Pose pose_at(const aiScene& scene, const GltfFile& file, const std::vector<std::size_t>& playing,
             double seconds);

/// Vertices of a mesh in a pose.
struct PosedMesh {
  std::vector<aiVector3D> points, normals;  ///< `normals`: empty where the mesh has none
  bool in_scene = false;  ///< whether a skin has put them into the scene's coordinates
};
PosedMesh posed_mesh(const Pose& pose, const aiNode& node, const aiMesh& mesh);
