#include <algorithm>
#include <charconv>
#include <cmath>
#include <initializer_list>
#include <optional>

#include "base/file.h"
#include "base/program_identity.h"
#include "base/spool.h"
#include "interchange/material_catalog.h"
#include "interchange/surface_writer.h"

namespace polymorph {
namespace {

/// Text of an attribute's values in all frames, stored on disk. A value that stays the same is
/// written only at the first and last of its frames, since interpolation between equal values gives
/// the same value.
class TimeSamples {
 public:
  /// Adds the value at a frame, in ascending order of frames.
  Status add(int frame, std::string value, Spool& spool) {
    if (frame_ && value == value_) {
      repeats_ = true;
      frame_ = frame;
      return Ok{};
    }
    PM_TRY_STATUS(end_run(spool));
    value_ = std::move(value);
    frame_ = frame;
    return write(spool);
  }
  /// Writes the last value at its last frame. Must be called before ranges().
  Status end_run(Spool& spool) {
    if (!repeats_) return Ok{};
    repeats_ = false;
    return write(spool);
  }
  /// The value at the last frame.
  const std::string& last() const { return value_; }
  const std::vector<Spool::Range>& ranges() const { return ranges_; }

 private:
  Status write(Spool& spool) {
    const std::uint64_t first = spool.size();
    PM_TRY_STATUS(spool.append(fmt::format("            {}: ", *frame_)));
    PM_TRY_STATUS(spool.append(value_));
    PM_TRY_STATUS(spool.append(",\n"));
    ranges_.push_back({first, spool.size() - first});
    return Ok{};
  }
  std::vector<Spool::Range> ranges_;
  std::string value_;         ///< the value at `frame_`
  std::optional<int> frame_;  ///< the latest frame
  bool repeats_ = false;      ///< `frame_` is not written yet, because the value stays the same
};

// Each put() writes a number as text at `to` and returns the end of the text. `to` must have room:
// 12 bytes for an integer, 24 for a float.
char* put(char* to, std::uint32_t v) { return std::to_chars(to, to + 12, v).ptr; }
char* put(char* to, int v) { return std::to_chars(to, to + 12, v).ptr; }
/// Writes the shortest text that reads back to the same float.
char* put(char* to, float v) { return std::to_chars(to, to + 24, v).ptr; }

/// A number to be written with six significant digits: enough for normals, velocities and colours.
struct Rounded {
  float value;
};
/// Writes a rounded number without trailing zeros.
char* put(char* to, Rounded r) {
  const double magnitude = std::abs(static_cast<double>(r.value));
  if (!(magnitude >= 1e-4 && magnitude < 9.99999))
    return std::to_chars(to, to + 24, r.value, std::chars_format::general, 6).ptr;
  // Fast path for numbers without exponent and with one digit at most before the point: one
  // multiplication gives the six digits as an integer. 1 / `unit` is the place value of the last.
  std::uint32_t unit = 100000;
  while (magnitude * unit < 99999.5) unit *= 10;
  auto digits = static_cast<std::uint32_t>(std::lrint(magnitude * unit));
  if (r.value < 0) *to++ = '-';
  *to++ = static_cast<char>('0' + digits / unit);
  digits %= unit;
  if (digits > 0) *to++ = '.';
  while (digits > 0) {
    unit /= 10;
    *to++ = static_cast<char>('0' + digits / unit);
    digits %= unit;
  }
  return to;
}
/// Writes numbers as "(a, b, c)".
template <class T>
char* put_tuple(char* to, std::initializer_list<T> numbers) {
  *to++ = '(';
  for (const T& number : numbers) {
    if (&number != numbers.begin()) *to++ = ',', *to++ = ' ';
    to = put(to, number);
  }
  *to++ = ')';
  return to;
}
struct RoundedVec3 {
  Vec3 value;
};
char* put(char* to, RoundedVec3 r) {
  return put_tuple(to, {Rounded{r.value.x}, Rounded{r.value.y}, Rounded{r.value.z}});
}
char* put(char* to, Vec2 v) { return put_tuple(to, {v.x, v.y}); }
char* put(char* to, Vec3 v) { return put_tuple(to, {v.x, v.y, v.z}); }

/// Formats convert(item) of all items as "[a, b, c]".
template <class T, class F>
std::string format_list(const std::vector<T>& items, const F& convert) {
  constexpr std::size_t kMaxItem = 96;  // bytes of one item
  std::string text(2 + kMaxItem, '[');  // only the first '[' stays
  std::size_t size = 1;
  for (const T& item : items) {
    if (text.size() < size + kMaxItem) text.resize(2 * text.size());
    char* to = text.data() + size;
    if (size > 1) *to++ = ',', *to++ = ' ';
    size = static_cast<std::size_t>(put(to, convert(item)) - text.data());
  }
  text.resize(size);
  text += ']';
  return text;
}

/// Formats integers, or floats that read back unchanged.
template <class T>
std::string format_exact(const std::vector<T>& values) {
  return format_list(values, [](const T& v) { return v; });
}
std::string format_rounded(const std::vector<Vec3>& values) {
  return format_list(values, [](Vec3 v) { return RoundedVec3{v}; });
}

/// Quotes a string for USD; control characters become spaces.
std::string quote(const std::string& text) {
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') quoted += '\\';
    quoted += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
  }
  return quoted + '"';
}
std::string quote(const std::vector<std::string>& texts) {
  std::vector<std::string> quoted;
  for (const std::string& text : texts) quoted.push_back(quote(text));
  return fmt::format("[{}]", fmt::join(quoted, ", "));
}

/// Samples of a Mesh prim. An actor has one for each set of materials that its surface shows, with
/// the surface in the frames that show this set and an empty mesh in all others. So programs that
/// read material bindings only once, such as Blender, show the right materials.
struct MeshSamples {
  std::string name;
  bool is_mixed = false;               ///< shows vertex colours
  std::vector<std::size_t> materials;  ///< ascending indices into the catalogue; none if mixed
  TimeSamples visibility, extent, counts, indices, points, normals, normal_indices, velocities,
      colors, uvs, uv_indices, labels, roughness, metallic;
  std::vector<TimeSamples> subsets;  ///< faces of each material; empty if there is only one
};

/// Meshes of an actor, in the order in which frames show them.
struct ActorSamples {
  std::string name;  ///< unique name of the actor's prim
  std::vector<MeshSamples> meshes;
  std::size_t current_mesh = 0;  ///< index of the mesh that the latest frame shows
};

class UsdWriter : public SurfaceWriter {
 public:
  UsdWriter(std::filesystem::path path, SurfaceSequence sequence, bool overwrite, Spool spool)
      : path_(std::move(path)),
        sequence_(std::move(sequence)),
        overwrite_(overwrite),
        spool_(std::move(spool)) {
    for (const std::string& actor : sequence_.actors) {
      std::string name = identifier(actor);
      const auto is_name_taken = [&] {
        return name == "camera" || name == "materials" ||
               std::any_of(actors_.begin(), actors_.end(),
                           [&](const ActorSamples& a) { return a.name == name; });
      };
      for (int i = 2; is_name_taken(); ++i) name = fmt::format("{}_{}", identifier(actor), i);
      actors_.emplace_back().name = name;
    }
  }

  Status add(int frame, std::span<const SurfaceFrame> frames) override {
    for (std::size_t a = 0; a < frames.size(); ++a)
      PM_TRY_STATUS(add_actor(frame, frames[a], actors_[a]));
    frames_.push_back(frame);
    return Ok{};
  }
  Status finish() override;

 private:
  Status add_actor(int frame, const SurfaceFrame& surface, ActorSamples& actor);
  Status choose_mesh(const SurfaceFrame& surface, ActorSamples& actor);
  Status add_surface(int frame, const SurfaceFrame& surface, MeshSamples& mesh);
  Status add_hidden(int frame, MeshSamples& mesh);
  Status add_subsets(int frame, const SurfaceFrame& surface, MeshSamples& mesh);
  std::string format_header() const;
  std::string format_camera() const;
  std::string format_material(const std::string& name, const SurfaceMaterial& m) const;
  void add_mesh(const ActorSamples& actor, const MeshSamples& mesh,
                const std::vector<std::string>& label_names, std::vector<ByteSource>& out);
  void add_mixed_material(const ActorSamples& actor, const MeshSamples& mesh,
                          std::vector<ByteSource>& out);
  Status end_runs();
  Status write_textures();
  std::string texture_name(std::size_t index) const {
    return fmt::format("{}.texture{}.png", path_.stem().string(), index + 1);
  }
  /// Stores a text in `texts_` and returns its source.
  ByteSource text(std::string bytes) {
    texts_.push_back(std::make_unique<std::string>(std::move(bytes)));
    return make_source(*texts_.back());
  }

  std::filesystem::path path_;
  SurfaceSequence sequence_;
  bool overwrite_;
  Spool spool_;
  MaterialCatalog catalog_;
  std::vector<ActorSamples> actors_;
  std::vector<int> frames_;
  std::vector<std::unique_ptr<std::string>> texts_;  ///< texts that sources refer to
};

/// Lists the distinct corner values of each point, and each corner's index into this list.
template <class T>
void index_corners(const SurfaceFrame& surface, const std::vector<T>& corners,
                   std::vector<T>& values, std::vector<std::uint32_t>& indices) {
  constexpr std::uint32_t kNone = 0xffffffffu;
  // The values of each point form a linked list: `first` by point, `next` by value.
  std::vector<std::uint32_t> first(surface.positions.size(), kNone), next;
  for (std::size_t c = 0; c < corners.size(); ++c) {
    const std::uint32_t point = surface.triangles[c / 3].v[c % 3];
    std::uint32_t index = first[point];
    while (index != kNone && !(values[index] == corners[c])) index = next[index];
    if (index == kNone) {
      index = static_cast<std::uint32_t>(values.size());
      values.push_back(corners[c]);
      next.push_back(first[point]);
      first[point] = index;
    }
    indices.push_back(index);
  }
}

Status UsdWriter::add_actor(int frame, const SurfaceFrame& surface, ActorSamples& actor) {
  PM_TRY_STATUS(choose_mesh(surface, actor));
  for (std::size_t i = 0; i < actor.meshes.size(); ++i)
    PM_TRY_STATUS(i == actor.current_mesh ? add_surface(frame, surface, actor.meshes[i])
                                          : add_hidden(frame, actor.meshes[i]));
  return Ok{};
}

/// Makes the actor's mesh with the surface's set of materials the current one; adds it if it is
/// new. The mesh does not change for an empty surface.
Status UsdWriter::choose_mesh(const SurfaceFrame& surface, ActorSamples& actor) {
  if (surface.triangles.empty() && !actor.meshes.empty()) return Ok{};
  std::vector<std::size_t> materials;
  if (!surface.is_mixed) {
    materials = catalog_.add(surface.materials);
    std::sort(materials.begin(), materials.end());
    materials.erase(std::unique(materials.begin(), materials.end()), materials.end());
  }
  const auto existing =
      std::find_if(actor.meshes.begin(), actor.meshes.end(), [&](const MeshSamples& mesh) {
        return mesh.is_mixed == surface.is_mixed && mesh.materials == materials;
      });
  actor.current_mesh = static_cast<std::size_t>(existing - actor.meshes.begin());
  if (existing != actor.meshes.end()) return Ok{};
  MeshSamples& mesh = actor.meshes.emplace_back();
  mesh.is_mixed = surface.is_mixed;
  mesh.materials = materials;
  const std::string name =
      materials.empty() ? "surface" : catalog_.materials[materials.front()].name;
  mesh.name = name;
  const auto is_taken = [&] {
    return std::any_of(actor.meshes.begin(), actor.meshes.end() - 1,
                       [&](const MeshSamples& other) { return other.name == mesh.name; });
  };
  for (int i = 2; is_taken(); ++i) mesh.name = fmt::format("{}_{}", name, i);
  mesh.subsets.resize(materials.size() > 1 ? materials.size() : 0);
  // The new mesh is empty in all earlier frames.
  if (!frames_.empty()) PM_TRY_STATUS(add_hidden(frames_.front(), mesh));
  if (frames_.size() > 1) PM_TRY_STATUS(add_hidden(frames_.back(), mesh));
  return Ok{};
}

/// Hides a mesh at a frame: makes it invisible and, as not every program reads animated visibility,
/// empty.
Status UsdWriter::add_hidden(int frame, MeshSamples& mesh) {
  return add_surface(frame, SurfaceFrame{}, mesh);
}

/// Adds the values of all attributes of a mesh at a frame.
Status UsdWriter::add_surface(int frame, const SurfaceFrame& surface, MeshSamples& mesh) {
  std::vector<std::uint32_t> indices;
  for (const Triangle& t : surface.triangles) indices.insert(indices.end(), t.v, t.v + 3);
  Vec3 low, high;
  if (!surface.positions.empty()) low = high = surface.positions.front();
  for (const Vec3 p : surface.positions) {
    low = min(low, p);
    high = max(high, p);
  }
  std::vector<Vec3> velocities = surface.velocities;
  velocities.resize(surface.positions.size());
  const std::vector<int> counts(surface.triangles.size(), 3);
  PM_TRY_STATUS(mesh.visibility.add(
      frame, surface.triangles.empty() ? "\"invisible\"" : "\"inherited\"", spool_));
  PM_TRY_STATUS(mesh.extent.add(frame, format_exact(std::vector<Vec3>{low, high}), spool_));
  PM_TRY_STATUS(mesh.counts.add(frame, format_exact(counts), spool_));
  const std::string points_of_corners = format_exact(indices);
  PM_TRY_STATUS(mesh.indices.add(frame, points_of_corners, spool_));
  PM_TRY_STATUS(mesh.points.add(frame, format_exact(surface.positions), spool_));
  // If any frame has normals per corner, normals have indices in all frames; those of normals per
  // point are the indices of the points.
  if (surface.corner_normals.empty()) {
    PM_TRY_STATUS(mesh.normals.add(frame, format_rounded(surface.normals), spool_));
    if (sequence_.has_corner_normals)
      PM_TRY_STATUS(mesh.normal_indices.add(
          frame, surface.normals.empty() ? "[]" : points_of_corners, spool_));
  } else {
    std::vector<Vec3> normals;
    std::vector<std::uint32_t> normal_indices;
    index_corners(surface, surface.corner_normals, normals, normal_indices);
    PM_TRY_STATUS(mesh.normals.add(frame, format_rounded(normals), spool_));
    PM_TRY_STATUS(mesh.normal_indices.add(frame, format_exact(normal_indices), spool_));
  }
  PM_TRY_STATUS(mesh.velocities.add(frame, format_rounded(velocities), spool_));
  PM_TRY_STATUS(mesh.colors.add(frame, format_rounded(surface.colors), spool_));
  PM_TRY_STATUS(mesh.labels.add(frame, format_exact(surface.labels), spool_));
  std::vector<Vec2> uvs;
  std::vector<std::uint32_t> uv_indices;
  index_corners(surface, surface.corner_uvs, uvs, uv_indices);
  // Faces without texture coordinates get dummies, because a primvar must fit its faces at all
  // times.
  if (uvs.empty()) {
    uvs.emplace_back();
    uv_indices.assign(3 * surface.triangles.size(), 0);
  }
  PM_TRY_STATUS(mesh.uvs.add(frame, format_exact(uvs), spool_));
  PM_TRY_STATUS(mesh.uv_indices.add(frame, format_exact(uv_indices), spool_));
  return add_subsets(frame, surface, mesh);
}

/// Adds the faces of each material if there are several, or a mixture's roughness and metalness.
Status UsdWriter::add_subsets(int frame, const SurfaceFrame& surface, MeshSamples& mesh) {
  std::vector<std::vector<std::uint32_t>> faces(mesh.subsets.size());
  if (!faces.empty() && !surface.triangles.empty()) {
    const std::vector<std::size_t> materials = catalog_.add(surface.materials);
    for (std::uint32_t t = 0; t < surface.triangles.size(); ++t) {
      const auto at = std::lower_bound(mesh.materials.begin(), mesh.materials.end(),
                                       materials[surface.triangle_materials[t]]);
      faces[static_cast<std::size_t>(at - mesh.materials.begin())].push_back(t);
    }
  }
  for (std::size_t m = 0; m < faces.size(); ++m)
    PM_TRY_STATUS(mesh.subsets[m].add(frame, format_exact(faces[m]), spool_));
  if (!mesh.is_mixed) return Ok{};
  const SurfaceMaterial& mixture = surface.mixture;
  PM_TRY_STATUS(mesh.roughness.add(frame, fmt::format("{:.6g}", mixture.roughness), spool_));
  return mesh.metallic.add(frame, fmt::format("{:.6g}", mixture.metallic), spool_);
}

std::string UsdWriter::format_header() const {
  return fmt::format(
      "#usda 1.0\n(\n    defaultPrim = \"morph\"\n    doc = \"polymorph {}\"\n"
      "    upAxis = \"Y\"\n    metersPerUnit = 1\n    startTimeCode = {}\n"
      "    endTimeCode = {}\n    timeCodesPerSecond = {}\n    framesPerSecond = {}\n)\n\n"
      "def Xform \"morph\"\n{{\n",
      program_version(), sequence_.first_frame, sequence_.last_frame, sequence_.fps, sequence_.fps);
}

std::string UsdWriter::format_camera() const {
  // Width in tenths of a scene unit, as the focal length, which is chosen for the field of view.
  constexpr float kAperture = 24;
  const std::vector<FrameCamera>& cameras = sequence_.cameras;
  const float height = kAperture / cameras.front().aspect;
  // Formats an attribute: one value if it is constant, else time samples.
  const auto put = [&](const char* name, const auto& value_of) {
    const std::string value = value_of(cameras.front());
    if (std::all_of(cameras.begin(), cameras.end(),
                    [&](const FrameCamera& c) { return value_of(c) == value; }))
      return fmt::format("        {} = {}\n", name, value);
    std::string samples = fmt::format("        {}.timeSamples = {{\n", name);
    for (std::size_t i = 0; i < cameras.size(); ++i)
      samples += fmt::format("            {}: {},\n", sequence_.first_frame + static_cast<int>(i),
                             value_of(cameras[i]));
    return samples + "        }\n";
  };
  return fmt::format(
             "    def Camera \"camera\"\n    {{\n"
             "        token projection = \"perspective\"\n"
             "        float horizontalAperture = {:.6g}\n        float verticalAperture = {:.6g}\n",
             kAperture, height) +
         put("float focalLength",
             [&](const FrameCamera& c) {
               return fmt::format("{:.6g}", 0.5f * height / c.tan_half_fov_y);
             }) +
         put("float focusDistance",
             [](const FrameCamera& c) { return fmt::format("{:.6g}", c.focus); }) +
         put("float2 clippingRange",
             [](const FrameCamera& c) {
               return fmt::format("({:.6g}, {:.6g})", 0.01f * c.focus, 100 * c.focus);
             }) +
         put("matrix4d xformOp:transform",
             [](const FrameCamera& c) {
               return fmt::format(
                   "( ({}, {}, {}, 0), ({}, {}, {}, 0), ({}, {}, {}, 0), ({}, {}, {}, 1) )",
                   c.right.x, c.right.y, c.right.z, c.up.x, c.up.y, c.up.z, -c.forward.x,
                   -c.forward.y, -c.forward.z, c.position.x, c.position.y, c.position.z);
             }) +
         "        uniform token[] xformOpOrder = [\"xformOp:transform\"]\n    }\n\n";
}

std::string UsdWriter::format_material(const std::string& name, const SurfaceMaterial& m) const {
  const std::string path = "/morph/materials/" + name;
  std::string text = fmt::format(
      "        def Material \"{}\"\n        {{\n"
      "            token outputs:surface.connect = <{}/shader.outputs:surface>\n\n"
      "            def Shader \"shader\"\n            {{\n"
      "                uniform token info:id = \"UsdPreviewSurface\"\n",
      name, path);
  const int texture = catalog_.find_texture(m);
  if (texture >= 0)
    text += fmt::format(
        "                color3f inputs:diffuseColor.connect = "
        "<{}/texture.outputs:rgb>\n",
        path);
  else
    text += fmt::format("                color3f inputs:diffuseColor = ({:.6g}, {:.6g}, {:.6g})\n",
                        m.color.x, m.color.y, m.color.z);
  text += fmt::format(
      "                float inputs:roughness = {:.6g}\n                float inputs:metallic = "
      "{:.6g}\n                float inputs:opacity = {:.6g}\n                float inputs:ior = "
      "{:.6g}\n                token outputs:surface\n            }}\n",
      m.roughness, m.metallic, 1 - m.transmission, m.ior);
  if (texture >= 0)
    text += fmt::format(
        "\n            def Shader \"texture\"\n            {{\n"
        "                uniform token info:id = \"UsdUVTexture\"\n"
        "                asset inputs:file = @./{}@\n"
        "                token inputs:sourceColorSpace = \"sRGB\"\n"
        "                token inputs:wrapS = \"repeat\"\n"
        "                token inputs:wrapT = \"repeat\"\n"
        "                float4 inputs:scale = ({:.6g}, {:.6g}, {:.6g}, 1)\n"
        "                float2 inputs:st.connect = <{}/st.outputs:result>\n"
        "                float3 outputs:rgb\n            }}\n\n"
        "            def Shader \"st\"\n            {{\n"
        "                uniform token info:id = \"UsdPrimvarReader_float2\"\n"
        "                string inputs:varname = \"st\"\n"
        "                float2 outputs:result\n            }}\n",
        texture_name(static_cast<std::size_t>(texture)), m.color.x, m.color.y, m.color.z, path);
  return text + "        }\n\n";
}

/// Appends a material of mixed surfaces to `out`. It shows the vertex colours.
void UsdWriter::add_mixed_material(const ActorSamples& actor, const MeshSamples& mesh,
                                   std::vector<ByteSource>& out) {
  const std::string name = "points_of_" + actor.name, path = "/morph/materials/" + name;
  out.push_back(text(fmt::format(
      "        def Material \"{0}\"\n        {{\n"
      "            token outputs:surface.connect = <{1}/shader.outputs:surface>\n\n"
      "            def Shader \"shader\"\n            {{\n"
      "                uniform token info:id = \"UsdPreviewSurface\"\n"
      "                color3f inputs:diffuseColor.connect = <{1}/color.outputs:result>\n"
      "                float inputs:roughness.timeSamples = {{\n",
      name, path)));
  out.push_back(spool_.source(mesh.roughness.ranges()));
  out.push_back(text("                }\n                float inputs:metallic.timeSamples = {\n"));
  out.push_back(spool_.source(mesh.metallic.ranges()));
  out.push_back(
      text("                }\n                token outputs:surface\n            }\n\n"
           "            def Shader \"color\"\n            {\n"
           "                uniform token info:id = \"UsdPrimvarReader_float3\"\n"
           "                string inputs:varname = \"displayColor\"\n"
           "                float3 outputs:result\n            }\n        }\n\n"));
}

/// Appends a Mesh prim to `out`.
void UsdWriter::add_mesh(const ActorSamples& actor, const MeshSamples& mesh,
                         const std::vector<std::string>& label_names,
                         std::vector<ByteSource>& out) {
  // If there are several materials, they are assigned to subsets of the faces below.
  const std::string material = mesh.is_mixed ? "points_of_" + actor.name
                               : mesh.materials.size() == 1
                                   ? catalog_.materials[mesh.materials.front()].name
                                   : "";
  out.push_back(text(fmt::format(
      "        def Mesh \"{}\" (\n            prepend apiSchemas = [\"MaterialBindingAPI\"]\n"
      "        )\n        {{\n"
      "            uniform token subdivisionScheme = \"none\"\n"
      "            uniform token orientation = \"rightHanded\"\n"
      "            uniform token subsetFamily:materialBind:familyType = \"nonOverlapping\"\n"
      "            string[] primvars:labelNames = {} (\n                interpolation = "
      "\"constant\"\n            )\n",
      mesh.name, quote(label_names))));
  if (!material.empty())
    out.push_back(
        text(fmt::format("            rel material:binding = </morph/materials/{}>\n", material)));
  const auto put = [&](const char* type, const char* name, const char* interpolation,
                       const TimeSamples& samples) {
    if (*interpolation)
      out.push_back(text(fmt::format(
          "            {} {} (\n                interpolation = \"{}\"\n            )\n", type,
          name, interpolation)));
    out.push_back(text(fmt::format("            {} {}.timeSamples = {{\n", type, name)));
    out.push_back(spool_.source(samples.ranges()));
    out.push_back(text("            }\n"));
  };
  // Writes an attribute of the topology, as a single value if the topology is constant.
  const auto put_topology = [&](const char* type, const char* name, const char* interpolation,
                                const TimeSamples& samples) {
    if (!sequence_.constant_topology) {
      put(type, name, interpolation, samples);
      return;
    }
    const std::string metadata =
        *interpolation ? fmt::format(" (\n                interpolation = \"{}\"\n            )",
                                     interpolation)
                       : "";
    out.push_back(
        text(fmt::format("            {} {} = {}{}\n", type, name, samples.last(), metadata)));
  };
  put("token", "visibility", "", mesh.visibility);
  put("float3[]", "extent", "", mesh.extent);
  put_topology("int[]", "faceVertexCounts", "", mesh.counts);
  put_topology("int[]", "faceVertexIndices", "", mesh.indices);
  put("point3f[]", "points", "", mesh.points);
  // Corner normals are indexed, since in most frames all corners at a point share a normal.
  if (sequence_.has_corner_normals) {
    put("normal3f[]", "primvars:normals", "faceVarying", mesh.normals);
    put("int[]", "primvars:normals:indices", "", mesh.normal_indices);
  } else {
    put("normal3f[]", "normals", "vertex", mesh.normals);
  }
  put("vector3f[]", "velocities", "", mesh.velocities);
  put("color3f[]", "primvars:displayColor", "vertex", mesh.colors);
  put_topology("texCoord2f[]", "primvars:st", "faceVarying", mesh.uvs);
  put_topology("int[]", "primvars:st:indices", "", mesh.uv_indices);
  put("int[]", "primvars:label", "vertex", mesh.labels);
  for (std::size_t m = 0; m < mesh.subsets.size(); ++m) {
    out.push_back(
        text(fmt::format("\n            def GeomSubset \"{0}\" (\n"
                         "                prepend apiSchemas = [\"MaterialBindingAPI\"]\n"
                         "            )\n            {{\n"
                         "                uniform token elementType = \"face\"\n"
                         "                uniform token familyName = \"materialBind\"\n"
                         "                rel material:binding = </morph/materials/{0}>\n"
                         "                int[] indices.timeSamples = {{\n",
                         catalog_.materials[mesh.materials[m]].name)));
    out.push_back(spool_.source(mesh.subsets[m].ranges()));
    out.push_back(text("                }\n            }\n"));
  }
  out.push_back(text("        }\n\n"));
}

/// Ends the runs of equal values of all attributes.
Status UsdWriter::end_runs() {
  for (ActorSamples& actor : actors_)
    for (MeshSamples& a : actor.meshes) {
      for (TimeSamples* samples : {&a.visibility, &a.extent, &a.counts, &a.indices, &a.points,
                                   &a.normals, &a.normal_indices, &a.velocities, &a.colors, &a.uvs,
                                   &a.uv_indices, &a.labels, &a.roughness, &a.metallic})
        PM_TRY_STATUS(samples->end_run(spool_));
      for (TimeSamples& samples : a.subsets) PM_TRY_STATUS(samples.end_run(spool_));
    }
  return Ok{};
}

Status UsdWriter::write_textures() {
  for (std::size_t i = 0; i < catalog_.textures.size(); ++i) {
    const std::filesystem::path path = path_.parent_path() / texture_name(i);
    PM_TRY_STATUS(check_output(path, overwrite_));
    PM_TRY(const std::string png, texture_png(*catalog_.textures[i]));
    PM_TRY_STATUS(write_file(path, png));
  }
  return Ok{};
}

Status UsdWriter::finish() {
  PM_TRY_STATUS(end_runs());
  PM_TRY_STATUS(write_textures());
  std::vector<ByteSource> out;
  out.push_back(text(format_header()));
  for (std::size_t a = 0; a < actors_.size(); ++a) {
    out.push_back(text(fmt::format("    def Xform \"{}\"\n    {{\n", actors_[a].name)));
    for (const MeshSamples& mesh : actors_[a].meshes)
      add_mesh(actors_[a], mesh, sequence_.label_names[a], out);
    out.push_back(text("    }\n\n"));
  }
  out.push_back(text(format_camera() + "    def Scope \"materials\"\n    {\n"));
  for (const ActorSamples& actor : actors_)
    for (const MeshSamples& mesh : actor.meshes)
      if (mesh.is_mixed) add_mixed_material(actor, mesh, out);
  for (const SurfaceMaterial& m : catalog_.materials)
    out.push_back(text(format_material(m.name, m)));
  out.push_back(text("    }\n}\n"));
  return write_file(path_, concatenate(std::move(out)));
}

}  // namespace

Result<std::unique_ptr<SurfaceWriter>> make_usd_writer(const std::filesystem::path& path,
                                                       const SurfaceSequence& sequence,
                                                       bool overwrite) {
  PM_TRY(Spool spool, Spool::create_for(path));
  return std::unique_ptr<SurfaceWriter>(
      std::make_unique<UsdWriter>(path, sequence, overwrite, std::move(spool)));
}

}  // namespace polymorph
