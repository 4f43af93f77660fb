#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <optional>
#include <vector>

#include "base/bytes.h"
#include "base/exact_math.h"
#include "base/file.h"
#include "base/hash.h"
#include "base/json.h"
#include "base/program_identity.h"
#include "base/spool.h"
#include "interchange/json_vectors.h"
#include "interchange/material_catalog.h"
#include "interchange/split_surface.h"
#include "interchange/surface_writer.h"
#include "kernels/linear.h"

namespace polymorph {
namespace {

static_assert(std::endian::native == std::endian::little, "glTF's binary part is memory as it is");

// Component types and buffer view targets of glTF 2.0.
constexpr int kByte = 5120, kUnsignedByte = 5121, kUnsignedShort = 5123, kUnsignedInt = 5125,
              kFloat = 5126;
constexpr int kVertexBuffer = 34962, kIndexBuffer = 34963;

/// Sorts the members of all JSON objects by name, as in files of earlier versions.
void sort_members(JsonValue& value) {
  for (JsonValue& item : value.items) sort_members(item);
  for (JsonMember& member : value.members) sort_members(member.value);
  std::sort(value.members.begin(), value.members.end(),
            [](const JsonMember& a, const JsonMember& b) { return a.key < b.key; });
}

/// Maps v, clamped to [0, 1] or, for a signed T, [-1, 1], to integers up to `highest`.
template <class T>
T quantize(float v, float highest) {
  return static_cast<T>(
      std::lround(std::clamp(v, std::is_signed_v<T> ? -1.0f : 0.0f, 1.0f) * highest));
}

/// Vertical field of view in radians.
double field_of_view(const FrameCamera& camera) {
  return 2 * exact::atan(static_cast<double>(camera.tan_half_fov_y));
}

/// A unit quaternion x, y, z, w.
using Rotation = std::array<float, 4>;

/// Computes the rotation of a glTF camera, which looks along -z, to the camera's axes.
Rotation camera_rotation(const FrameCamera& camera) {
  const Vec3d x(camera.right), y(camera.up), z(-camera.forward);
  // Shepperd's method: row k of `products` is 4 q_k (q_x, q_y, q_z, q_w), and squares[k] is 4
  // q_k^2. The row of the largest component is divided by 4 q_k, for accuracy.
  const std::array<double, 4> squares{1 + x.x - y.y - z.z, 1 - x.x + y.y - z.z, 1 - x.x - y.y + z.z,
                                      1 + x.x + y.y + z.z};
  const std::array<std::array<double, 4>, 4> products{
      {{squares[0], x.y + y.x, z.x + x.z, y.z - z.y},
       {x.y + y.x, squares[1], y.z + z.y, z.x - x.z},
       {z.x + x.z, y.z + z.y, squares[2], x.y - y.x},
       {y.z - z.y, z.x - x.z, x.y - y.x, squares[3]}}};
  const auto largest =
      static_cast<std::size_t>(std::max_element(squares.begin(), squares.end()) - squares.begin());
  Rotation rotation;
  for (std::size_t k = 0; k < 4; ++k)
    rotation[k] = static_cast<float>(products[largest][k] / (2 * std::sqrt(squares[largest])));
  return rotation;
}

/// A mesh of the file, its actor, and the frames in which it is visible.
struct MeshSpan {
  std::size_t mesh = 0, actor = 0;  ///< indices into the file's meshes and into the actors
  int first = 0, end = 0;           ///< frames [first, end)
  Vec3 origin;                      ///< position = origin + scale * (quantized position in [0, 1])
  float scale = 1;
  std::string digest;  ///< hash of all the mesh's data; not used with a constant topology
};

/// Writes the binary data to a spool file at once, and collects the JSON that describes it.
class GlbWriter : public SurfaceWriter {
 public:
  GlbWriter(std::filesystem::path path, SurfaceSequence sequence, GlbSettings settings, Spool spool)
      : path_(std::move(path)),
        sequence_(std::move(sequence)),
        settings_(settings),
        spool_(std::move(spool)),
        current_(sequence_.actors.size()) {}

  Status add(int frame, std::span<const SurfaceFrame> frames) override {
    if (sequence_.constant_topology) return add_targets(frame, frames);
    // A mesh is visible until the surface of its actor changes.
    for (std::size_t a = 0; a < frames.size(); ++a) {
      const std::string digest = frames[a].triangles.empty() ? "" : compute_digest(frames[a]);
      std::optional<std::size_t>& current = current_[a];
      if (current && spans_[*current].digest == digest) continue;
      if (current) spans_[*current].end = frame;
      current.reset();
      if (digest.empty()) continue;
      MeshSpan span;
      span.actor = a;
      span.first = frame;
      span.end = sequence_.last_frame + 1;
      span.digest = digest;
      PM_TRY_STATUS(add_mesh(frames[a], fmt::format("{}.{:04}", sequence_.actors[a], frame), span));
      current = spans_.size();
      spans_.push_back(std::move(span));
    }
    return Ok{};
  }

  Status finish() override;

 private:
  std::string compute_digest(const SurfaceFrame& frame);
  std::vector<std::size_t> add_materials(const SurfaceFrame& frame);
  Status add_mesh(const SurfaceFrame& frame, const std::string& name, MeshSpan& span);
  Result<std::size_t> add_view(const std::string& bytes, int target, std::size_t stride = 0);
  /// Type of an accessor's elements, in glTF's terms.
  struct Elements {
    int component;     ///< component type: kFloat, kByte, ...
    const char* type;  ///< "SCALAR", "VEC2", "VEC3" or "VEC4"
    std::size_t count;
    bool normalized = false;
    std::size_t stride = 0;  ///< bytes; 0: packed
  };
  Result<std::size_t> add_accessor(const std::string& bytes, int target, const Elements& elements);
  Status add_vertices(const SurfaceFrame& frame, const SplitSurface& split, JsonValue& attributes);
  Status add_quantized(const SurfaceFrame& frame, const SplitSurface& split, JsonValue& attributes,
                       MeshSpan& span);
  Status add_targets(int frame, std::span<const SurfaceFrame> frames);
  Status add_weights();
  JsonValue material_json(const SurfaceMaterial& material);
  Status add_images();
  void add_nodes();
  Status add_animation();
  bool zooms() const;
  Status add_camera_motion();

  std::filesystem::path path_;
  SurfaceSequence sequence_;
  GlbSettings settings_;
  Spool spool_;  ///< the binary data so far
  MaterialCatalog catalog_;
  /// The file's arrays of buffer views, accessors and so on, and its only animation.
  JsonValue views_ = JsonValue::array(), accessors_ = JsonValue::array(),
            meshes_ = JsonValue::array(), nodes_ = JsonValue::array(), animation_,
            images_ = JsonValue::array();
  std::vector<MeshSpan> spans_;
  std::vector<std::optional<std::size_t>> current_;  ///< one per actor: index of its mesh in
                                                     ///< spans_, empty while no mesh is visible
  /// Constant topology only: each actor's surface in the first frame, and all frame numbers so far.
  std::vector<SurfaceFrame> base_;
  std::vector<int> frames_;
};

template <class T>
void hash_all(Hasher& hasher, const std::vector<T>& values) {
  hasher.add(std::span<const T>(values));
}

/// Adds a frame's materials to the catalogue; returns their indices, one for a mixture.
std::vector<std::size_t> GlbWriter::add_materials(const SurfaceFrame& frame) {
  if (frame.is_mixed) return {catalog_.add(frame.mixture)};
  return catalog_.add(frame.materials);
}

std::string GlbWriter::compute_digest(const SurfaceFrame& frame) {
  Hasher hasher;
  hash_all(hasher, add_materials(frame));
  hash_all(hasher, frame.triangle_materials);
  hash_all(hasher, frame.positions);
  hash_all(hasher, frame.triangles);
  hash_all(hasher, frame.normals);
  hash_all(hasher, frame.velocities);
  hash_all(hasher, frame.corner_normals);
  hash_all(hasher, frame.colors);
  hash_all(hasher, frame.corner_uvs);
  return hasher.hex();
}

/// Adds a buffer view, padded to a multiple of 4 bytes, and returns its index. `target` is
/// kVertexBuffer, kIndexBuffer or 0; a target or stride of 0 is left out.
Result<std::size_t> GlbWriter::add_view(const std::string& bytes, int target, std::size_t stride) {
  JsonValue view = {{"buffer", 0}, {"byteOffset", spool_.size()}, {"byteLength", bytes.size()}};
  if (target != 0) view["target"] = target;
  if (stride != 0) view["byteStride"] = stride;
  PM_TRY_STATUS(spool_.append(bytes));
  PM_TRY_STATUS(spool_.append(std::string((4 - bytes.size() % 4) % 4, '\0')));
  views_.push_back(std::move(view));
  return views_.size() - 1;
}

/// Adds a buffer view and an accessor to all its elements. Returns the accessor's index.
Result<std::size_t> GlbWriter::add_accessor(const std::string& bytes, int target,
                                            const Elements& elements) {
  const auto& [component, type, count, normalized, stride] = elements;
  PM_TRY(const std::size_t view, add_view(bytes, target, stride));
  JsonValue accessor = {
      {"bufferView", view}, {"componentType", component}, {"count", count}, {"type", type}};
  if (normalized) accessor["normalized"] = true;
  accessors_.push_back(std::move(accessor));
  return accessors_.size() - 1;
}

/// Concatenates what fill(bytes, vertex, point) appends for each vertex.
template <class F>
std::string serialize(const SplitSurface& split, const F& fill) {
  std::string bytes;
  for (std::size_t v = 0; v < split.position_of.size(); ++v) fill(bytes, v, split.position_of[v]);
  return bytes;
}

Vec3 normal_at(const SurfaceFrame& frame, const SplitSurface& split, std::size_t vertex) {
  return frame.corner_normals.empty() ? frame.normals[split.position_of[vertex]]
                                      : frame.corner_normals[split.corner_of[vertex]];
}

/// Texture coordinates of glTF, whose v axis points down.
Vec2 uv_at(const SurfaceFrame& frame, const SplitSurface& split, std::size_t vertex) {
  const Vec2 uv = frame.corner_uvs[split.corner_of[vertex]];
  return {uv.x, 1 - uv.y};
}

/// Adds the vertex attributes as floats. Colours, which multiply the material's in glTF, are only
/// for mixtures, whose material is white.
Status GlbWriter::add_vertices(const SurfaceFrame& frame, const SplitSurface& split,
                               JsonValue& attributes) {
  const std::size_t count = split.position_of.size();
  const auto add_attribute = [&](const char* name, const char* type,
                                 const std::string& bytes) -> Status {
    PM_TRY(attributes[name], add_accessor(bytes, kVertexBuffer, {kFloat, type, count}));
    return Ok{};
  };
  Vec3 low = frame.positions[split.position_of[0]], high = low;
  PM_TRY_STATUS(add_attribute(
      "POSITION", "VEC3", serialize(split, [&](std::string& bytes, std::size_t, std::uint32_t p) {
        low = min(low, frame.positions[p]);
        high = max(high, frame.positions[p]);
        put(bytes, frame.positions[p]);
      })));
  accessors_.items.back()["min"] = to_array(low);
  accessors_.items.back()["max"] = to_array(high);
  if (!frame.normals.empty() || !frame.corner_normals.empty())
    PM_TRY_STATUS(add_attribute(
        "NORMAL", "VEC3", serialize(split, [&](std::string& bytes, std::size_t v, std::uint32_t) {
          put(bytes, normal_at(frame, split, v));
        })));
  if (frame.is_mixed)
    PM_TRY_STATUS(add_attribute(
        "COLOR_0", "VEC3", serialize(split, [&](std::string& bytes, std::size_t, std::uint32_t p) {
          put(bytes, frame.colors[p]);
        })));
  // Mixtures have no texture, but a constant topology keeps its texture coordinates.
  if ((!frame.is_mixed || sequence_.constant_topology) && !frame.corner_uvs.empty())
    PM_TRY_STATUS(
        add_attribute("TEXCOORD_0", "VEC2",
                      serialize(split, [&](std::string& bytes, std::size_t v, std::uint32_t) {
                        put(bytes, uv_at(frame, split, v));
                      })));
  // Labels are left out: Blender 5.0 confuses the values of two custom attributes.
  if (!frame.velocities.empty())
    PM_TRY_STATUS(
        add_attribute("_VELOCITY", "VEC3",
                      serialize(split, [&](std::string& bytes, std::size_t, std::uint32_t p) {
                        put(bytes, frame.velocities[p]);
                      })));
  return Ok{};
}

/// Adds the vertex attributes as integers. Sets `span.origin` and `span.scale`, which undo the
/// quantization of positions. Elements are padded to multiples of 4 bytes, as glTF requires.
Status GlbWriter::add_quantized(const SurfaceFrame& frame, const SplitSurface& split,
                                JsonValue& attributes, MeshSpan& span) {
  const std::size_t count = split.position_of.size();
  Vec3 low = frame.positions[split.position_of[0]], high = low;
  for (const std::uint32_t p : split.position_of) {
    low = min(low, frame.positions[p]);
    high = max(high, frame.positions[p]);
  }
  const Vec3 size = high - low;
  span.origin = low;
  span.scale = std::max({size.x, size.y, size.z, 1e-30f});  // not 0, for the division below
  const auto add_attribute = [&](const char* name, const char* type, int component,
                                 std::size_t stride, const std::string& bytes) -> Status {
    PM_TRY(attributes[name], add_accessor(bytes, kVertexBuffer,
                                          {component, type, count, /*normalized=*/true, stride}));
    return Ok{};
  };
  std::array<std::uint16_t, 3> lowest{65535, 65535, 65535}, highest{};
  PM_TRY_STATUS(
      add_attribute("POSITION", "VEC3", kUnsignedShort, /*stride=*/8,
                    serialize(split, [&](std::string& bytes, std::size_t, std::uint32_t p) {
                      const Vec3 scaled = (frame.positions[p] - low) / span.scale;
                      const float components[3] = {scaled.x, scaled.y, scaled.z};
                      for (int k = 0; k < 3; ++k) {
                        const auto q = quantize<std::uint16_t>(components[k], 65535);
                        lowest[k] = std::min(lowest[k], q);
                        highest[k] = std::max(highest[k], q);
                        put(bytes, q);
                      }
                      put(bytes, std::uint16_t{0});
                    })));
  accessors_.items.back()["min"] = lowest;
  accessors_.items.back()["max"] = highest;
  if (!frame.normals.empty() || !frame.corner_normals.empty())
    PM_TRY_STATUS(
        add_attribute("NORMAL", "VEC3", kByte, /*stride=*/4,
                      serialize(split, [&](std::string& bytes, std::size_t v, std::uint32_t) {
                        const Vec3 n = normal_at(frame, split, v);
                        for (const float c : {n.x, n.y, n.z})
                          put(bytes, quantize<std::int8_t>(c, 127));
                        put(bytes, std::int8_t{0});
                      })));
  if (frame.is_mixed)
    PM_TRY_STATUS(
        add_attribute("COLOR_0", "VEC4", kUnsignedShort, /*stride=*/8,
                      serialize(split, [&](std::string& bytes, std::size_t, std::uint32_t p) {
                        const Vec3 color = frame.colors[p];
                        for (const float c : {color.x, color.y, color.z, 1.0f})
                          put(bytes, quantize<std::uint16_t>(c, 65535));
                      })));
  if (frame.is_mixed || frame.corner_uvs.empty()) return Ok{};
  // Coordinates of repeated textures may be outside [0, 1]; they stay floats.
  const bool in_range = std::all_of(frame.corner_uvs.begin(), frame.corner_uvs.end(), [](Vec2 uv) {
    return uv.x >= 0 && uv.x <= 1 && uv.y >= 0 && uv.y <= 1;
  });
  const std::string bytes = serialize(split, [&](std::string& data, std::size_t v, std::uint32_t) {
    const Vec2 uv = uv_at(frame, split, v);
    if (!in_range) return put(data, uv);
    put(data, quantize<std::uint16_t>(uv.x, 65535));
    put(data, quantize<std::uint16_t>(uv.y, 65535));
  });
  PM_TRY(attributes["TEXCOORD_0"], add_accessor(bytes, kVertexBuffer,
                                                {in_range ? kUnsignedShort : kFloat, "VEC2", count,
                                                 /*normalized=*/in_range}));
  return Ok{};
}

/// Adds a mesh with a primitive per material, and sets the members of `span` that describe it.
Status GlbWriter::add_mesh(const SurfaceFrame& frame, const std::string& name, MeshSpan& span) {
  SplitSettings split_settings;
  split_settings.uvs = !frame.is_mixed || sequence_.constant_topology;
  const SplitSurface split = split_corners(frame, split_settings);
  JsonValue attributes = JsonValue::object();
  PM_TRY_STATUS(settings_.quantize ? add_quantized(frame, split, attributes, span)
                                   : add_vertices(frame, split, attributes));
  const std::vector<std::size_t> materials = add_materials(frame);
  std::vector<std::size_t> distinct = materials;
  std::sort(distinct.begin(), distinct.end());
  distinct.erase(std::unique(distinct.begin(), distinct.end()), distinct.end());
  const auto material_at = [&](std::size_t t) {
    return frame.is_mixed ? materials[0] : materials[frame.triangle_materials[t]];
  };
  JsonValue primitives = JsonValue::array();
  // Indices of 16 bits suffice below index 65535, which means primitive restart.
  const bool is_short = split.position_of.size() < 65535;
  for (const std::size_t material : distinct) {
    std::string bytes;
    std::size_t count = 0;
    for (std::size_t t = 0; t < split.triangles.size(); ++t) {
      if (material_at(t) != material) continue;
      for (const std::uint32_t v : split.triangles[t].v)
        is_short ? put(bytes, static_cast<std::uint16_t>(v)) : put(bytes, v);
      count += 3;
    }
    if (count == 0) continue;
    PM_TRY(const std::size_t indices,
           add_accessor(bytes, kIndexBuffer,
                        {is_short ? kUnsignedShort : kUnsignedInt, "SCALAR", count}));
    primitives.push_back(
        {{"attributes", attributes}, {"indices", indices}, {"material", material}});
  }
  meshes_.push_back({{"name", name}, {"primitives", primitives}});
  span.mesh = meshes_.size() - 1;
  return Ok{};
}

/// Adds a frame of a constant topology. The first frame is the mesh. Each further frame is a morph
/// target, which holds the differences of positions, normals and colours from the first.
Status GlbWriter::add_targets(int frame, std::span<const SurfaceFrame> frames) {
  frames_.push_back(frame);
  // Add the meshes of the first frame.
  if (base_.empty()) {
    base_.assign(frames.begin(), frames.end());
    for (std::size_t a = 0; a < frames.size(); ++a) {
      MeshSpan span;
      span.actor = a;
      span.first = frame;
      span.end = sequence_.last_frame + 1;
      // Velocities change from frame to frame, but a morph target cannot change them.
      base_[a].velocities.clear();
      PM_TRY_STATUS(add_mesh(base_[a], sequence_.actors[a], span));
      spans_.push_back(std::move(span));
    }
    return Ok{};
  }
  // Add a target to each actor's mesh.
  for (std::size_t a = 0; a < frames.size(); ++a) {
    const SurfaceFrame &base = base_[a], &surface = frames[a];
    SplitSettings split_settings;
    const SplitSurface split = split_corners(base, split_settings);
    JsonValue target = JsonValue::object();
    const auto add_attribute = [&](const char* name, const std::vector<Vec3>& from,
                                   const std::vector<Vec3>& to) -> Status {
      // A surface may lack normals or colours.
      if (from.empty() || from.size() != to.size()) return Ok{};
      Vec3 low = to[0] - from[0], high = low;
      const std::string bytes =
          serialize(split, [&](std::string& data, std::size_t, std::uint32_t p) {
            const Vec3 offset = to[p] - from[p];
            low = min(low, offset);
            high = max(high, offset);
            put(data, offset);
          });
      PM_TRY(target[name],
             add_accessor(bytes, kVertexBuffer, {kFloat, "VEC3", split.position_of.size()}));
      accessors_.items.back()["min"] = to_array(low);
      accessors_.items.back()["max"] = to_array(high);
      return Ok{};
    };
    PM_TRY_STATUS(add_attribute("POSITION", base.positions, surface.positions));
    PM_TRY_STATUS(add_attribute("NORMAL", base.normals, surface.normals));
    PM_TRY_STATUS(add_attribute("COLOR_0", base.colors, surface.colors));
    for (JsonValue& primitive : meshes_.items[a]["primitives"].items)
      primitive["targets"].push_back(target);
  }
  return Ok{};
}

/// Animates the weights of morph targets: a target has weight 1 at its frame's time, and its weight
/// falls linearly to 0 at the times of the neighbouring frames.
Status GlbWriter::add_weights() {
  const std::size_t targets = frames_.size() - 1;
  JsonValue samplers = JsonValue::array(), channels = JsonValue::array();
  std::string times, weights;
  // At key 0, the mesh has no target of weight above 0; at key k, target k - 1 has weight 1.
  for (std::size_t k = 0; k < frames_.size(); ++k) {
    put(times, static_cast<float>(frames_[k] - sequence_.first_frame) / sequence_.fps);
    for (std::size_t target = 0; target < targets; ++target)
      put(weights, target + 1 == k ? 1.0f : 0.0f);
  }
  PM_TRY(const std::size_t input,
         add_accessor(times, /*target=*/0, {kFloat, "SCALAR", frames_.size()}));
  accessors_.items.back()["min"] = JsonValue::array({0.0f});
  accessors_.items.back()["max"] = JsonValue::array(
      {static_cast<float>(frames_.back() - sequence_.first_frame) / sequence_.fps});
  PM_TRY(const std::size_t output,
         add_accessor(weights, /*target=*/0, {kFloat, "SCALAR", frames_.size() * targets}));
  samplers.push_back({{"input", input}, {"output", output}, {"interpolation", "LINEAR"}});
  for (std::size_t n = 0; n < spans_.size(); ++n) {
    meshes_.items[n]["weights"] = std::vector<float>(targets, 0.0f);
    channels.push_back({{"sampler", 0}, {"target", {{"node", n}, {"path", "weights"}}}});
  }
  animation_ = {{"name", "morph"}, {"samplers", samplers}, {"channels", channels}};
  return Ok{};
}

JsonValue GlbWriter::material_json(const SurfaceMaterial& m) {
  JsonValue pbr = {{"baseColorFactor", JsonValue::array({std::clamp(m.color.x, 0.0f, 1.0f),
                                                         std::clamp(m.color.y, 0.0f, 1.0f),
                                                         std::clamp(m.color.z, 0.0f, 1.0f), 1})},
                   {"metallicFactor", std::clamp(m.metallic, 0.0f, 1.0f)},
                   {"roughnessFactor", std::clamp(m.roughness, 0.0f, 1.0f)}};
  if (const int texture = catalog_.find_texture(m); texture >= 0)
    pbr["baseColorTexture"] = {{"index", texture}};
  JsonValue material = {{"name", m.name}, {"pbrMetallicRoughness", pbr}};
  if (m.transmission > 0)
    material["extensions"] = {
        {"KHR_materials_transmission", {{"transmissionFactor", m.transmission}}},
        {"KHR_materials_ior", {{"ior", m.ior}}}};
  return material;
}

Status GlbWriter::add_images() {
  for (const auto& texture : catalog_.textures) {
    PM_TRY(const std::string png, texture_png(*texture));
    PM_TRY(const std::size_t view, add_view(png, /*target=*/0));
    images_.push_back({{"bufferView", view}, {"mimeType", "image/png"}});
  }
  return Ok{};
}

/// Adds a node per mesh, in the order of spans_, then their parents, one per actor, then the
/// camera.
void GlbWriter::add_nodes() {
  std::vector<JsonValue> children(sequence_.actors.size(), JsonValue::array());
  for (const MeshSpan& span : spans_) {
    JsonValue node = {{"name", meshes_.items[span.mesh]["name"]}, {"mesh", span.mesh}};
    if (!sequence_.constant_topology)
      node["extensions"]["KHR_node_visibility"] = {
          {"visible", span.first == sequence_.first_frame}};
    if (settings_.quantize) node["translation"] = to_array(span.origin);
    // Viewers that play no animation show the first frame.
    const float scale = span.first == sequence_.first_frame ? span.scale : 0.0f;
    if (scale != 1) node["scale"] = JsonValue::array({scale, scale, scale});
    children[span.actor].push_back(nodes_.size());
    nodes_.push_back(std::move(node));
  }
  for (std::size_t a = 0; a < sequence_.actors.size(); ++a)
    if (!children[a].empty())
      nodes_.push_back({{"name", sequence_.actors[a]}, {"children", children[a]}});
  const FrameCamera& c = sequence_.cameras.front();
  JsonValue node = {{"name", "camera"}, {"camera", 0}};
  if (sequence_.cameras.size() == 1) {
    // Column-major; a camera looks along its -z.
    node["matrix"] = JsonValue::array({c.right.x, c.right.y, c.right.z, 0, c.up.x, c.up.y, c.up.z,
                                       0, -c.forward.x, -c.forward.y, -c.forward.z, 0, c.position.x,
                                       c.position.y, c.position.z, 1});
  } else {  // glTF cannot animate a matrix
    node["translation"] = to_array(c.position);
    node["rotation"] = camera_rotation(c);
  }
  nodes_.push_back(std::move(node));
}

/// Tests whether the field of view changes.
bool GlbWriter::zooms() const {
  const std::vector<FrameCamera>& cameras = sequence_.cameras;
  return std::any_of(cameras.begin(), cameras.end(), [&](const FrameCamera& camera) {
    return camera.tan_half_fov_y != cameras.front().tan_half_fov_y;
  });
}

/// Adds the camera's position, rotation and field of view in each frame to the animation.
Status GlbWriter::add_camera_motion() {
  const std::vector<FrameCamera>& cameras = sequence_.cameras;
  if (cameras.size() == 1) return Ok{};
  std::string times, positions, rotations, angles;
  Rotation previous{};
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    put(times, static_cast<float>(i) / sequence_.fps);
    put(positions, cameras[i].position);
    Rotation rotation = camera_rotation(cameras[i]);
    float product = 0;
    for (std::size_t k = 0; k < 4; ++k) product += rotation[k] * previous[k];
    if (product < 0)  // q and -q are the same rotation: take the one nearer to `previous`
      for (float& value : rotation) value = -value;
    put(rotations, rotation);
    previous = rotation;
    put(angles, static_cast<float>(field_of_view(cameras[i])));
  }
  PM_TRY(const std::size_t input,
         add_accessor(times, /*target=*/0, {kFloat, "SCALAR", cameras.size()}));
  accessors_.items.back()["min"] = JsonValue::array({0.0f});
  accessors_.items.back()["max"] =
      JsonValue::array({static_cast<float>(cameras.size() - 1) / sequence_.fps});
  const auto add = [&](const std::string& bytes, const char* type, JsonValue target) -> Status {
    PM_TRY(const std::size_t output,
           add_accessor(bytes, /*target=*/0, {kFloat, type, cameras.size()}));
    animation_["channels"].push_back(
        {{"sampler", animation_["samplers"].size()}, {"target", std::move(target)}});
    animation_["samplers"].push_back(
        {{"input", input}, {"output", output}, {"interpolation", "LINEAR"}});
    return Ok{};
  };
  const std::size_t node = nodes_.size() - 1;  // the camera's, which add_nodes() adds last
  PM_TRY_STATUS(add(positions, "VEC3", {{"node", node}, {"path", "translation"}}));
  PM_TRY_STATUS(add(rotations, "VEC4", {{"node", node}, {"path", "rotation"}}));
  if (!zooms()) return Ok{};
  return add(
      angles, "SCALAR",
      {{"path", "pointer"},
       {"extensions", {{"KHR_animation_pointer", {{"pointer", "/cameras/0/perspective/yfov"}}}}}});
}

/// Animates the scale and the visibility of each mesh, so that it shows only in its frames.
Status GlbWriter::add_animation() {
  JsonValue samplers = JsonValue::array(), channels = JsonValue::array();
  const auto seconds = [&](int frame) {
    return static_cast<float>(frame - sequence_.first_frame) / sequence_.fps;
  };
  for (std::size_t n = 0; n < spans_.size(); ++n) {
    const MeshSpan& span = spans_[n];
    // All meshes have keys until the end of the last frame, so that all samplers are equally long.
    std::vector<float> times;
    std::vector<std::uint8_t> visible;
    const auto add_key = [&](int frame, bool is_visible) {
      times.push_back(seconds(frame));
      visible.push_back(is_visible ? 1 : 0);
    };
    if (span.first > sequence_.first_frame) add_key(sequence_.first_frame, /*is_visible=*/false);
    add_key(span.first, /*is_visible=*/true);
    if (span.end <= sequence_.last_frame) add_key(span.end, /*is_visible=*/false);
    add_key(sequence_.last_frame + 1, span.end > sequence_.last_frame);
    // Write the keys, then a sampler and a channel for the scale and for the visibility.
    std::string time_bytes, scale_bytes;
    std::string visible_bytes(visible.begin(), visible.end());
    for (const float t : times) put(time_bytes, t);
    for (const std::uint8_t v : visible) {
      const float scale = v ? span.scale : 0.0f;
      put(scale_bytes, Vec3{scale, scale, scale});
    }
    PM_TRY(const std::size_t input,
           add_accessor(time_bytes, /*target=*/0, {kFloat, "SCALAR", times.size()}));
    accessors_.items.back()["min"] = JsonValue::array({times.front()});
    accessors_.items.back()["max"] = JsonValue::array({times.back()});
    PM_TRY(const std::size_t scales,
           add_accessor(scale_bytes, /*target=*/0, {kFloat, "VEC3", times.size()}));
    PM_TRY(const std::size_t visibilities,
           add_accessor(visible_bytes, /*target=*/0, {kUnsignedByte, "SCALAR", times.size()}));
    samplers.push_back({{"input", input}, {"output", scales}, {"interpolation", "STEP"}});
    channels.push_back(
        {{"sampler", samplers.size() - 1}, {"target", {{"node", n}, {"path", "scale"}}}});
    samplers.push_back({{"input", input}, {"output", visibilities}, {"interpolation", "STEP"}});
    channels.push_back(
        {{"sampler", samplers.size() - 1},
         {"target",
          {{"path", "pointer"},
           {"extensions",
            {{"KHR_animation_pointer",
              {{"pointer",
                fmt::format("/nodes/{}/extensions/KHR_node_visibility/visible", n)}}}}}}}});
  }
  animation_ = {{"name", "morph"}, {"samplers", samplers}, {"channels", channels}};
  return Ok{};
}

/// Adds the animation and the nodes, builds the JSON, and writes header, JSON and binary data.
Status GlbWriter::finish() {
  // Complete the binary data.
  PM_TRY_STATUS(add_images());
  const bool has_targets = frames_.size() > 1;
  if (has_targets) {
    PM_TRY_STATUS(add_weights());
  } else if (!sequence_.constant_topology) {
    PM_TRY_STATUS(add_animation());
  }
  add_nodes();
  PM_TRY_STATUS(add_camera_motion());
  // Build the JSON.
  JsonValue roots = JsonValue::array();  // actors and camera, whose nodes follow the meshes'
  for (std::size_t n = spans_.size(); n < nodes_.size(); ++n) roots.push_back(n);
  JsonValue extensions = JsonValue::array();
  if (!sequence_.constant_topology)
    extensions = JsonValue::array({"KHR_node_visibility", "KHR_animation_pointer"});
  if (sequence_.constant_topology && zooms()) extensions.push_back("KHR_animation_pointer");
  const FrameCamera& first = sequence_.cameras.front();
  const JsonValue camera{{"type", "perspective"},
                         {"perspective",
                          {{"yfov", field_of_view(first)},
                           {"aspectRatio", first.aspect},
                           {"znear", 0.01f * first.focus}}}};
  const std::string generator = fmt::format("polymorph {}", program_version());
  JsonValue file = {{"asset", {{"version", "2.0"}, {"generator", generator}}},
                    {"scene", 0},
                    {"scenes", JsonValue::array({JsonValue{{"nodes", roots}}})},
                    {"nodes", nodes_},
                    {"cameras", JsonValue::array({camera})},
                    {"extras", {{"fps", sequence_.fps}}}};
  if (!meshes_.empty()) {
    file["meshes"] = meshes_;
    file["accessors"] = accessors_;
    file["bufferViews"] = views_;
    if (!animation_.is_null()) file["animations"] = JsonValue::array({animation_});
    file["buffers"].push_back({{"byteLength", spool_.size()}});
  }
  JsonValue materials = JsonValue::array();
  bool transmits = false;
  for (const SurfaceMaterial& m : catalog_.materials) {
    materials.push_back(material_json(m));
    if (m.transmission > 0 && !transmits) {
      transmits = true;
      extensions.push_back("KHR_materials_transmission");
      extensions.push_back("KHR_materials_ior");
    }
  }
  if (!materials.empty()) file["materials"] = materials;
  if (!images_.empty()) {
    JsonValue textures = JsonValue::array();
    for (std::size_t i = 0; i < images_.size(); ++i)
      textures.push_back({{"source", i}, {"sampler", 0}});
    file["images"] = images_;
    file["textures"] = textures;
    file["samplers"].push_back({{"wrapS", 10497}, {"wrapT", 10497}});  // REPEAT
  }
  if (settings_.quantize) {
    extensions.push_back("KHR_mesh_quantization");
    file["extensionsRequired"].push_back("KHR_mesh_quantization");
  }
  if (!extensions.empty()) file["extensionsUsed"] = extensions;
  sort_members(file);
  // Write the file: its header of 12 bytes, then the JSON and the binary data as chunks, each after
  // a header of 8 bytes. Chunks are padded to multiples of 4 bytes.
  std::string text = format_json(file);
  text.resize((text.size() + 3) / 4 * 4, ' ');
  const std::uint64_t total = 12 + 8 + text.size() + 8 + spool_.size();
  if (total > 0xffffffffull)
    return make_error(ErrorCode::kOutput,
                      "{}: glTF's binary form ends at 4 GiB, and this is {:.1f} GiB - write fewer "
                      "frames with -f, simplify with --error, or write .usda",
                      path_.string(), static_cast<double>(total) / (1u << 30));
  std::string header;
  put(header, std::uint32_t{0x46546c67});  // "glTF"
  put(header, std::uint32_t{2});           // version
  put(header, static_cast<std::uint32_t>(total));
  put(header, static_cast<std::uint32_t>(text.size()));
  put(header, std::uint32_t{0x4e4f534a});  // "JSON"
  header += text;
  put(header, static_cast<std::uint32_t>(spool_.size()));
  put(header, std::uint32_t{0x004e4942});  // "BIN\0"
  return write_file(path_, concatenate({make_source(header), spool_.source({{0, spool_.size()}})}));
}

}  // namespace

Result<std::unique_ptr<SurfaceWriter>> make_glb_writer(const std::filesystem::path& path,
                                                       const SurfaceSequence& sequence,
                                                       const GlbSettings& settings) {
  PM_TRY(Spool spool, Spool::create_for(path));
  return std::unique_ptr<SurfaceWriter>(
      std::make_unique<GlbWriter>(path, sequence, settings, std::move(spool)));
}

}  // namespace polymorph
