#include "image/image_io.h"

#include "base/file.h"
#include "base/hash.h"
#include "base/text.h"

namespace polymorph {

Status write_image(const std::filesystem::path& path, const Image& image, const PngSettings& png,
                   const ExrSettings& exr) {
  const std::string extension = lower_case(path.extension().string());
  if (extension != ".exr" && extension != ".png")
    return make_error(ErrorCode::kUsage,
                      "{}: cannot write this kind of image ('{}') - end the name in .exr or .png",
                      path.string(), extension);
  const Result<std::string> bytes =
      extension == ".exr" ? encode_exr(image, exr) : encode_png(image, png);
  if (!bytes) return make_error(bytes.error().code, "{}: {}", path.string(), bytes.error().message);
  return write_file(path, *bytes);
}

namespace {
void add_header(Hasher& hasher, const Image& image) {
  hasher.add(image.width).add(image.height).add(image.channels.size());
  for (const std::string& name : image.channels) hasher.add(std::string_view(name));
}
}  // namespace

std::string pixel_digest(const Image& image) {
  Hasher hasher;
  add_header(hasher, image);
  hasher.add(std::span<const float>(image.pixels));
  return hasher.hex();
}

std::string pixel_digest(const Texture& texture) {
  if (!texture.codes) return pixel_digest(texture.image);
  Hasher hasher;
  add_header(hasher, texture.image);
  hasher.add(std::span<const float>(texture.code_values)).add(texture.code_channels);
  hasher.add(std::span<const std::uint8_t>(texture.codes.get(), texture.code_count()));
  return hasher.hex();
}

}  // namespace polymorph
