#include "model/assimp/pose.h"

#include <algorithm>
#include <string>
#include <utility>

namespace {

/// Sets `nodes[i]` to Assimp's node for node i of the file, for a whole subtree. Both trees have
/// the same order of children; below a node with another number of children, `nodes` stay null.
void pair_nodes(const aiNode& node, std::size_t index, const GltfFile& file,
                std::vector<const aiNode*>& nodes) {
  if (index >= nodes.size()) return;
  nodes[index] = &node;
  const std::vector<std::size_t>& children = file.nodes[index].children;
  if (children.size() != node.mNumChildren) return;
  for (unsigned i = 0; i < node.mNumChildren; ++i)
    pair_nodes(*node.mChildren[i], children[i], file, nodes);
}

/// Lists Assimp's nodes in the file's order. If there are several roots, Assimp adds a common
/// parent.
std::vector<const aiNode*> list_nodes(const aiScene& scene, const GltfFile& file) {
  std::vector<const aiNode*> nodes(file.nodes.size());
  const aiNode& root = *scene.mRootNode;
  if (file.roots.size() == 1)
    pair_nodes(root, file.roots[0], file, nodes);
  else if (file.roots.size() == root.mNumChildren)
    for (unsigned i = 0; i < root.mNumChildren; ++i)
      pair_nodes(*root.mChildren[i], file.roots[i], file, nodes);
  return nodes;
}

using KeysByProperty = std::map<std::string, GltfKeys>;

/// Transform of a node relative to its parent at a time.
aiMatrix4x4 transform_at(const GltfNode& node, const KeysByProperty& keys_by_property,
                         double seconds) {
  const auto value = [&](const char* property, const std::vector<double>& default_value) {
    const auto keys = keys_by_property.find(property);
    return keys == keys_by_property.end() ? default_value : keys->second.value_at(seconds);
  };
  const auto vector = [](const std::vector<double>& v) {
    return aiVector3D(static_cast<ai_real>(v[0]), static_cast<ai_real>(v[1]),
                      static_cast<ai_real>(v[2]));
  };
  const std::vector<double> q = value("rotation", node.rotation);
  const aiMatrix4x4 rotation(aiQuaternion(static_cast<ai_real>(q[3]), static_cast<ai_real>(q[0]),
                                          static_cast<ai_real>(q[1]), static_cast<ai_real>(q[2]))
                                 .GetMatrix());
  aiMatrix4x4 scaling, translation;
  aiMatrix4x4::Scaling(vector(value("scale", node.scale)), scaling);
  aiMatrix4x4::Translation(vector(value("translation", node.translation)), translation);
  // The constructor of aiMatrix4x4 that takes all three would scale after the rotation.
  return translation * rotation * scaling;
}

void add_globals(const aiNode& node, const aiMatrix4x4& parent, Pose& pose) {
  const aiMatrix4x4 global = parent * pose.local(node);
  pose.globals[&node] = global;
  for (unsigned i = 0; i < node.mNumChildren; ++i) add_globals(*node.mChildren[i], global, pose);
}

void apply_animation(const GltfAnimation& animation, const GltfFile& file,
                     const std::vector<const aiNode*>& nodes, double seconds, Pose& pose) {
  for (const auto& [index, keys] : animation) {
    const aiNode* const node = nodes[index];
    if (!node) continue;
    const auto weights = keys.find("weights");
    if (weights != keys.end()) pose.weights[node] = weights->second.value_at(seconds);
    // The transform is animated if there are keys other than those of weights.
    if (keys.size() > (weights != keys.end() ? 1u : 0u))
      pose.locals[node] = transform_at(file.nodes[index], keys, seconds);
  }
}

/// Adds the weighted offsets of the morph targets to a mesh at rest.
void add_targets(const Pose& pose, const aiNode& node, const aiMesh& mesh, PosedMesh& posed) {
  const auto own_weights = pose.weights.find(&node);
  for (unsigned t = 0; t < mesh.mNumAnimMeshes; ++t) {
    const aiAnimMesh& target = *mesh.mAnimMeshes[t];
    const double weight = own_weights == pose.weights.end() ? static_cast<double>(target.mWeight)
                          : t < own_weights->second.size()  ? own_weights->second[t]
                                                            : 0;
    if (weight == 0 || target.mNumVertices != mesh.mNumVertices) continue;
    const auto factor = static_cast<ai_real>(weight);
    for (unsigned i = 0; i < mesh.mNumVertices; ++i) {
      if (target.mVertices) posed.points[i] += (target.mVertices[i] - mesh.mVertices[i]) * factor;
      if (target.mNormals && !posed.normals.empty())
        posed.normals[i] += (target.mNormals[i] - mesh.mNormals[i]) * factor;
    }
  }
}

/// Finds the node that moves a bone: the skin's joint or, if that has another name, the first node
/// with the bone's name.
const aiNode* find_joint(const Pose& pose, const aiNode& node, const aiBone& bone, unsigned index) {
  const auto skin = pose.joints.find(&node);
  if (skin != pose.joints.end() && index < skin->second.size() && skin->second[index] &&
      skin->second[index]->mName == bone.mName)
    return skin->second[index];
  const aiNode* root = &node;
  while (root->mParent) root = root->mParent;
  return root->FindNode(bone.mName);
}

/// Moves vertices by their bones (linear blend skinning), and vertices without bones by their node,
/// all to the scene's coordinates.
void skin(const Pose& pose, const aiNode& node, const aiMesh& mesh, PosedMesh& posed) {
  const std::vector<aiVector3D> points = posed.points, normals = posed.normals;
  std::vector<ai_real> weight_sums(points.size());
  for (aiVector3D& p : posed.points) p = {};
  for (aiVector3D& n : posed.normals) n = {};
  for (unsigned b = 0; b < mesh.mNumBones; ++b) {
    const aiBone& bone = *mesh.mBones[b];
    const auto global = pose.globals.find(find_joint(pose, node, bone, b));
    if (global == pose.globals.end()) continue;
    const aiMatrix4x4 transform = global->second * bone.mOffsetMatrix;
    const aiMatrix3x3 rotation(transform);
    for (unsigned w = 0; w < bone.mNumWeights; ++w) {
      const auto [vertex, weight] = bone.mWeights[w];
      if (vertex >= points.size()) continue;
      posed.points[vertex] += transform * points[vertex] * weight;
      if (!normals.empty()) posed.normals[vertex] += rotation * normals[vertex] * weight;
      weight_sums[vertex] += weight;
    }
  }
  const aiMatrix4x4 node_transform = pose.globals.at(&node);
  // Normals are transformed by the inverse transpose.
  aiMatrix3x3 normal_transform(node_transform);
  if (normal_transform.Determinant() != 0) normal_transform.Inverse().Transpose();
  for (std::size_t i = 0; i < weight_sums.size(); ++i) {
    if (weight_sums[i] > 0) {
      posed.points[i] *= 1 / weight_sums[i];
      continue;
    }
    posed.points[i] = node_transform * points[i];
    if (!normals.empty()) posed.normals[i] = normal_transform * normals[i];
  }
  posed.in_scene = true;
}

}  // namespace

const aiMatrix4x4& Pose::local(const aiNode& node) const {
  const auto entry = locals.find(&node);
  return entry == locals.end() ? node.mTransformation : entry->second;
}

Pose pose_at(const aiScene& scene, const GltfFile& file, const std::vector<std::size_t>& playing,
             double seconds) {
  Pose pose;
  const std::vector<const aiNode*> nodes = list_nodes(scene, file);
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (!nodes[i]) continue;
    if (!file.nodes[i].weights.empty()) pose.weights[nodes[i]] = file.nodes[i].weights;
    for (const std::size_t joint : file.nodes[i].joints)
      pose.joints[nodes[i]].push_back(joint < nodes.size() ? nodes[joint] : nullptr);
  }
  for (const std::size_t index : playing)
    if (index < file.animations.size())
      apply_animation(file.animations[index], file, nodes, seconds, pose);
  add_globals(*scene.mRootNode, {}, pose);
  return pose;
}

PosedMesh posed_mesh(const Pose& pose, const aiNode& node, const aiMesh& mesh) {
  PosedMesh posed;
  posed.points.assign(mesh.mVertices, mesh.mVertices + mesh.mNumVertices);
  if (mesh.HasNormals()) posed.normals.assign(mesh.mNormals, mesh.mNormals + mesh.mNumVertices);
  add_targets(pose, node, mesh, posed);
  if (mesh.HasBones()) skin(pose, node, mesh, posed);
  for (aiVector3D& n : posed.normals) n.NormalizeSafe();
  return posed;
}
