// Catalogue of the materials and textures of a sequence, without duplicates.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "base/result.h"
#include "interchange/surface_frame.h"

namespace polymorph {

struct MaterialCatalog {
  std::vector<SurfaceMaterial> materials;              ///< names are unique identifiers
  std::vector<std::shared_ptr<const Image>> textures;  ///< textures of the materials, each once

  /// Returns the index of a material. Adds the material if it is new.
  std::size_t add(const SurfaceMaterial& material);
  /// Returns the indices of all of a frame's materials, in order.
  std::vector<std::size_t> add(const std::vector<SurfaceMaterial>& all);
  /// Returns the index in `textures` of the material's texture; -1 if it has none.
  int find_texture(const SurfaceMaterial& material) const;
};

/// Makes an identifier that is valid in every format: letters, digits and underscores, without a
/// digit at the beginning.
std::string identifier(const std::string& text);

/// Encodes a texture as an 8-bit PNG. Errors: kInput if it has no colours.
Result<std::string> texture_png(const Image& texture);

}  // namespace polymorph
