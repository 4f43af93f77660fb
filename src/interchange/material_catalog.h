// The materials and textures of a whole sequence, each once.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "base/result.h"
#include "interchange/surface_frame.h"

namespace polymorph {

struct MaterialCatalog {
  std::vector<SurfaceMaterial> materials;  ///< names are identifiers, each once
  std::vector<std::shared_ptr<const Image>> textures;

  /// The index of a material; one that is new is taken in.
  std::size_t add(const SurfaceMaterial& material);
  /// The indices of all of a frame's materials, in its order.
  std::vector<std::size_t> add(const std::vector<SurfaceMaterial>& all);
  /// Index into `textures`, or -1.
  int texture_of(const SurfaceMaterial& material) const;
};

/// Letters, digits and underscores, beginning with no digit: what every format takes as a name.
std::string identifier(const std::string& text);

/// A texture as a PNG of 8 bits. Errors: kInput, where it has no colours.
Result<std::string> texture_png(const Image& texture);

}  // namespace polymorph
