// polymorph_assimp FILE MEMORY ["SECONDS ANIMATION..."]: reads a model, or a pose of an animated
// one, with Assimp and writes it to standard output as the records of model/load/import_process.h:
// OBJ text, MTL text and embedded textures. It is a separate program, so that a file that makes the
// library crash, loop or exhaust memory ends only this process.
#include <assimp/GltfMaterial.h>
#include <assimp/material.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <sys/resource.h>

#include <assimp/DefaultIOSystem.h>
#include <assimp/MemoryIOWrapper.h>
#include <algorithm>
#include <assimp/Importer.hpp>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "base/exact_math.h"
#include "model/assimp/gltf_keys.h"
#include "model/assimp/guard_ply.h"
#include "model/assimp/pose.h"
#include "model/load/import_process.h"

namespace {

namespace fs = std::filesystem;

void write_record(const char* kind, const std::string& name, const std::string& bytes) {
  std::printf("%s %zu %zu\n", kind, name.size(), bytes.size());
  std::fwrite(name.data(), 1, name.size(), stdout);
  std::fwrite(bytes.data(), 1, bytes.size(), stdout);
}

/// Read-only access to regular files in the model's folder and below.
class FolderIO : public Assimp::DefaultIOSystem {
 public:
  explicit FolderIO(const fs::path& file)
      : root_(fs::weakly_canonical(file.has_parent_path() ? file.parent_path() : ".")) {}
  bool Exists(const char* name) const override { return is_allowed(name); }
  Assimp::IOStream* Open(const char* name, const char* mode) override {
    if (mode[0] != 'r' || !is_allowed(name)) return nullptr;
    if (opened_.insert(name).second) write_record("input", name, "");
    Assimp::IOStream* const stream = DefaultIOSystem::Open(name, mode);
    return stream && is_ply(name) ? guard_stream(stream) : stream;
  }

 private:
  static bool is_ply(const fs::path& path) {
    std::string suffix = path.extension().string();
    for (char& c : suffix) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return suffix == ".ply";
  }
  /// Replaces the stream of a PLY file that Assimp would misread by a stream of guard_ply()'s
  /// bytes.
  Assimp::IOStream* guard_stream(Assimp::IOStream* stream) {
    constexpr std::size_t kMaxHeader = 1 << 16;  // bytes
    std::string bytes(std::min(stream->FileSize(), kMaxHeader), '\0');
    bytes.resize(stream->Read(bytes.data(), 1, bytes.size()));
    stream->Seek(0, aiOrigin_SET);
    if (!find_line_feed_data(bytes)) return stream;
    bytes.resize(stream->FileSize());
    bytes.resize(stream->Read(bytes.data(), 1, bytes.size()));
    Close(stream);
    bytes = guard_ply(std::move(bytes));
    auto* const copy = new std::uint8_t[bytes.size()];
    std::memcpy(copy, bytes.data(), bytes.size());
    return new Assimp::MemoryIOStream(copy, bytes.size(), /*own=*/true);
  }
  bool is_allowed(const char* name) const {
    std::error_code error;
    const fs::path path = fs::weakly_canonical(name, error);
    if (error || !fs::is_regular_file(path, error)) return false;
    const auto [end, ignored] = std::mismatch(root_.begin(), root_.end(), path.begin(), path.end());
    return end == root_.end();
  }
  fs::path root_;
  std::set<std::string> opened_;  ///< names of the files opened so far
};

/// Makes a word of a name: spaces, control characters and '#' become '_'. Returns `fallback` if the
/// name is empty or begins with '<'.
std::string make_word(const aiString& name, const char* fallback) {
  std::string text;
  for (const char* c = name.C_Str(); *c; ++c)
    text += static_cast<unsigned char>(*c) <= ' ' || *c == '#' ? '_' : *c;
  return text.empty() || text[0] == '<' ? fallback : text;
}

std::string format_number(double value) {
  char text[40];
  std::snprintf(text, sizeof text, "%.9g", value);
  return text;
}

std::string format_numbers(std::initializer_list<double> values) {
  std::string text;
  for (const double value : values) text += ' ' + format_number(value);
  return text;
}

double to_linear(double srgb) {
  return srgb <= 0.04045 ? srgb / 12.92 : polymorph::exact::pow((srgb + 0.055) / 1.055, 2.4);
}
double to_srgb(double linear) {
  return linear <= 0.0031308 ? 12.92 * linear
                             : 1.055 * polymorph::exact::pow(linear, 1 / 2.4) - 0.055;
}

/// Numbers of points and faces of a scene; a mesh counts once per node that shows it.
struct Counts {
  double points = 0, faces = 0, text = 0;  ///< `text`: an upper bound of the bytes of OBJ text
};

void count_nodes(const aiScene& scene, const aiNode& node, Counts& counts) {
  for (unsigned i = 0; i < node.mNumMeshes; ++i) {
    const aiMesh& mesh = *scene.mMeshes[node.mMeshes[i]];
    const bool uvs = mesh.HasTextureCoords(0), normals = mesh.HasNormals();
    counts.points += mesh.mNumVertices;
    counts.faces += mesh.mNumFaces;
    constexpr double kNumber = 12, kIndex = 8;  // bytes, e.g. of "-1.2345678 " and " 1234567"
    counts.text += mesh.mNumVertices * kNumber * (3 + (uvs ? 2 : 0) + (normals ? 3 : 0)) +
                   mesh.mNumFaces * kIndex * 3 * (1 + (uvs ? 1 : 0) + (normals ? 1 : 0));
  }
  for (unsigned i = 0; i < node.mNumChildren; ++i) count_nodes(scene, *node.mChildren[i], counts);
}

/// Vertices of a mesh as they are written; `normals` may be null.
struct Vertices {
  const aiVector3D *points, *normals;
};

/// Texture coordinates that a material's colour texture uses: the mesh's channel, and the transform
/// of KHR_texture_transform (rotation in radians).
struct ColorTexture {
  unsigned channel = 0;  ///< index in aiMesh::mTextureCoords
  aiVector2D scale{1, 1}, offset;
  ai_real rotation = 0;

  /// Applies KHR_texture_transform, which is defined for v down, to coordinates with v up.
  aiVector2D apply(const aiVector3D& uv) const {
    if (rotation == 0 && scale == aiVector2D(1, 1) && offset == aiVector2D()) return {uv.x, uv.y};
    const auto sine = static_cast<ai_real>(polymorph::exact::sin(static_cast<double>(rotation))),
               cosine = static_cast<ai_real>(polymorph::exact::cos(static_cast<double>(rotation)));
    const ai_real u = scale.x * uv.x, v = scale.y * (1 - uv.y);
    return {cosine * u + sine * v + offset.x, 1 - (cosine * v - sine * u + offset.y)};
  }
};

/// Reads the channel and the transform of a texture's coordinates.
ColorTexture read_color_texture(const aiMaterial& material, aiTextureType type) {
  ColorTexture texture;
  int channel = 0;
  if (material.Get(AI_MATKEY_UVWSRC(type, 0), channel) == aiReturn_SUCCESS && channel > 0 &&
      channel < AI_MAX_NUMBER_OF_TEXTURECOORDS)
    texture.channel = static_cast<unsigned>(channel);
  aiUVTransform stored;
  if (material.Get(AI_MATKEY_UVTRANSFORM(type, 0), stored) != aiReturn_SUCCESS) return texture;
  // Assimp converts the offset to that of a rotation about the picture's centre; this converts it
  // back.
  texture.scale = stored.mScaling;
  texture.rotation = -stored.mRotation;
  const auto sine =
      static_cast<ai_real>(polymorph::exact::sin(static_cast<double>(texture.rotation)));
  const auto cosine =
      static_cast<ai_real>(polymorph::exact::cos(static_cast<double>(texture.rotation)));
  texture.offset.x = stored.mTranslation.x - stored.mScaling.x / 2 * (sine - cosine + 1);
  texture.offset.y =
      stored.mScaling.y / 2 * (sine + cosine - 1) + 1 - stored.mScaling.y - stored.mTranslation.y;
  return texture;
}

/// Writes a scene as the records of OBJ text, MTL text, textures and warnings.
class Writer {
 public:
  /// `pose`: pose of an animated model; nothing for the pose at rest.
  Writer(const aiScene& scene, const std::string& suffix, std::optional<Pose> pose)
      : scene_(scene), suffix_(suffix), pose_(std::move(pose)) {}

  /// Writes all records. `counts`: result of count_nodes() for the scene.
  void write(const Counts& counts) {
    obj_.reserve(static_cast<std::size_t>(counts.text));
    for (unsigned i = 0; i < scene_.mNumMaterials; ++i) add_material(*scene_.mMaterials[i]);
    y_up_transform_ = make_y_up_transform();
    add_node(*scene_.mRootNode, y_up_transform_);
    write_record("obj", "", obj_);
    write_record("mtl", "", mtl_);
    for (unsigned i = 0; i < scene_.mNumTextures; ++i) add_texture(i);
    if (points_or_lines_ > 0)
      write_record("warning", std::to_string(points_or_lines_) + " points or lines - ignored", "");
    if (!emitting_.empty())
      write_record("warning", emitting_ + " emits light, which is ignored", "");
    if (!transparent_.empty())
      write_record("warning",
                   transparent_ + " is transparent in part, which is ignored - it is opaque", "");
    if (has_unused_colors_)
      write_record("warning", "colours of points beside a texture - the colours are ignored", "");
    if (animated_ && !pose_)
      write_record(
          "warning",
          suffix_ == ".glb" || suffix_ == ".gltf"
              ? "it is animated, and is shown at rest - NAME@####" + suffix_ + " are its poses"
              : "it is animated - the animation is ignored, only those of .glb and .gltf are read",
          "");
  }

 private:
  aiMatrix4x4 make_y_up_transform();
  void add_material(const aiMaterial& material);
  void note_ignored_properties(const aiMaterial& material, const std::string& name);
  void add_node(const aiNode& node, const aiMatrix4x4& parent);
  void add_mesh(const aiMesh& mesh, const Vertices& vertices, const aiMatrix4x4& transform,
                const std::string& label);
  std::string add_color_material(const aiMesh& mesh, const aiFace& face);
  void add_texture(unsigned index);
  /// Tests whether the format stores colours of points in sRGB.
  bool has_srgb_colors() const {
    return suffix_ == ".ply" || suffix_ == ".off" || suffix_ == ".stl";
  }

  const aiScene& scene_;
  std::string suffix_;
  std::optional<Pose> pose_;
  aiMatrix4x4 y_up_transform_;
  std::string obj_ = "mtllib m\n", mtl_;  ///< text; the library's name "m" is never looked up
  std::vector<std::string> materials_;    ///< name in `mtl_` per material of the scene
  std::vector<std::optional<ColorTexture>> textures_;  ///< colour texture per material
  std::set<std::string> material_names_;
  std::string emitting_, transparent_;  ///< first material that emits light, or is transparent
  std::set<unsigned> colors_;           ///< 0xRRGGBB of the colour materials written
  /// Numbers of v, vt and vn lines written so far, and of faces with one or two corners.
  std::size_t points_ = 0, uvs_ = 0, normals_ = 0, points_or_lines_ = 0;
  bool has_unused_colors_ = false, animated_ = false;
};

/// Makes the transform to y up and metres. Assimp only stores the axis and unit of FBX files; its
/// readers of other formats rotate the scene themselves, and their unit is the metre or unknown.
aiMatrix4x4 Writer::make_y_up_transform() {
  animated_ = scene_.mNumAnimations > 0;
  aiMatrix4x4 rotation, scale;
  if (suffix_ != ".fbx" || !scene_.mMetaData) return rotation;
  int axis = 1, sign = 1;
  scene_.mMetaData->Get("UpAxis", axis);
  scene_.mMetaData->Get("UpAxisSign", sign);
  if (axis == 2)
    aiMatrix4x4::RotationX(sign < 0 ? AI_MATH_HALF_PI_F : -AI_MATH_HALF_PI_F, rotation);
  if (axis == 0)
    aiMatrix4x4::RotationZ(sign < 0 ? -AI_MATH_HALF_PI_F : AI_MATH_HALF_PI_F, rotation);
  double centimetres = 100;  // per unit of the file
  float centimetres_float = 0;
  if (!scene_.mMetaData->Get("UnitScaleFactor", centimetres) &&
      scene_.mMetaData->Get("UnitScaleFactor", centimetres_float))
    centimetres = static_cast<double>(centimetres_float);
  if (!(centimetres > 0) || !std::isfinite(centimetres)) centimetres = 100;
  const auto metres = static_cast<ai_real>(centimetres / 100);
  return rotation * aiMatrix4x4::Scaling(aiVector3D(metres, metres, metres), scale);
}

void Writer::add_material(const aiMaterial& material) {
  aiString text;
  material.Get(AI_MATKEY_NAME, text);
  std::string name = make_word(text, "material");
  for (int i = 2; !material_names_.insert(name).second; ++i)
    name = make_word(text, "material") + "_" + std::to_string(i);
  materials_.push_back(name);
  mtl_ += "newmtl " + name + "\n";
  aiColor4D color(0.7f, 0.7f, 0.7f, 1);
  if (material.Get(AI_MATKEY_BASE_COLOR, color) != aiReturn_SUCCESS)
    material.Get(AI_MATKEY_COLOR_DIFFUSE, color);
  const auto clamp_fraction = [](float v) {
    return static_cast<double>(std::isfinite(v) ? std::clamp(v, 0.0f, 1.0f) : 0.7f);
  };
  mtl_ +=
      "Kd" +
      format_numbers({clamp_fraction(color.r), clamp_fraction(color.g), clamp_fraction(color.b)}) +
      "\n";
  float value = 0;
  if (material.Get(AI_MATKEY_ROUGHNESS_FACTOR, value) == aiReturn_SUCCESS)
    mtl_ += "Pr " + format_number(clamp_fraction(value)) + "\n";
  else if (material.Get(AI_MATKEY_SHININESS, value) == aiReturn_SUCCESS && value > 0)
    mtl_ += "Ns " + format_number(std::min(static_cast<double>(value), 1e6)) + "\n";
  if (material.Get(AI_MATKEY_METALLIC_FACTOR, value) == aiReturn_SUCCESS)
    mtl_ += "Pm " + format_number(clamp_fraction(value)) + "\n";
  if (suffix_ == ".glb" || suffix_ == ".gltf") note_ignored_properties(material, name);
  std::optional<ColorTexture> texture;
  for (const aiTextureType type : {aiTextureType_BASE_COLOR, aiTextureType_DIFFUSE}) {
    aiString path;
    if (texture || material.GetTexture(type, 0, &path) != aiReturn_SUCCESS || path.length == 0)
      continue;
    const auto [embedded, index] = scene_.GetEmbeddedTextureAndIndex(path.C_Str());
    mtl_ += "map_Kd " +
            (embedded ? polymorph::embedded_name(static_cast<unsigned>(index)) : path.C_Str()) +
            "\n";
    texture = read_color_texture(material, type);
  }
  textures_.push_back(texture);
}

void Writer::add_node(const aiNode& node, const aiMatrix4x4& parent) {
  const aiMatrix4x4 transform = parent * (pose_ ? pose_->local(node) : node.mTransformation);
  for (unsigned i = 0; i < node.mNumMeshes; ++i) {
    const aiMesh& mesh = *scene_.mMeshes[node.mMeshes[i]];
    const std::string label = make_word(mesh.mName.length ? mesh.mName : node.mName, "mesh");
    if (!pose_) {
      add_mesh(mesh, {mesh.mVertices, mesh.mNormals}, transform, label);
      continue;
    }
    const PosedMesh posed = posed_mesh(*pose_, node, mesh);
    add_mesh(mesh, {posed.points.data(), posed.normals.empty() ? nullptr : posed.normals.data()},
             posed.in_scene ? y_up_transform_ : transform, label);
  }
  for (unsigned i = 0; i < node.mNumChildren; ++i) add_node(*node.mChildren[i], transform);
}

/// Remembers the first glTF material that emits light, and the first that is transparent.
void Writer::note_ignored_properties(const aiMaterial& material, const std::string& name) {
  aiColor3D light;
  aiString mode;
  const bool emits = material.Get(AI_MATKEY_COLOR_EMISSIVE, light) == aiReturn_SUCCESS &&
                     std::max({light.r, light.g, light.b}) > 0;
  if (emits && emitting_.empty()) emitting_ = "material " + name;
  if (material.Get(AI_MATKEY_GLTF_ALPHAMODE, mode) == aiReturn_SUCCESS &&
      std::string(mode.C_Str()) != "OPAQUE" && transparent_.empty())
    transparent_ = "material " + name;
}

/// Returns the name of a material of the mean colour of a face's corners, in steps of 4/255. Writes
/// the material on first use.
std::string Writer::add_color_material(const aiMesh& mesh, const aiFace& face) {
  double sum[3] = {};
  for (unsigned k = 0; k < face.mNumIndices; ++k) {
    const aiColor4D& c = mesh.mColors[0][face.mIndices[k]];
    sum[0] += static_cast<double>(c.r);
    sum[1] += static_cast<double>(c.g);
    sum[2] += static_cast<double>(c.b);
  }
  unsigned code = 0;
  for (double& v : sum) {
    v = std::clamp(v / face.mNumIndices, 0.0, 1.0);
    const double step = std::round((has_srgb_colors() ? v : to_srgb(v)) * 255 / 4);
    code = code << 8 | static_cast<unsigned>(std::min(4 * step, 255.0));
  }
  char name[40];
  std::snprintf(name, sizeof name, "color_%06x", code);
  if (colors_.insert(code).second)
    mtl_ += std::string("newmtl ") + name + "\nKd" +
            format_numbers({to_linear((code >> 16) / 255.0), to_linear((code >> 8 & 255) / 255.0),
                            to_linear((code & 255) / 255.0)}) +
            "\n";
  return name;
}

void Writer::add_mesh(const aiMesh& mesh, const Vertices& vertices, const aiMatrix4x4& transform,
                      const std::string& label) {
  // Select what to write. STL files have only face normals, which would make all shading flat.
  aiMatrix3x3 linear(transform);
  const bool mirrored = linear.Determinant() < 0;
  const bool has_normals = vertices.normals && suffix_ != ".stl" && linear.Determinant() != 0;
  const ColorTexture* const texture =
      mesh.mMaterialIndex < textures_.size() && textures_[mesh.mMaterialIndex]
          ? &*textures_[mesh.mMaterialIndex]
          : nullptr;
  // A mesh without the texture's channel uses its first one.
  const unsigned channel =
      texture && mesh.HasTextureCoords(texture->channel) ? texture->channel : 0;
  const bool has_uvs = mesh.HasTextureCoords(channel);
  // Write the vertices.
  linear.Inverse().Transpose();  // transforms normals
  for (unsigned i = 0; i < mesh.mNumVertices; ++i) {
    const aiVector3D p = transform * vertices.points[i];
    obj_ += 'v' + format_numbers({p.x, p.y, p.z}) + '\n';
    if (has_uvs) {
      const aiVector3D& stored = mesh.mTextureCoords[channel][i];
      const aiVector2D uv = texture ? texture->apply(stored) : aiVector2D(stored.x, stored.y);
      obj_ += "vt" + format_numbers({uv.x, uv.y}) + '\n';
    }
    if (has_normals) {
      const aiVector3D n = linear * vertices.normals[i];
      obj_ += "vn" + format_numbers({n.x, n.y, n.z}) + '\n';
    }
  }
  // Write the faces; a mirroring transform reverses their corners.
  obj_ += "g " + label + '\n';
  const bool colored = mesh.HasVertexColors(0) && !texture;
  has_unused_colors_ = has_unused_colors_ || (mesh.HasVertexColors(0) && texture);
  std::string current_material;
  for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
    const aiFace& face = mesh.mFaces[f];
    if (face.mNumIndices < 3) {
      ++points_or_lines_;
      continue;
    }
    std::string material = colored ? add_color_material(mesh, face)
                           : mesh.mMaterialIndex < materials_.size()
                               ? materials_[mesh.mMaterialIndex]
                               : std::string();
    if (!material.empty() && material != current_material) obj_ += "usemtl " + material + '\n';
    current_material = std::move(material);
    obj_ += 'f';
    for (unsigned k = 0; k < face.mNumIndices; ++k) {
      const std::size_t i = face.mIndices[mirrored ? face.mNumIndices - 1 - k : k];
      obj_ += ' ' + std::to_string(points_ + i + 1);
      if (has_uvs) obj_ += '/' + std::to_string(uvs_ + i + 1);
      if (has_normals) obj_ += (has_uvs ? "/" : "//") + std::to_string(normals_ + i + 1);
    }
    obj_ += '\n';
  }
  points_ += mesh.mNumVertices;
  if (has_uvs) uvs_ += mesh.mNumVertices;
  if (has_normals) normals_ += mesh.mNumVertices;
}

/// Writes a texture as in the file (mHeight = 0: Assimp keeps its mWidth bytes) or, if Assimp has
/// decoded it, as a Targa file.
void Writer::add_texture(unsigned index) {
  const aiTexture& texture = *scene_.mTextures[index];
  const std::string name = polymorph::embedded_name(index);
  if (texture.mHeight == 0)
    return write_record("texture", name,
                        std::string(reinterpret_cast<const char*>(texture.pcData), texture.mWidth));
  // Targa has 16 bits for each side.
  if (texture.mWidth > 65535 || texture.mHeight > 65535) return;
  std::string bytes(18, '\0');  // header
  bytes[2] = 2;                 // uncompressed true colour
  bytes[12] = static_cast<char>(texture.mWidth & 255);
  bytes[13] = static_cast<char>(texture.mWidth >> 8);
  bytes[14] = static_cast<char>(texture.mHeight & 255);
  bytes[15] = static_cast<char>(texture.mHeight >> 8);
  bytes[16] = 32;    // bits per pixel
  bytes[17] = 0x28;  // eight bits of alpha, the first row on top
  bytes.append(reinterpret_cast<const char*>(texture.pcData),
               std::size_t{4} * texture.mWidth * texture.mHeight);
  write_record("texture", name, bytes);
}

std::string describe_size(const Counts& counts, double limit) {
  char text[200];
  std::snprintf(text, sizeof text,
                "it unpacks to %.0f points and %.0f faces, which need about %.1f GB of memory, and "
                "the limit leaves %.1f GB",
                counts.points, counts.faces, polymorph::kModelBytesPerTextByte * counts.text / 1e9,
                limit / 1e9);
  return text;
}

/// Parses "SECONDS ANIMATION..." and computes that pose.
Pose parse_pose(const aiScene& scene, const GltfFile& file, const char* words) {
  std::istringstream numbers(words);
  double seconds = 0;
  numbers >> seconds;
  std::vector<std::size_t> playing;
  for (std::size_t index = 0; numbers >> index;) playing.push_back(index);
  return pose_at(scene, file, playing, seconds);
}

/// Lowers the soft limit of a resource of this process to `maximum`.
void limit_resource(int resource, rlim_t maximum) {
  rlimit current{};
  if (getrlimit(resource, &current) != 0) return;
  current.rlim_cur = std::min(current.rlim_max, maximum);
  setrlimit(resource, &current);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3 && argc != 4) return 2;
  limit_resource(RLIMIT_CORE, 0);
  std::fputs(polymorph::kImportHello, stdout);
  const fs::path path = argv[1];
  std::error_code error;
  const auto bytes = static_cast<rlim_t>(fs::file_size(path, error));
  const rlim_t memory = std::strtoull(argv[2], nullptr, 10);
  // RLIMIT_AS limits the address space, of which shared libraries take this much, but little
  // memory.
  constexpr rlim_t kLibraries = rlim_t{256} << 20;
  const rlim_t seconds = 3 + bytes / 1000000;
  // Address space: 2 GiB and 100 bytes per byte of the file, at most 16 GiB, at most the memory. A
  // memory limit of a TiB or more means that there is none; adding to it might overflow.
  limit_resource(RLIMIT_AS, std::min({(rlim_t{2} << 30) + 100 * bytes, rlim_t{16} << 30,
                                      memory < (rlim_t{1} << 40) ? kLibraries + memory : memory}));
  limit_resource(RLIMIT_CPU, seconds);
  std::string suffix = path.extension().string();
  std::transform(suffix.begin(), suffix.end(), suffix.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  // Read the scene, check its size and write it.
  try {
    Assimp::Importer importer;
    importer.SetIOHandler(new FolderIO(path));
    // FBX: one node per mesh instead of a chain of pivots.
    importer.SetPropertyBool(AI_CONFIG_IMPORT_FBX_PRESERVE_PIVOTS, false);
    const aiScene* scene = importer.ReadFile(argv[1], aiProcess_ValidateDataStructure);
    if (!scene || !scene->mRootNode || scene->mNumMeshes == 0) {
      std::string reason = importer.GetErrorString();
      if (reason.empty()) reason = "no meshes in it";
      // The usual cause is a header that counts more points than the file has bytes.
      if (reason == "std::bad_alloc") reason = "it asks for more memory than there is";
      write_record("error", reason, "");
    } else {
      Counts counts;
      count_nodes(*scene, *scene->mRootNode, counts);
      if (polymorph::kModelBytesPerTextByte * counts.text > static_cast<double>(memory)) {
        write_record("large", describe_size(counts, static_cast<double>(memory)), "");
      } else {
        limit_resource(RLIMIT_CPU, seconds + static_cast<rlim_t>(counts.text / 20e6));
        std::optional<Pose> pose;
        if (suffix == ".glb" || suffix == ".gltf") {
          const bool is_posed = argc == 4;
          const GltfFile file = read_gltf(*importer.GetIOHandler(), argv[1], is_posed);
          for (const std::string& warning : file.warnings) write_record("warning", warning, "");
          if (is_posed) pose = parse_pose(*scene, file, argv[3]);
        }
        Writer(*scene, suffix, std::move(pose)).write(counts);
      }
    }
  } catch (const std::bad_alloc&) {
    write_record("large", "it takes more memory than the limit leaves", "");
  } catch (const std::exception& e) {
    write_record("error", e.what(), "");
  }
  write_record("end", "", "");
  return 0;
}
