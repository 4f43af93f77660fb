// Poses of an animated Assimp scene: node transforms, skins and morph targets at a time.
#pragma once

#include <assimp/scene.h>

#include <map>
#include <vector>

#include "model/assimp/gltf_keys.h"

/// Node transforms and weights of morph targets at a time.
struct Pose {
  std::map<const aiNode*, aiMatrix4x4> locals;   ///< transforms of nodes that the animation moves
  std::map<const aiNode*, aiMatrix4x4> globals;  ///< transforms of all nodes to the scene
  /// Morph target weights of the nodes that have keys or weights of their own.
  std::map<const aiNode*, std::vector<double>> weights;
  /// Joint nodes of each skinned node, in the order of its bones; null for an unknown joint.
  std::map<const aiNode*, std::vector<const aiNode*>> joints;

  /// A node's transform relative to its parent.
  const aiMatrix4x4& local(const aiNode& node) const;
};

/// Computes the pose of a glTF file's scene at a time. `playing`: indices of the active animations.
Pose pose_at(const aiScene& scene, const GltfFile& file, const std::vector<std::size_t>& playing,
             double seconds);

/// Vertices of a mesh in a pose.
struct PosedMesh {
  std::vector<aiVector3D> points, normals;  ///< `normals`: empty where the mesh has none
  bool in_scene = false;  ///< coordinates are the scene's (by a skin), else the node's
};
/// Applies the morph targets and the skin of a node's mesh.
PosedMesh posed_mesh(const Pose& pose, const aiNode& node, const aiMesh& mesh);
