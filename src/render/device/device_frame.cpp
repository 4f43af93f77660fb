#include "render/device/device_frame.h"

#include <algorithm>
#include <cstring>

#include "base/text.h"

namespace polymorph {
namespace {

/// Copies arrays to one block of memory, one after the other. put() returns addresses in the block
/// that will begin at `address`; the contents are written to `bytes`, unless it is null.
class Packer {
 public:
  Packer(const void* address, std::byte* bytes)
      : address_(static_cast<const std::byte*>(address)), bytes_(bytes) {}

  template <class T>
  const T* put(const T* from, std::size_t count) {
    static_assert(std::is_trivially_copyable_v<T>);
    constexpr std::size_t kAlignment = 32;  // bytes
    static_assert(alignof(T) <= kAlignment);
    const std::size_t start = size_;
    size_ += (count * sizeof(T) + kAlignment - 1) / kAlignment * kAlignment;
    if (bytes_ && count > 0) std::memcpy(bytes_ + start, from, count * sizeof(T));
    return reinterpret_cast<const T*>(address_ + start);
  }
  template <class Values>
  auto put(const Values& values) {
    return std::span(put(std::data(values), std::size(values)), std::size(values));
  }
  std::size_t size() const { return size_; }

 private:
  const std::byte* address_;
  std::byte* bytes_;
  std::size_t size_ = 0;
};

DeviceBorders pack_borders(const MaterialBorders& borders, Packer& packer) {
  DeviceBorders packed;
  if (borders.border_index.empty()) return packed;
  const TriangleBvhView bvh = borders.closest->view();
  packed.bvh = {packer.put(bvh.nodes), packer.put(bvh.corners), packer.put(bvh.triangles),
                bvh.is_split};
  const Model& model = *borders.model;
  packed.model = {packer.put(model.points), packer.put(model.triangles),
                  packer.put(model.corner_uvs), packer.put(model.triangle_materials)};
  packed.triangles = packer.put(borders.triangles);
  packed.border_index = packer.put(borders.border_index);
  return packed;
}

DeviceLayer pack_layer(const MaterialLayer& layer, Packer& packer) {
  DeviceLayer packed;
  packed.borders = pack_borders(layer.borders, packer);
  packed.corner_uvs = packer.put(layer.corner_uvs);
  packed.triangle_materials = packer.put(layer.triangle_materials);
  std::vector<DeviceMaterial> materials;
  for (const Material& m : layer.materials)
    materials.push_back(
        {m.color, m.specular, m.roughness, m.metallic, m.transmission, m.ior, m.texture});
  packed.materials = packer.put(materials);
  std::vector<const TextureView*> textures;
  for (const std::shared_ptr<const Texture>& texture : layer.textures) {
    textures.push_back(nullptr);
    if (!texture) continue;
    TextureView view = texture->view();
    view.pixels = packer.put(texture->image.pixels).data();
    if (view.codes) view.codes = packer.put(view.codes, texture->code_count());
    view.code_values = packer.put(texture->code_values).data();
    textures.back() = packer.put(&view, 1);
  }
  packed.textures = packer.put(textures);
  return packed;
}

DeviceTracedMesh pack_mesh(const MeshToTrace& traced, Packer& packer) {
  const RenderMesh& from = *traced.mesh;
  DeviceMesh mesh;
  static_cast<DeviceLayer&>(mesh) = pack_layer(from, packer);
  mesh.positions = packer.put(from.positions);
  mesh.triangles = packer.put(from.triangles);
  mesh.vertex_normals = packer.put(from.vertex_normals);
  mesh.corner_normals = packer.put(from.corner_normals);
  mesh.vertex_colors = packer.put(from.vertex_colors);
  if (traced.moves()) mesh.displacement = packer.put(from.displacement);
  std::vector<DeviceLayer> upper_layers;
  for (const MixedLayer& layer : from.upper_layers) {
    upper_layers.push_back(pack_layer(layer, packer));
    upper_layers.back().opacity = layer.opacity;
  }
  mesh.upper_layers = packer.put(upper_layers);
  mesh.vertex_color_opacity = from.vertex_color_opacity;
  mesh.look = from.look;
  mesh.moves = from.moves;
  return {packer.put(&mesh, 1),         traced.shutter,         traced.margin2, traced.near_limit,
          packer.put(traced.fan_begin), packer.put(traced.fans)};
}

SkyTables pack_sky(const SkyTables& sky, Packer& packer) {
  const auto size = [](int a, int b) {
    return static_cast<std::size_t>(a) * static_cast<std::size_t>(b);
  };
  SkyTables packed = sky;
  packed.texels = packer.put(sky.texels, size(sky.width, sky.height));
  packed.irradiance = packer.put(sky.irradiance, size(kIrradianceCells + 1, kIrradianceCells + 1));
  if (!sky.has_bright) return packed;
  packed.row_cdf = packer.put(sky.row_cdf, size(1, sky.rows + 1));
  packed.column_cdf = packer.put(sky.column_cdf, size(sky.rows, sky.columns + 1));
  packed.pdf = packer.put(sky.pdf, size(sky.rows, sky.columns));
  return packed;
}

/// Tests whether a layer's borders use a hierarchy whose triangles are split among several leaves,
/// as made for models of thousands of long triangles. A search in it returns any of several equally
/// close points, and a GPU may return another one than the CPU.
bool has_split_borders(const MaterialLayer& layer) {
  return !layer.borders.border_index.empty() && layer.borders.closest->view().is_split;
}

}  // namespace

std::string find_device_obstacle(const FrameJob& job) {
  // Maximum bytes of the pixels' sums, one per pixel and node of the tree of samples
  // (list_nodes()). They are copied back at once.
  constexpr double kMaxSums = 2e9;
  if (static_cast<double>(job.image.width) * job.image.height *
          static_cast<double>(list_nodes(job.samples).size()) * sizeof(PixelSum) >
      kMaxSums)
    return "pictures of this size - lower image.width or image.height, or render fewer samples "
           "at once with --samples";
  for (std::uint32_t m = 0; m < job.world.geometry->mesh_count(); ++m)
    if (any_layer(job.world.geometry->mesh(m), has_split_borders))
      return "borders of charts and materials of a model of thousands of long triangles";
  return "";
}

DeviceBuffers size_buffers(const FrameJob& job, const DeviceFrame& frame, std::size_t frame_bytes,
                           std::size_t max_memory) {
  // Maximum number of paths per launch; it bounds the memory of their results (PathLight).
  constexpr std::size_t kMaxPaths = std::size_t{1} << 22;
  const auto width = static_cast<std::size_t>(job.image.width),
             height = static_cast<std::size_t>(job.image.height);
  std::size_t samples = 0;
  for (int first = frame.first_sample, end; first < frame.end_sample; first = end) {
    end = round_end(frame.noise, first, frame.end_sample);
    samples = std::max(samples, static_cast<std::size_t>(end - first));
  }
  const std::size_t pixel_bytes = static_cast<std::size_t>(frame.node_count) * sizeof(PixelSum) +
                                  (frame.finds_centers ? sizeof(MeshHit) : 0) + sizeof(bool);
  std::size_t triangles = 0;
  for (std::uint32_t m = 0; m < job.world.geometry->mesh_count(); ++m)
    triangles += job.world.geometry->mesh(m).triangles.size();
  const std::size_t fixed_bytes =
      frame_bytes + triangles * kHierarchyBytes + width * height * pixel_bytes;
  const std::size_t row_bytes = width * samples * sizeof(PathLight);
  std::size_t rows = std::clamp<std::size_t>(kMaxPaths / (width * samples), 1, height);
  if (max_memory == 0) return {rows, samples, ""};
  rows = std::min(rows, max_memory > fixed_bytes ? (max_memory - fixed_bytes) / row_bytes : 0);
  if (rows > 0) return {rows, samples, ""};
  return {0, 0,
          fmt::format("a frame that takes {} of the GPU's memory, above --max-memory",
                      format_bytes(static_cast<double>(fixed_bytes + row_bytes)))};
}

std::size_t pack_frame(const FrameJob& job, const void* address, std::byte* bytes,
                       DeviceFrame& frame) {
  Packer packer(address, bytes);
  const TracedScene& geometry = *job.world.geometry;
  frame.world = job.world;
  frame.world.geometry = nullptr;  // frame.scene takes its place
  frame.world.sky = pack_sky(job.world.sky, packer);
  frame.world.suns = packer.put(job.world.suns);
  frame.world.lamps = packer.put(job.world.lamps);
  std::vector<DeviceTracedMesh> meshes;
  for (std::uint32_t m = 0; m < geometry.mesh_count(); ++m)
    meshes.push_back(pack_mesh(geometry.mesh_to_trace(m), packer));
  // The hierarchy is built on the device.
  frame.scene = {packer.put(meshes), /*nodes=*/{},      /*triangles=*/{},
                 /*root=*/0,         geometry.bounds(), geometry.slack()};
  frame.camera = job.camera;
  frame.camera.filter = packer.put(job.camera.filter, 1);
  frame.sampler = job.sampler;
  frame.first_sample = job.samples.first;
  frame.end_sample = job.samples.end;
  frame.node_count = static_cast<int>(list_nodes(job.samples).size());
  frame.needs_motion_test = job.needs_motion_test();
  frame.noise = job.image.noise;
  frame.finds_centers = !job.aovs.empty() || frame.needs_motion_test;
  return packer.size();
}

}  // namespace polymorph
