#include "model/assimp/pose.h"

#include <algorithm>
#include <set>

namespace {

/// The keys around a time, and the share of the second.
template <class Key>
struct KeyPair {
  const Key &first, &second;
  double share = 0;
};
template <class Key>
KeyPair<Key> keys_at(const Key* keys, unsigned count, double ticks) {
  const Key* const end = keys + count;
  const Key* next =
      std::upper_bound(keys, end, ticks, [](double t, const Key& key) { return t < key.mTime; });
  if (next == keys) return {keys[0], keys[0], 0};
  if (next == end) return {end[-1], end[-1], 0};
  const double length = next->mTime - next[-1].mTime;
  return {next[-1], *next, length > 0 ? (ticks - next[-1].mTime) / length : 0};
}

aiVector3D vector_at(const aiVectorKey* keys, unsigned count, double ticks, aiVector3D fallback) {
  if (count == 0) return fallback;
  const auto [a, b, share] = keys_at(keys, count, ticks);
  return a.mValue + (b.mValue - a.mValue) * static_cast<ai_real>(share);
}

aiMatrix4x4 transform_at(const aiNodeAnim& channel, double ticks) {
  aiQuaternion rotation;
  if (channel.mNumRotationKeys > 0) {
    const auto [a, b, share] = keys_at(channel.mRotationKeys, channel.mNumRotationKeys, ticks);
    aiQuaternion::Interpolate(rotation, a.mValue, b.mValue, static_cast<ai_real>(share));
    rotation.Normalize();
  }
  return {vector_at(channel.mScalingKeys, channel.mNumScalingKeys, ticks, {1, 1, 1}), rotation,
          vector_at(channel.mPositionKeys, channel.mNumPositionKeys, ticks, {0, 0, 0})};
}

std::vector<double> weights_at(const aiMeshMorphAnim& channel, double ticks) {
  std::vector<double> weights;
  if (channel.mNumKeys == 0) return weights;
  const auto [a, b, share] = keys_at(channel.mKeys, channel.mNumKeys, ticks);
  const auto add = [&](const aiMeshMorphKey& key, double part) {
    for (unsigned i = 0; i < key.mNumValuesAndWeights; ++i) {
      const std::size_t target = key.mValues[i];
      constexpr std::size_t kMaxTargets = 4096;
      if (target >= kMaxTargets) continue;
      if (weights.size() <= target) weights.resize(target + 1);
      weights[target] += part * key.mWeights[i];
    }
  };
  add(a, 1 - share);
  if (share > 0) add(b, share);
  return weights;
}

void add_globals(const aiNode& node, const aiMatrix4x4& parent, Pose& pose) {
  const aiMatrix4x4 global = parent * pose.local(node);
  pose.globals[node.mName.C_Str()] = global;
  for (unsigned i = 0; i < node.mNumChildren; ++i) add_globals(*node.mChildren[i], global, pose);
}

/// Names of the nodes and morph targets that an animation moves.
std::set<std::string> moved_by(const aiAnimation& animation) {
  std::set<std::string> moved;
  for (unsigned i = 0; i < animation.mNumChannels; ++i)
    moved.insert(std::string("node ") + animation.mChannels[i]->mNodeName.C_Str());
  for (unsigned i = 0; i < animation.mNumMorphMeshChannels; ++i)
    moved.insert(std::string("morph ") + animation.mMorphMeshChannels[i]->mName.C_Str());
  return moved;
}

void play(const aiAnimation& animation, double seconds, Pose& pose) {
  constexpr double kUnknown = 25;
  const double ticks =
      seconds * (animation.mTicksPerSecond > 0 ? animation.mTicksPerSecond : kUnknown);
  for (unsigned i = 0; i < animation.mNumChannels; ++i)
    pose.locals[animation.mChannels[i]->mNodeName.C_Str()] =
        transform_at(*animation.mChannels[i], ticks);
  for (unsigned i = 0; i < animation.mNumMorphMeshChannels; ++i)
    pose.weights[animation.mMorphMeshChannels[i]->mName.C_Str()] =
        weights_at(*animation.mMorphMeshChannels[i], ticks);
}

/// Adds the morph targets, each by its weight, to a mesh at rest.
void add_targets(const Pose& pose, const aiNode& node, const aiMesh& mesh, PosedMesh& posed) {
  const auto own = pose.weights.find(node.mName.C_Str());
  for (unsigned t = 0; t < mesh.mNumAnimMeshes; ++t) {
    const aiAnimMesh& target = *mesh.mAnimMeshes[t];
    const double weight = own == pose.weights.end() ? static_cast<double>(target.mWeight)
                          : t < own->second.size()  ? own->second[t]
                                                    : 0;
    if (weight == 0 || target.mNumVertices != mesh.mNumVertices) continue;
    const auto share = static_cast<ai_real>(weight);
    for (unsigned i = 0; i < mesh.mNumVertices; ++i) {
      if (target.mVertices) posed.points[i] += (target.mVertices[i] - mesh.mVertices[i]) * share;
      if (target.mNormals && !posed.normals.empty())
        posed.normals[i] += (target.mNormals[i] - mesh.mNormals[i]) * share;
    }
  }
}

/// Moves vertices by their bones: linear blend skinning.
void skin(const Pose& pose, const aiMesh& mesh, PosedMesh& posed) {
  const std::vector<aiVector3D> points = posed.points, normals = posed.normals;
  std::vector<ai_real> sums(points.size());
  for (aiVector3D& p : posed.points) p = {};
  for (aiVector3D& n : posed.normals) n = {};
  for (unsigned b = 0; b < mesh.mNumBones; ++b) {
    const aiBone& bone = *mesh.mBones[b];
    const auto found = pose.globals.find(bone.mName.C_Str());
    if (found == pose.globals.end()) continue;
    const aiMatrix4x4 moved = found->second * bone.mOffsetMatrix;
    const aiMatrix3x3 turned(moved);
    for (unsigned w = 0; w < bone.mNumWeights; ++w) {
      const auto [vertex, weight] = bone.mWeights[w];
      if (vertex >= points.size()) continue;
      posed.points[vertex] += moved * points[vertex] * weight;
      if (!normals.empty()) posed.normals[vertex] += turned * normals[vertex] * weight;
      sums[vertex] += weight;
    }
  }
  for (std::size_t i = 0; i < sums.size(); ++i) {
    if (sums[i] > 0)
      posed.points[i] *= 1 / sums[i];
    else
      posed.points[i] = points[i];
  }
  posed.in_scene = true;
}

}  // namespace

const aiMatrix4x4& Pose::local(const aiNode& node) const {
  const auto found = locals.find(node.mName.C_Str());
  return found == locals.end() ? node.mTransformation : found->second;
}

Pose pose_at(const aiScene& scene, double seconds) {
  Pose pose;
  std::set<std::string> moved;
  for (unsigned i = 0; i < scene.mNumAnimations; ++i) {
    const aiAnimation& animation = *scene.mAnimations[i];
    const std::set<std::string> own = moved_by(animation);
    if (std::any_of(own.begin(), own.end(), [&](const auto& name) { return moved.contains(name); }))
      continue;
    moved.insert(own.begin(), own.end());
    play(animation, seconds, pose);
  }
  add_globals(*scene.mRootNode, {}, pose);
  return pose;
}

PosedMesh posed_mesh(const Pose& pose, const aiNode& node, const aiMesh& mesh) {
  PosedMesh posed;
  posed.points.assign(mesh.mVertices, mesh.mVertices + mesh.mNumVertices);
  if (mesh.HasNormals()) posed.normals.assign(mesh.mNormals, mesh.mNormals + mesh.mNumVertices);
  add_targets(pose, node, mesh, posed);
  if (mesh.HasBones()) skin(pose, mesh, posed);
  for (aiVector3D& n : posed.normals) n.NormalizeSafe();
  return posed;
}
