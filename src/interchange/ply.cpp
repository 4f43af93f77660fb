#include "interchange/ply.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>

#include "base/bytes.h"
#include "image/srgb.h"

namespace polymorph {
namespace {

static_assert(std::endian::native == std::endian::little, "encode_ply writes memory as it is");

/// Tests whether values(frame) has one value per point for every frame.
template <class F>
bool all_have(std::span<const SurfaceFrame> frames, const F& values) {
  return std::all_of(frames.begin(), frames.end(),
                     [&](const SurfaceFrame& f) { return values(f).size() == f.positions.size(); });
}

/// Lists the texture coordinates of each point, which are those of its first corner.
std::vector<Vec2> point_uvs(const SurfaceFrame& frame) {
  std::vector<Vec2> uvs(frame.positions.size());
  if (frame.corner_uvs.empty()) return uvs;
  // In descending order, so that the first corner is written last.
  for (std::size_t c = frame.corner_uvs.size(); c-- > 0;)
    uvs[frame.triangles[c / 3].v[c % 3]] = frame.corner_uvs[c];
  return uvs;
}

}  // namespace

std::string encode_ply(std::span<const SurfaceFrame> frames, const SurfaceSequence& sequence) {
  const bool has_normals = all_have(frames, [](const auto& f) { return std::span(f.normals); });
  const bool has_colors = all_have(frames, [](const auto& f) { return std::span(f.colors); });
  const bool has_labels = all_have(frames, [](const auto& f) { return std::span(f.labels); });
  // Surfaces that stand still have no velocities; zeros are written for them.
  const bool has_velocities = std::any_of(frames.begin(), frames.end(),
                                          [](const auto& f) { return !f.velocities.empty(); });
  const bool has_uvs = std::any_of(frames.begin(), frames.end(),
                                   [](const auto& f) { return !f.corner_uvs.empty(); });
  // Write the header.
  std::size_t points = 0, triangles = 0, label_count = 0;
  for (const SurfaceFrame& frame : frames) {
    points += frame.positions.size();
    triangles += frame.triangles.size();
  }
  std::string bytes = "ply\nformat binary_little_endian 1.0\ncomment polymorph surface\n";
  if (has_labels)
    for (std::size_t a = 0; a < sequence.label_names.size(); ++a)
      for (const std::string& name : sequence.label_names[a])
        bytes += fmt::format("comment label {} {}{}\n", label_count++,
                             sequence.actors.size() > 1 ? sequence.actors[a] + "." : "", name);
  bytes += fmt::format("element vertex {}\nproperty float x\nproperty float y\nproperty float z\n",
                       points);
  if (has_normals) bytes += "property float nx\nproperty float ny\nproperty float nz\n";
  if (has_colors) bytes += "property uchar red\nproperty uchar green\nproperty uchar blue\n";
  if (has_uvs) bytes += "property float s\nproperty float t\n";
  if (has_velocities) bytes += "property float vx\nproperty float vy\nproperty float vz\n";
  if (has_labels) bytes += "property int label\n";
  bytes += fmt::format("element face {}\nproperty list uchar uint vertex_indices\n{}end_header\n",
                       triangles, has_uvs ? "property list uchar float texcoord\n" : "");
  // Write the points. Labels and points of each actor are numbered after those of the actors before
  // it.
  std::uint32_t first_label = 0;
  for (std::size_t a = 0; a < frames.size(); ++a) {
    const SurfaceFrame& frame = frames[a];
    const std::vector<Vec2> uvs_of_points = has_uvs ? point_uvs(frame) : std::vector<Vec2>{};
    for (std::size_t i = 0; i < frame.positions.size(); ++i) {
      put(bytes, frame.positions[i]);
      if (has_normals) put(bytes, frame.normals[i]);
      if (has_colors)
        for (const float c : {frame.colors[i].x, frame.colors[i].y, frame.colors[i].z})
          put(bytes, SrgbQuantizer::instance()(c));
      if (has_uvs) put(bytes, uvs_of_points[i]);
      if (has_velocities) put(bytes, frame.velocities.empty() ? Vec3{} : frame.velocities[i]);
      if (has_labels) put(bytes, first_label + frame.labels[i]);
    }
    if (has_labels) first_label += static_cast<std::uint32_t>(sequence.label_names[a].size());
  }
  // Write the faces.
  std::uint32_t first_point = 0;
  for (const SurfaceFrame& frame : frames) {
    for (std::size_t t = 0; t < frame.triangles.size(); ++t) {
      put(bytes, std::uint8_t{3});
      for (const std::uint32_t v : frame.triangles[t].v) put(bytes, first_point + v);
      if (!has_uvs) continue;
      put(bytes, std::uint8_t{6});  // s and t of three corners
      for (std::size_t k = 0; k < 3; ++k)
        put(bytes, frame.corner_uvs.empty() ? Vec2{} : frame.corner_uvs[3 * t + k]);
    }
    first_point += static_cast<std::uint32_t>(frame.positions.size());
  }
  return bytes;
}

}  // namespace polymorph
