#include "render/film/cryptomatte.h"

#include <algorithm>
#include <bit>
#include <cstring>

#include "base/json.h"
#include "base/text.h"
#include "render/path/integrator.h"

namespace polymorph {
namespace {

// Names of the layers, in the order of Mattes::Kind.
constexpr const char* kLayers[] = {"crypto_object", "crypto_material", "crypto_label"};

/// Makes the key of a layer in the header: the first 7 hexadecimal digits of the hash of its name.
std::string make_layer_key(std::string_view layer) {
  return fmt::format("{:08x}", murmur_hash(layer)).substr(0, 7);
}

}  // namespace

std::uint32_t murmur_hash(std::string_view text) {
  // All constants are those of MurmurHash3_x86_32.
  constexpr std::uint32_t kFirst = 0xcc9e2d51u, kSecond = 0x1b873593u;
  const auto scramble = [](std::uint32_t k) { return std::rotl(k * kFirst, 15) * kSecond; };
  std::uint32_t hash = 0;
  std::size_t at = 0;
  for (; at + 4 <= text.size(); at += 4) {
    std::uint32_t block = 0;
    std::memcpy(&block, text.data() + at, 4);  // assumes little-endian
    hash = std::rotl(hash ^ scramble(block), 13) * 5 + 0xe6546b64u;
  }
  std::uint32_t tail = 0;
  for (std::size_t i = text.size(); i-- > at;)
    tail = (tail << 8) | static_cast<unsigned char>(text[i]);
  hash ^= scramble(tail);
  hash ^= static_cast<std::uint32_t>(text.size());
  hash = (hash ^ (hash >> 16)) * 0x85ebca6bu;
  hash = (hash ^ (hash >> 13)) * 0xc2b2ae35u;
  return hash ^ (hash >> 16);
}

float matte_id(std::string_view name) {
  std::uint32_t hash = murmur_hash(name);
  const std::uint32_t exponent = (hash >> 23) & 255u;
  if (exponent == 0 || exponent == 255) hash ^= 1u << 23;
  return std::bit_cast<float>(hash);
}

void MattePixel::add(float id, float weight) {
  if (!(weight > 0)) return;
  for (auto& [known_id, sum] : sums_)
    if (known_id == id) {
      sum += weight;
      return;
    }
  sums_.emplace_back(id, weight);
}

void MattePixel::add(const MattePixel& other) {
  for (const auto& [id, weight] : other.sums_) add(id, weight);
}

std::array<float, 2 * kMatteRanks> MattePixel::rank(float samples) const {
  // Sort by descending coverage, and equal coverages by id.
  std::vector<std::pair<float, float>> sorted = sums_;
  std::sort(sorted.begin(), sorted.end(), [](const auto& a, const auto& b) {
    return a.second != b.second ? a.second > b.second : a.first < b.first;
  });
  std::array<float, 2 * kMatteRanks> ranks{};
  for (std::size_t i = 0; i < std::min<std::size_t>(sorted.size(), kMatteRanks); ++i) {
    ranks[2 * i] = sorted[i].first;
    ranks[2 * i + 1] = sorted[i].second / samples;
  }
  return ranks;
}

Mattes::Mattes(const std::string& layers, const RenderScene& scene) {
  for (const Kind kind : {Kind::kObject, Kind::kMaterial, Kind::kLabel}) {
    const char* layer = kLayers[static_cast<std::size_t>(kind)];
    if (!includes_aov(layers, layer)) continue;
    kinds_.push_back(kind);
    tables_.push_back({layer, /*manifest=*/{}});
  }
  if (tables_.empty()) return;
  const bool shadow_only = scene.ground.shadow_only;
  for (std::size_t i = 0; i < kinds_.size(); ++i) {
    if (scene.ground.enabled && !shadow_only) ground_[i] = add_id(kinds_[i], "ground");
    backdrop_[i] = add_id(kinds_[i], "backdrop");
  }
  for (const RenderMesh& mesh : scene.meshes) {
    MeshIds ids;
    ids.object = add_id(Kind::kObject, mesh.name);
    const auto add_layer = [&](const MaterialLayer& layer) {
      ids.materials.emplace_back();
      for (const Material& material : layer.materials)
        ids.materials.back().push_back(add_id(Kind::kMaterial, material.name));
    };
    add_layer(mesh);
    for (const MixedLayer& layer : mesh.upper_layers) add_layer(layer);
    if (mesh.look > 0 || mesh.materials.empty()) look_ = add_id(Kind::kMaterial, "look");
    for (const std::string& label : mesh.label_names)
      ids.labels.push_back(add_id(Kind::kLabel, label));
    // A mesh without labels is one label of its own name.
    if (ids.labels.empty()) ids.labels.push_back(add_id(Kind::kLabel, mesh.name));
    meshes_.push_back(std::move(ids));
  }
}

float Mattes::add_id(Kind kind, std::string_view raw_name) {
  const std::string name = raw_name.empty() ? "unnamed" : printable(raw_name);
  const float id = matte_id(name);
  for (std::size_t i = 0; i < kinds_.size(); ++i)
    if (kinds_[i] == kind) tables_[i].manifest.emplace(name, id);
  return id;
}

std::vector<std::string> list_matte_channels(const std::string& layer) {
  std::vector<std::string> channels;
  for (int group = 0; group < kMatteRanks / 2; ++group)
    for (const char channel : {'R', 'G', 'B', 'A'})
      channels.push_back(fmt::format("{}{:02}.{}", layer, group, channel));
  return channels;
}

std::vector<std::string> Mattes::layers() const {
  std::vector<std::string> layers;
  for (const MatteTable& table : tables_) layers.push_back(table.layer);
  return layers;
}

std::vector<std::string> Mattes::channels() const {
  std::vector<std::string> channels;
  for (const MatteTable& table : tables_)
    for (std::string& channel : list_matte_channels(table.layer))
      channels.push_back(std::move(channel));
  return channels;
}

std::vector<Attribute> Mattes::attributes() const {
  std::vector<Attribute> attributes;
  for (const MatteTable& table : tables_) {
    const std::string prefix = "cryptomatte/" + make_layer_key(table.layer) + "/";
    JsonValue manifest = JsonValue::object();
    for (const auto& [name, id] : table.manifest)
      manifest[name] = fmt::format("{:08x}", std::bit_cast<std::uint32_t>(id));
    attributes.push_back({prefix + "name", table.layer});
    attributes.push_back({prefix + "hash", std::string("MurmurHash3_32")});
    attributes.push_back({prefix + "conversion", std::string("uint32_to_float32")});
    attributes.push_back({prefix + "manifest", format_json(manifest)});
  }
  return attributes;
}

void Mattes::add_material(const RenderMesh& mesh, const MeshIds& ids, const MeshHit& hit,
                          MattePixel& pixel) const {
  const auto find_id = [&](const MaterialLayer& layer, std::size_t index) {
    return ids.materials[index][texture_point(layer, hit.triangle, hit.u, hit.v).material];
  };
  float look = mesh.materials.empty() ? 1 : std::clamp(mesh.look, 0.0f, 1.0f);
  pixel.add(look_, look);
  // From the topmost layer down: a layer leaves the fraction 1 - opacity to the layers below it.
  float remaining = 1 - look;
  for (std::size_t i = mesh.upper_layers.size(); i-- > 0;) {
    const MixedLayer& layer = mesh.upper_layers[i];
    if (layer.materials.empty()) continue;
    const float opacity = std::clamp(layer.opacity, 0.0f, 1.0f);
    pixel.add(find_id(layer, i + 1), remaining * opacity);
    remaining *= 1 - opacity;
  }
  if (!mesh.materials.empty()) pixel.add(find_id(mesh, 0), remaining);
}

float Mattes::find_label(const RenderMesh& mesh, const MeshIds& ids, const MeshHit& hit) const {
  if (mesh.vertex_labels.empty() || mesh.label_names.empty()) return ids.labels.front();
  return ids.labels[nearest_label(mesh, hit)];
}

void Mattes::add_sample(const World& world, const Ray& ray, const Intersection& intersection,
                        SampleSums<MattePixel>* pixel) const {
  const float backdrop_weight = world.transparent ? 0.0f : 1.0f;
  if (intersection.mesh.mesh == kNoMesh) {
    float floor_coverage = 0;
    if (intersection.floor < std::numeric_limits<float>::infinity() && !world.shadow_only)
      floor_coverage = 1 - floor_point(world.floor, ray, intersection.floor).fade;
    for (std::size_t i = 0; i < kinds_.size(); ++i) {
      pixel[i].block().add(ground_[i], floor_coverage);
      pixel[i].block().add(backdrop_[i], (1 - floor_coverage) * backdrop_weight);
    }
    return;
  }
  const RenderMesh& mesh = world.geometry->mesh(intersection.mesh.mesh);
  const MeshIds& ids = meshes_[intersection.mesh.mesh];
  for (std::size_t i = 0; i < kinds_.size(); ++i) {
    if (kinds_[i] == Kind::kObject) pixel[i].block().add(ids.object, 1);
    if (kinds_[i] == Kind::kMaterial) add_material(mesh, ids, intersection.mesh, pixel[i].block());
    if (kinds_[i] == Kind::kLabel)
      pixel[i].block().add(find_label(mesh, ids, intersection.mesh), 1);
  }
}

}  // namespace polymorph
