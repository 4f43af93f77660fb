#include "model/color_cache.h"

#include <optional>
#include <string>

#include "base/array3.h"
#include "base/cache_file.h"
#include "base/hash.h"
#include "image/image_io.h"

namespace polymorph {
namespace {

/// Hashes all that make_color_volume() reads.
std::string make_color_key(const Model& model, std::span<const FaceClass> face_classes) {
  Hasher hasher;
  hasher.add("color volume").add(kColorVolumeVersion);
  hasher.add(std::span<const Vec3>(model.points)).add(std::span<const Triangle>(model.triangles));
  hasher.add(std::span<const Vec2>(model.corner_uvs)).add(face_classes);
  hasher.add(std::span<const std::uint32_t>(model.triangle_materials));
  hasher.add(model.materials.size());
  for (const Material& material : model.materials)
    hasher.add(std::span<const Vec3>(&material.color, 1)).add(material.texture);
  hasher.add(model.textures.size());
  for (const auto& texture : model.textures) hasher.add(pixel_digest(*texture));
  return hasher.hex();
}

/// Reads the content of a cache file: the grid's origin, cell and points, then the colours. Returns
/// nothing if the content is damaged.
std::optional<ColorVolume> decode_colors(std::string_view bytes) {
  constexpr std::size_t kGridSize = sizeof(Vec3) + sizeof(float) + sizeof(Int3);
  constexpr int kMaxPoints = 1024;  // along an axis, far above the cells of a box's diagonal
  if (bytes.size() < kGridSize) return std::nullopt;
  ColorVolume volume;
  volume.grid.origin = take<Vec3>(bytes);
  volume.grid.cell = take<float>(bytes);
  const Int3 n = volume.grid.points = take<Int3>(bytes);
  const auto is_plausible = [](int points) { return points >= 2 && points <= kMaxPoints; };
  if (!(volume.grid.cell > 0) || !is_plausible(n.x) || !is_plausible(n.y) || !is_plausible(n.z) ||
      bytes.size() != array3_count(n) * sizeof(Vec3))
    return std::nullopt;
  volume.colors = take_array<Vec3>(bytes, array3_count(n));
  return volume;
}

}  // namespace

ColorVolume load_or_make_color_volume(const Model& model, std::span<const FaceClass> face_classes,
                                      const std::filesystem::path& folder) {
  if (folder.empty()) return make_color_volume(model, face_classes);
  const std::string key = make_color_key(model, face_classes);
  if (const auto bytes = load_cached(folder, key, kColorFiles)) {
    const char* problem = nullptr;
    const auto content = cached_content(*bytes, key, kColorFiles, problem);
    std::optional<ColorVolume> stored = content ? decode_colors(*content) : std::nullopt;
    if (stored) return std::move(*stored);
    warn_unusable(folder, key, kColorFiles, "holds no sound colours");
  }
  ColorVolume volume = make_color_volume(model, face_classes);
  std::string bytes;
  put(bytes, volume.grid.origin);
  put(bytes, volume.grid.cell);
  put(bytes, volume.grid.points);
  put_array(bytes, volume.colors);
  store_cached(folder, key, kColorFiles, model.name, bytes);
  return volume;
}

}  // namespace polymorph
