// Cryptomatte: mattes with coverage for every object, material and label (Friedman and Jones 2015,
// "Fully automatic ID mattes with support for motion blur and transparency"; specification 1.2.0).
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "image/image.h"
#include "render/path/world.h"
#include "render/render.h"

namespace polymorph {

/// MurmurHash3, the 32-bit variant (Appleby), seed 0.
std::uint32_t murmur_hash(std::string_view text);
/// The id that stands for a name: its hash as the bits of a float that is neither 0, denormal,
/// infinite nor NaN.
float matte_id(std::string_view name);

/// Ids and coverages kept per pixel and layer, two to an RGBA group of channels.
inline constexpr int kMatteRanks = 6;

/// The names of one layer.
struct MatteTable {
  std::string layer;                      ///< "crypto_object"
  std::map<std::string, float> manifest;  ///< names and ids
};

/// What the samples of a pixel met in one layer, and how often.
class MattePixel {
 public:
  void add(float id, float weight);
  /// id, coverage, id, coverage, ... of the kMatteRanks largest coverages, in falling order;
  /// `samples`: of the pixel.
  std::array<float, 2 * kMatteRanks> ranked(float samples) const;

 private:
  std::vector<std::pair<float, float>> sums_;
};

/// The mattes that a frame asks for, and the ids of everything in it.
class Mattes {
 public:
  /// `layers`: image.aovs.
  Mattes(const std::string& layers, const RenderScene& scene);

  std::size_t layer_count() const { return tables_.size(); }
  /// "crypto_object00.R", ... of all layers.
  std::vector<std::string> channels() const;
  /// "cryptomatte/KEY/name", hash, conversion and manifest of all layers.
  std::vector<Attribute> attributes() const;
  /// Adds what one camera ray met first to the pixel's layers (one per layer). Glass counts as
  /// itself; where nothing but the backdrop is seen that is a matte of its own, so that coverages
  /// sum to 1, but with a transparent backdrop to alpha.
  void add_sample(const World& world, const Ray& ray, const Intersection& intersection,
                  MattePixel* pixel) const;

 private:
  enum class Kind : std::uint8_t { kObject, kMaterial, kLabel };
  struct MeshIds {
    float object = 0;
    std::vector<std::vector<float>> materials;  ///< of the mesh's own layer, then of each over it
    std::vector<float> labels;
  };
  float id_of(Kind kind, std::string_view name);
  void add_material(const RenderMesh& mesh, const MeshIds& ids, const MeshHit& hit,
                    MattePixel& pixel) const;
  float label_of(const RenderMesh& mesh, const MeshIds& ids, const MeshHit& hit) const;

  std::vector<Kind> kinds_;
  std::vector<MatteTable> tables_;  ///< one per kind chosen
  std::vector<MeshIds> meshes_;
  std::array<float, 3> ground_{}, backdrop_{};  ///< by layer
  float look_ = 0;
};

}  // namespace polymorph
