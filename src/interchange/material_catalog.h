// Catalogue of the materials and textures of a sequence, without duplicates.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "base/result.h"
#include "interchange/surface_frame.h"

namespace polymorph {

struct MaterialCatalog {
  std::vector<SurfaceMaterial> materials;  ///< names are unique and valid (identifier())
  std::vector<std::shared_ptr<const Texture>> textures;  ///< the materials' textures, each once

  /// Returns the index of a material; adds it unless a material with the same properties, whatever
  /// its name, is there.
  std::size_t add(const SurfaceMaterial& material);
  /// Adds materials as above. Returns one index per material, in order.
  std::vector<std::size_t> add(const std::vector<SurfaceMaterial>& all);
  /// Returns the index in `textures` of the material's texture; -1 if there is none.
  int find_texture(const SurfaceMaterial& material) const;
};

/// Makes a name that is valid in every file format: ASCII letters, digits and underscores, without
/// a digit at the beginning. Other bytes become underscores.
std::string identifier(const std::string& text);

/// Encodes a texture as an 8-bit PNG without alpha. Errors: kInput if it has no colour channels.
Result<std::string> texture_png(const Texture& texture);

}  // namespace polymorph
