#include "interchange/material_catalog.h"

#include <algorithm>

#include "image/image_io.h"
#include "image/rgb_channels.h"

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
  const auto existing =
      std::find_if(materials.begin(), materials.end(),
                   [&](const SurfaceMaterial& m) { return same_material(m, material); });
  if (existing != materials.end()) return static_cast<std::size_t>(existing - materials.begin());
  SurfaceMaterial added = material;
  const std::string name = identifier(material.name);
  added.name = name;
  const auto is_used = [&] {
    return std::any_of(materials.begin(), materials.end(),
                       [&](const SurfaceMaterial& m) { return m.name == added.name; });
  };
  for (int i = 2; is_used(); ++i) added.name = fmt::format("{}_{}", name, i);
  if (added.texture && find_texture(added) < 0) textures.push_back(added.texture);
  materials.push_back(std::move(added));
  return materials.size() - 1;
}

std::vector<std::size_t> MaterialCatalog::add(const std::vector<SurfaceMaterial>& all) {
  std::vector<std::size_t> indices;
  for (const SurfaceMaterial& material : all) indices.push_back(add(material));
  return indices;
}

int MaterialCatalog::find_texture(const SurfaceMaterial& material) const {
  const auto texture = std::find(textures.begin(), textures.end(), material.texture);
  return !material.texture || texture == textures.end()
             ? -1
             : static_cast<int>(texture - textures.begin());
}

Result<std::string> texture_png(const Texture& texture) {
  PngSettings settings;
  settings.effort = PngEffort::kSmall;
  const Image image = texture_image(texture);
  // Write colours only: the renderer ignores a texture's alpha too.
  if (image.channel_count() == 3) return encode_png(image, settings);
  if (!has_rgb(image)) return make_error(ErrorCode::kInput, "a texture has no colour channels");
  Image colors = make_image(image.width, image.height, {"R", "G", "B"});
  const std::array<int, 3> channels = find_rgb(image);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x)
      for (int c = 0; c < 3; ++c) colors.at(x, y, c) = image.at(x, y, channels[c]);
  return encode_png(colors, settings);
}

}  // namespace polymorph
