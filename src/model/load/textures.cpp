#include "model/load/textures.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <unordered_map>

#include "base/file.h"
#include "image/image_io.h"
#include "image/rgb_channels.h"
#include "model/load/asset_path.h"

namespace polymorph {
namespace {

namespace fs = std::filesystem;

/// Converts grey to R = G = B. Errors (kInput): no colour channels, pixels that are not finite.
/// A texture's codes need no conversion.
Result<Image> make_rgb(Image image, const std::string& location) {
  if (!std::all_of(image.pixels.begin(), image.pixels.end(),
                   [](float v) { return std::isfinite(v); }))
    return make_error(ErrorCode::kInput, "{}: the texture has NaN or infinite pixels - repair it",
                      location);
  if (has_rgb(image)) return image;
  const int grey = image.find_channel("Y") >= 0 ? image.find_channel("Y") : image.find_channel("R");
  if (grey < 0)
    return make_error(ErrorCode::kInput,
                      "{}: the texture has no colour channels - use an RGB image", location);
  Image rgb = make_image(image.width, image.height, {"R", "G", "B"});
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x)
      for (int c = 0; c < 3; ++c) rgb.at(x, y, c) = image.at(x, y, grey);
  return rgb;
}

/// Reads each file once, however many materials name it.
class TextureReader {
 public:
  TextureReader(const fs::path& obj, Model& model, std::vector<std::string>& warnings,
                const std::map<std::string, std::string>& embedded)
      : finder_(obj.parent_path(), obj), model_(model), warnings_(warnings), embedded_(embedded) {}

  /// Returns the index of the material's texture in the model.
  Result<int> read(const MtlMaterial& mtl, const std::string& location) {
    if (const auto embedded = embedded_.find(mtl.texture); embedded != embedded_.end()) {
      const auto known = indices_.find(embedded->first);
      if (known != indices_.end()) return known->second;
      const Result<int> index =
          add(decode_texture(embedded->second, mtl.file + " (" + embedded->first + ")"), location);
      indices_.emplace(embedded->first, index);
      return index;
    }
    auto asset = finder_.find(fs::path(mtl.file).parent_path(), mtl.texture);
    if (!asset) return make_error(ErrorCode::kInput, "{} {}", location, asset.error().message);
    if (asset->path.empty())
      return make_error(ErrorCode::kInput,
                        "{} \"{}\" is not there - put it beside the model or remove the line",
                        location, mtl.texture);
    if (!asset->note.empty()) warnings_.push_back(fmt::format("{} {}", location, asset->note));
    const auto known = indices_.find(asset->path);
    if (known != indices_.end()) return known->second;
    remember_input(asset->path);
    const Result<int> index = add(read_texture(asset->path), location);
    indices_.emplace(asset->path, index);
    return index;
  }

 private:
  Result<int> add(Result<Texture> read, const std::string& location) {
    if (!read) return make_error(read.error().code, "{}: {}", location, read.error().message);
    Texture texture = std::move(read).value();
    PM_TRY(texture.image, make_rgb(std::move(texture.image), location));
    model_.textures.push_back(std::make_shared<const Texture>(std::move(texture)));
    return static_cast<int>(model_.textures.size()) - 1;
  }

  AssetFinder finder_;
  Model& model_;
  std::vector<std::string>& warnings_;
  const std::map<std::string, std::string>& embedded_;
  std::map<fs::path, Result<int>> indices_;
};

}  // namespace

Status load_textures(const TextureSources& textures, bool strict, Model& model,
                     std::vector<std::string>& warnings) {
  const auto& [obj, scan, mtls, embedded] = textures;
  TextureReader reader(obj, model, warnings, embedded);
  std::vector<std::string> problems;
  const MtlNames names(mtls);
  std::unordered_map<std::string, std::size_t> index_by_name;
  for (std::size_t i = 0; i < model.materials.size(); ++i)
    index_by_name.try_emplace(model.materials[i].name, i);
  for (const NamedLine& used : scan.materials) {
    const MtlMaterial* mtl = names.find(used.name);
    if (!mtl || mtl->texture.empty()) continue;
    const auto entry = index_by_name.find(mtl->material.name);
    if (entry == index_by_name.end()) continue;  // all triangles of the material were dropped
    Material& material = model.materials[entry->second];
    const std::string location = fmt::format("{}:{}: map_Kd", mtl->file, mtl->texture_line);
    if (model.corner_uvs.empty()) {
      warnings.push_back(
          fmt::format("{} \"{}\" - the model has no texture coordinates, so it is not used",
                      location, mtl->texture));
      continue;
    }
    const auto texture = reader.read(*mtl, location);
    if (texture) {
      material.texture = *texture;
      continue;
    }
    // kResource: the image reader is missing, so no texture can be read.
    if (texture.error().code == ErrorCode::kResource) return texture.error();
    problems.push_back(texture.error().message);
    material.color = Material{}.color;  // Kd is often white or black if there is a texture
  }
  if (strict && !problems.empty()) {
    std::string message;
    for (const std::string& problem : problems) message += (message.empty() ? "" : "\n") + problem;
    return Error{ErrorCode::kInput, message};
  }
  for (const std::string& problem : problems)
    warnings.push_back(problem + "; a default grey is used");
  return Ok{};
}

}  // namespace polymorph
