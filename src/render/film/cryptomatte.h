// Cryptomatte: ids and coverages of objects, materials and labels per pixel (Friedman and Jones
// 2015, "Fully automatic ID mattes with support for motion blur and transparency";
// specification 1.2.0).
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "image/image.h"
#include "render/film/sample_sums.h"
#include "render/path/world.h"
#include "render/render.h"

namespace polymorph {

/// MurmurHash3, the 32-bit variant (Appleby), seed 0.
std::uint32_t murmur_hash(std::string_view text);
/// Computes the id of a name: a float with the bits of its hash, changed so that it is neither 0,
/// denormal, infinite nor NaN.
float matte_id(std::string_view name);

/// Number of ids with coverage per pixel and layer, two per RGBA group of channels.
inline constexpr int kMatteRanks = 6;

/// Lists the channels of a layer: "crypto_object00.R", ...
std::vector<std::string> list_matte_channels(const std::string& layer);

/// A matte layer and the ids of its names.
struct MatteTable {
  std::string layer;                      ///< name, such as "crypto_object"
  std::map<std::string, float> manifest;  ///< ids by name
};

/// Coverages of the ids that the samples of a pixel hit in one layer.
class MattePixel {
 public:
  /// Adds a weight, the fraction of a sample that shows this id. Weights <= 0 are ignored.
  void add(float id, float weight);
  /// Adds the coverages of further samples.
  void add(const MattePixel& other);
  /// Returns id, coverage, id, coverage, ... of the kMatteRanks largest coverages, in descending
  /// order; `samples`: number of the pixel's samples.
  std::array<float, 2 * kMatteRanks> rank(float samples) const;
  /// Ids and the sums of their weights.
  const std::vector<std::pair<float, float>>& sums() const { return sums_; }

 private:
  std::vector<std::pair<float, float>> sums_;
};

/// Matte layers of a frame, and the ids of its objects, materials and labels.
class Mattes {
 public:
  /// Registers the names of a scene for the layers that `layers` (image.aovs) names.
  Mattes(const std::string& layers, const RenderScene& scene);

  std::size_t layer_count() const { return tables_.size(); }
  std::vector<std::string> layers() const;  ///< names
  /// Lists the channels of all layers.
  std::vector<std::string> channels() const;
  /// Lists the attributes of all layers: "cryptomatte/KEY/name", hash, conversion and manifest.
  std::vector<Attribute> attributes() const;
  /// Adds the first intersection of one camera ray to the current blocks of pixel[0] to
  /// pixel[layer_count() - 1], the sums of the pixel's layers. Glass counts as an opaque surface.
  /// The backdrop has its own id, so that coverages sum to 1, or to alpha if the backdrop is
  /// transparent.
  void add_sample(const World& world, const Ray& ray, const Intersection& intersection,
                  SampleSums<MattePixel>* pixel) const;

 private:
  enum class Kind : std::uint8_t { kObject, kMaterial, kLabel };
  struct MeshIds {
    float object = 0;
    /// Ids of materials: those of the mesh's own layer, then those of each layer of
    /// RenderMesh::over.
    std::vector<std::vector<float>> materials;
    std::vector<float> labels;  ///< ids per label; without labels, that of the object's name
  };
  /// Adds a name to the table of its kind, if the image has that layer, and returns the id.
  float add_id(Kind kind, std::string_view name);
  /// Adds the ids of all materials at a hit, with their weights in the blend of layers.
  void add_material(const RenderMesh& mesh, const MeshIds& ids, const MeshHit& hit,
                    MattePixel& pixel) const;
  /// Finds the id of the label at a hit: of the object's name if the mesh has no labels, and of the
  /// first label if its vertices have none.
  float find_label(const RenderMesh& mesh, const MeshIds& ids, const MeshHit& hit) const;

  std::vector<Kind> kinds_;         ///< the layers that the image has
  std::vector<MatteTable> tables_;  ///< one per entry of kinds_
  std::vector<MeshIds> meshes_;
  std::array<float, 3> ground_{}, backdrop_{};  ///< ids, one per entry of kinds_
  float look_ = 0;                              ///< id of RenderScene::look
};

}  // namespace polymorph
