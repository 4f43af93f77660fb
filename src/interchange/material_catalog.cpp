#include "interchange/material_catalog.h"

#include <algorithm>

#include "image/image_io.h"

namespace polymorph {

std::string identifier(const std::string& text) {
  std::string name;
  for (const char c : text) {
    const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
    name += plain ? c : '_';
  }
  return name.empty() || (name[0] >= '0' && name[0] <= '9') ? '_' + name : name;
}

std::size_t MaterialCatalog::add(const SurfaceMaterial& material) {
  const auto known =
      std::find_if(materials.begin(), materials.end(),
                   [&](const SurfaceMaterial& m) { return same_material(m, material); });
  if (known != materials.end()) return static_cast<std::size_t>(known - materials.begin());
  SurfaceMaterial made = material;
  const std::string name = identifier(material.name);
  made.name = name;
  const auto taken = [&] {
    return std::any_of(materials.begin(), materials.end(),
                       [&](const SurfaceMaterial& m) { return m.name == made.name; });
  };
  for (int i = 2; taken(); ++i) made.name = fmt::format("{}_{}", name, i);
  if (made.texture && texture_of(made) < 0) textures.push_back(made.texture);
  materials.push_back(std::move(made));
  return materials.size() - 1;
}

std::vector<std::size_t> MaterialCatalog::add(const std::vector<SurfaceMaterial>& all) {
  std::vector<std::size_t> indices;
  for (const SurfaceMaterial& material : all) indices.push_back(add(material));
  return indices;
}

int MaterialCatalog::texture_of(const SurfaceMaterial& material) const {
  const auto found = std::find(textures.begin(), textures.end(), material.texture);
  return !material.texture || found == textures.end() ? -1
                                                      : static_cast<int>(found - textures.begin());
}

Result<std::string> texture_png(const Image& texture) {
  PngSettings settings;
  settings.effort = PngEffort::kSmall;
  // Colours alone: the renderer leaves a texture's alpha alone, too.
  if (texture.channel_count() == 3) return encode_png(texture, settings);
  Image colors = make_image(texture.width, texture.height, {"R", "G", "B"});
  const int channels[3] = {texture.find_channel("R"), texture.find_channel("G"),
                           texture.find_channel("B")};
  if (std::min({channels[0], channels[1], channels[2]}) < 0)
    return make_error(ErrorCode::kInput, "a texture has no colour channels");
  for (int y = 0; y < texture.height; ++y)
    for (int x = 0; x < texture.width; ++x)
      for (int c = 0; c < 3; ++c) colors.at(x, y, c) = texture.at(x, y, channels[c]);
  return encode_png(colors, settings);
}

}  // namespace polymorph
