// Keys of a glTF file's animations, as it stores them. Assimp 5.2 drops tangents, draws lines in
// place of steps, cuts weights below 0 and takes integers for floats.
#pragma once

#include <assimp/IOSystem.hpp>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

/// Keys of a node's translation, rotation, scale or weights of morph targets.
struct GltfKeys {
  enum class Interpolation : std::uint8_t { kLinear, kStep, kCubicSpline };
  Interpolation interpolation = Interpolation::kLinear;
  bool is_rotation = false;     ///< whether values are quaternions x, y, z, w
  std::size_t width = 0;        ///< numbers of a value
  std::vector<double> seconds;  ///< time of each key, ascending
  /// A value per key; of a cubic spline the tangent before it, the value and the tangent behind it.
  std::vector<double> numbers;

  /// Computes the value at a time, before the first key and after the last one that of the key.
  std::vector<double> value_at(double time) const;
};

struct GltfNode {
  std::vector<std::size_t> children;
  std::vector<std::size_t> joints;  ///< nodes of its skin, in the order of its bones
  std::vector<double> translation{0, 0, 0}, rotation{0, 0, 0, 1}, scale{1, 1, 1};
  std::vector<double> weights;  ///< empty: those of the mesh
};

/// Keys by the node that they move and by what they move: "translation", "weights" and so on.
using GltfAnimation = std::map<std::size_t, std::map<std::string, GltfKeys>>;

struct GltfFile {
  std::vector<std::size_t> roots;
  std::vector<GltfNode> nodes;
  std::vector<GltfAnimation> animations;
  std::vector<std::string> warnings;  ///< keys and extensions that are not read
};

/// Reads nodes and animations of a .glb or .gltf file that Assimp has read. Keys that cannot be
/// read are left out, with a warning. `is_posed`: without it neither is read, and the warnings are
/// those of extensions alone.
GltfFile read_gltf(Assimp::IOSystem& system, const std::string& path, bool is_posed);
