#include "interchange/split_surface.h"

#include <bit>

namespace polymorph {
namespace {

constexpr std::uint32_t kNoVertex = 0xffffffffu;

/// Compares bits, so that a NaN equals itself.
bool same_bits(float a, float b) {
  return std::bit_cast<std::uint32_t>(a) == std::bit_cast<std::uint32_t>(b);
}

}  // namespace

SplitSurface split_corners(const SurfaceFrame& frame, const SplitSettings& settings) {
  const bool uvs = settings.uvs && !frame.corner_uvs.empty();
  const auto is_equal = [&](std::size_t a, std::size_t b) {
    if (uvs && (!same_bits(frame.corner_uvs[a].x, frame.corner_uvs[b].x) ||
                !same_bits(frame.corner_uvs[a].y, frame.corner_uvs[b].y)))
      return false;
    if (!frame.corner_normals.empty() && !(frame.corner_normals[a] == frame.corner_normals[b]))
      return false;
    return !settings.materials || frame.triangle_materials.empty() ||
           frame.triangle_materials[a / 3] == frame.triangle_materials[b / 3];
  };
  SplitSurface split;
  split.triangles.resize(frame.triangles.size());
  // The vertices of each point form a linked list: `first` by point, `next` by vertex.
  std::vector<std::uint32_t> first(frame.positions.size(), kNoVertex), next;
  for (std::size_t c = 0; c < 3 * frame.triangles.size(); ++c) {
    const std::uint32_t point = frame.triangles[c / 3].v[c % 3];
    std::uint32_t vertex = first[point];
    while (vertex != kNoVertex && !is_equal(split.corner_of[vertex], c)) vertex = next[vertex];
    if (vertex == kNoVertex) {
      vertex = static_cast<std::uint32_t>(split.position_of.size());
      split.position_of.push_back(point);
      split.corner_of.push_back(static_cast<std::uint32_t>(c));
      next.push_back(first[point]);
      first[point] = vertex;
    }
    split.triangles[c / 3].v[c % 3] = vertex;
  }
  return split;
}

}  // namespace polymorph
