// Keyframes of glTF animations, read from the file itself: Assimp 5.2 drops tangents, interpolates
// step keys linearly, clamps negative weights to 0 and reads integers as floats.
#pragma once

#include <assimp/IOSystem.hpp>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

/// Keys of one property of a node: its translation, rotation, scale or morph target weights.
struct GltfKeys {
  enum class Interpolation : std::uint8_t { kLinear, kStep, kCubicSpline };
  Interpolation interpolation = Interpolation::kLinear;
  bool is_rotation = false;     ///< whether values are quaternions x, y, z, w
  std::size_t width = 0;        ///< numbers per value, e.g. 3 for a translation
  std::vector<double> seconds;  ///< time of each key, ascending
  /// The values of the keys. A key of a cubic spline has three: in-tangent, value and out-tangent.
  std::vector<double> numbers;

  /// Interpolates the value at a time; constant before the first key and after the last one.
  std::vector<double> value_at(double time) const;
};

struct GltfNode {
  std::vector<std::size_t> children;
  std::vector<std::size_t> joints;  ///< joint nodes of its skin, in the order of its bones
  std::vector<double> translation{0, 0, 0}, rotation{0, 0, 0, 1}, scale{1, 1, 1};
  std::vector<double> weights;  ///< morph target weights; if empty, the mesh's own weights apply
};

/// Keys by node index and by name of the property: "translation", "weights" and so on.
using GltfAnimation = std::map<std::size_t, std::map<std::string, GltfKeys>>;

struct GltfFile {
  std::vector<std::size_t> roots;
  std::vector<GltfNode> nodes;
  std::vector<GltfAnimation> animations;
  std::vector<std::string> warnings;  ///< keys and extensions that are not read
};

/// Reads nodes and animations of a .glb or .gltf file that Assimp has read. Keys that cannot be
/// read are left out, with a warning. If `is_posed` is false, only `warnings` is filled, with the
/// extensions that are not supported.
GltfFile read_gltf(Assimp::IOSystem& system, const std::string& path, bool is_posed);
