#include "interchange/obj.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstdint>
#include <iterator>
#include <unordered_map>

#include "image/srgb.h"

namespace polymorph {
namespace {

using TextOutput = std::back_insert_iterator<std::string>;

/// Numbers distinct values of up to 96 bits in the order of their first occurrence.
class Numbering {
 public:
  explicit Numbering(std::uint32_t first) : next_(first) {}
  /// Returns the number of the value with the bits `high` and `low`, and whether the value is new.
  std::pair<std::uint32_t, bool> number(std::uint64_t low, std::uint32_t high = 0) {
    const auto [at, is_new] = numbers_[high].try_emplace(low, next_);
    if (is_new) ++next_;
    return {at->second, is_new};
  }
  std::uint32_t next() const { return next_; }

 private:
  /// Number of each value, by its bits `high`, then `low`.
  std::unordered_map<std::uint32_t, std::unordered_map<std::uint64_t, std::uint32_t>> numbers_;
  std::uint32_t next_;
};

std::uint64_t pair_bits(float a, float b) {
  return std::uint64_t{std::bit_cast<std::uint32_t>(a)} << 32 | std::bit_cast<std::uint32_t>(b);
}

/// Writes distinct texture coordinates. Returns, for each corner, the index of its coordinates in
/// the file. `next_index` is the first unused index, which the call advances.
std::vector<std::uint32_t> write_uvs(const SurfaceFrame& frame, std::uint32_t& next_index,
                                     TextOutput out) {
  Numbering numbering(next_index);
  std::vector<std::uint32_t> numbers;
  for (const Vec2 uv : frame.corner_uvs) {
    const auto [number, is_new] = numbering.number(pair_bits(uv.x, uv.y));
    if (is_new) fmt::format_to(out, "vt {} {}\n", uv.x, uv.y);
    numbers.push_back(number);
  }
  next_index = numbering.next();
  return numbers;
}

/// Writes the normals of the points or, if they exist, distinct normals of corners. Returns indices
/// as write_uvs() does; none for a flat surface.
std::vector<std::uint32_t> write_normals(const SurfaceFrame& frame, std::uint32_t& next_index,
                                         TextOutput out) {
  std::vector<std::uint32_t> numbers;
  if (frame.corner_normals.empty()) {
    if (frame.normals.empty()) return numbers;
    for (const Vec3 n : frame.normals) fmt::format_to(out, "vn {} {} {}\n", n.x, n.y, n.z);
    for (const Triangle& t : frame.triangles)
      for (const std::uint32_t v : t.v) numbers.push_back(next_index + v);
    next_index += static_cast<std::uint32_t>(frame.normals.size());
    return numbers;
  }
  Numbering numbering(next_index);
  for (const Vec3 n : frame.corner_normals) {
    const auto [number, is_new] =
        numbering.number(pair_bits(n.x, n.y), std::bit_cast<std::uint32_t>(n.z));
    if (is_new) fmt::format_to(out, "vn {} {} {}\n", n.x, n.y, n.z);
    numbers.push_back(number);
  }
  next_index = numbering.next();
  return numbers;
}

void write_points(const SurfaceFrame& frame, TextOutput out) {
  const bool colored = frame.colors.size() == frame.positions.size();
  const auto encoded = [](float c) { return linear_to_srgb(std::clamp(c, 0.0f, 1.0f)); };
  for (std::size_t i = 0; i < frame.positions.size(); ++i) {
    const Vec3 p = frame.positions[i];
    fmt::format_to(out, "v {} {} {}", p.x, p.y, p.z);
    if (colored) {
      const Vec3 c = frame.colors[i];
      fmt::format_to(out, " {:.4g} {:.4g} {:.4g}", encoded(c.x), encoded(c.y), encoded(c.z));
    }
    *out++ = '\n';
  }
}

}  // namespace

std::string encode_obj(std::span<const SurfaceFrame> frames, const SurfaceSequence& sequence,
                       const std::string& library, MaterialCatalog& catalog) {
  std::string text = "# polymorph surface\n";
  const TextOutput out = std::back_inserter(text);
  if (!library.empty()) fmt::format_to(out, "mtllib {}\n", library);
  std::uint32_t next_point = 1, next_uv = 1, next_normal = 1;
  for (std::size_t a = 0; a < frames.size(); ++a) {
    const SurfaceFrame& frame = frames[a];
    if (a < sequence.actors.size()) fmt::format_to(out, "o {}\n", sequence.actors[a]);
    write_points(frame, out);
    const std::vector<std::uint32_t> uvs = write_uvs(frame, next_uv, out);
    const std::vector<std::uint32_t> normals = write_normals(frame, next_normal, out);
    std::vector<std::size_t> materials;
    if (!library.empty()) materials = catalog.add(frame.materials);
    std::size_t current_material = SIZE_MAX;  // none yet
    for (std::size_t t = 0; t < frame.triangles.size(); ++t) {
      if (!materials.empty()) {
        const std::size_t material = materials[frame.triangle_materials[t]];
        if (material != current_material)
          fmt::format_to(out, "usemtl {}\n", catalog.materials[material].name);
        current_material = material;
      }
      // A corner is v, v/vt, v//vn or v/vt/vn.
      text += 'f';
      for (std::size_t k = 0; k < 3; ++k) {
        const std::size_t c = 3 * t + k;
        fmt::format_to(out, " {}", next_point + frame.triangles[t].v[k]);
        if (!uvs.empty()) fmt::format_to(out, "/{}", uvs[c]);
        if (!normals.empty()) fmt::format_to(out, "{}/{}", uvs.empty() ? "/" : "", normals[c]);
      }
      text += '\n';
    }
    next_point += static_cast<std::uint32_t>(frame.positions.size());
  }
  return text;
}

std::string encode_mtl(const MaterialCatalog& catalog,
                       const std::vector<std::string>& texture_names) {
  std::string text = "# polymorph materials\n";
  const TextOutput out = std::back_inserter(text);
  for (const SurfaceMaterial& m : catalog.materials) {
    // Blinn-Phong exponent 2 / r^2 - 2 of roughness r, at most 998.
    const float exponent = std::max(2 / std::max(m.roughness * m.roughness, 0.002f) - 2, 0.0f);
    fmt::format_to(out, "\nnewmtl {}\nKd {:.6g} {:.6g} {:.6g}\n", m.name, m.color.x, m.color.y,
                   m.color.z);
    // Dielectrics reflect 4 % of the light at normal incidence, metals their colour.
    const Vec3 specular = lerp(Vec3{0.04f, 0.04f, 0.04f}, m.color, m.metallic);
    fmt::format_to(out, "Ks {:.6g} {:.6g} {:.6g}\nNs {:.6g}\nPr {:.6g}\nPm {:.6g}\n", specular.x,
                   specular.y, specular.z, exponent, m.roughness, m.metallic);
    if (m.transmission > 0) fmt::format_to(out, "d {:.6g}\nNi {:.6g}\n", 1 - m.transmission, m.ior);
    if (const int texture = catalog.find_texture(m); texture >= 0)
      fmt::format_to(out, "map_Kd {}\n", texture_names[static_cast<std::size_t>(texture)]);
  }
  return text;
}

}  // namespace polymorph
