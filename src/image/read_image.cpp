#include <algorithm>
#include <array>

#include "base/file.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "base/text.h"
#include "image/decode_png.h"
#include "image/header_size.h"
#include "image/image_io.h"
#include "image/oiio_loader.h"
#include "image/sniff.h"
#include "image/srgb.h"
#include "kernels/large_pages.h"

namespace polymorph {
namespace {

/// A channel of the result: its name, and the index of the decoded channel that it copies.
struct Source {
  std::string name;
  std::size_t channel;
};

/// Returns the position of a channel in the order of the result; 8 for channels sorted by name.
std::size_t channel_rank(const std::string& name) {
  static const char* const kOrder[] = {"R", "G", "B", "A", "Z", "N.X", "N.Y", "N.Z"};
  return static_cast<std::size_t>(std::find(std::begin(kOrder), std::end(kOrder), name) -
                                  std::begin(kOrder));
}

/// Lists the result's channels in the order R, G, B, A, Z, N.X, N.Y, N.Z, then the rest by name. A
/// single grey channel becomes R, G and B.
std::vector<Source> list_channel_sources(const PmOiioImage& decoded) {
  std::vector<std::string> names(decoded.channel_names, decoded.channel_names + decoded.channels);
  const bool grey = names.size() == 1 || (names.size() == 2 && names[1] == "A");
  if (grey && (decoded.integer_format || names[0] == "Y" || names[0] == "I" || names[0] == "L")) {
    std::vector<Source> sources{{"R", 0}, {"G", 0}, {"B", 0}};
    if (names.size() == 2) sources.push_back({"A", 1});
    return sources;
  }
  std::vector<Source> sources;
  for (std::size_t i = 0; i < names.size(); ++i) sources.push_back({names[i], i});
  std::stable_sort(sources.begin(), sources.end(), [](const Source& a, const Source& b) {
    const std::size_t x = channel_rank(a.name), y = channel_rank(b.name);
    return x != y ? x < y : a.name < b.name;
  });
  return sources;
}

/// Decodes a sample by the sRGB curve if `curved`. Such samples come from integers as k / 255 or
/// k / 65535, so tables are exact.
float decode_sample(float sample, bool curved) {
  if (!curved) return sample;
  const auto code = static_cast<std::uint32_t>(std::clamp(sample, 0.0f, 1.0f) * 65535.0f + 0.5f);
  // Computing the large table takes as long as reading a small picture, so it is computed only if a
  // sample needs 16 bits.
  constexpr std::uint32_t kStep = 257;  // 65535 / 255
  return code % kStep == 0 ? srgb_decode_table8()[code / kStep] : srgb_decode_table16()[code];
}

/// Conversion of a pixel.
struct PixelRule {
  std::size_t colors;              ///< number of leading R, G, B channels
  int alpha;                       ///< index of A, or -1
  bool curved;                     ///< colours carry the sRGB curve
  bool straight_in, straight_out;  ///< whether the file's and the result's colours are not
                                   ///< premultiplied by alpha
};

/// Converts row y of an image with floats.
void convert_row(const PmOiioImage& decoded, const std::vector<Source>& sources, PixelRule rule,
                 std::int64_t y, Image& image) {
  const std::size_t out_count = sources.size(),
                    in_count = static_cast<std::size_t>(decoded.channels);
  for (int x = 0; x < image.width; ++x) {
    const std::size_t pixel = static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) +
                              static_cast<std::size_t>(x);
    const float* source_pixel = decoded.pixels + pixel * in_count;
    float* target_pixel = &image.pixels[pixel * out_count];
    for (std::size_t c = 0; c < out_count; ++c) target_pixel[c] = source_pixel[sources[c].channel];
    const float a = rule.alpha >= 0 ? target_pixel[rule.alpha] : 1.0f;
    for (std::size_t c = 0; c < rule.colors; ++c) {
      // The curve applies to straight colours. Premultiplied colours that have the curve, or that
      // must become straight, are divided by alpha first.
      const bool is_undivided = rule.straight_in || !(rule.curved || rule.straight_out) || a == 0;
      float value = is_undivided ? target_pixel[c] : target_pixel[c] / a;
      value = decode_sample(value, rule.curved);
      const bool multiply = !rule.straight_out && (rule.straight_in || !is_undivided);
      target_pixel[c] = multiply ? value * a : value;
    }
  }
}

/// Values of the colours of 8 bits, by code.
using CodeValues = std::array<float, 256>;

CodeValues make_code_values(bool curved) {
  CodeValues values;
  for (std::size_t code = 0; code < values.size(); ++code)
    values[code] = decode_sample(static_cast<float>(code) / 255.0f, curved);
  return values;
}

/// Converts a row of samples of 8 bits. Their colours are not multiplied by alpha.
void look_up_codes(const PmOiioImage& decoded, const std::vector<Source>& sources, PixelRule rule,
                   const CodeValues& values, std::int64_t y, Image& image) {
  const std::size_t out_count = sources.size(),
                    in_count = static_cast<std::size_t>(decoded.channels),
                    width = static_cast<std::size_t>(image.width),
                    first = static_cast<std::size_t>(y) * width;
  for (std::size_t c = 0; c < out_count; ++c) {
    const unsigned char* from = decoded.codes + first * in_count + sources[c].channel;
    float* to = &image.pixels[first * out_count + c];
    const bool is_color = c < rule.colors;
    for (std::size_t x = 0; x < width; ++x) {
      const unsigned char code = from[x * in_count];
      to[x * out_count] = is_color ? values[code] : static_cast<float>(code) / 255.0f;
    }
  }
  if (rule.straight_out) return;
  for (std::size_t x = 0; x < width; ++x) {
    float* pixel = &image.pixels[(first + x) * out_count];
    for (std::size_t c = 0; c < rule.colors; ++c) pixel[c] *= pixel[rule.alpha];
  }
}

/// Makes the module's image without its pixels.
Image make_header(const PmOiioImage& decoded, const std::vector<Source>& sources) {
  Image image;
  image.width = decoded.width;
  image.height = decoded.height;
  for (const Source& source : sources) image.channels.push_back(source.name);
  for (int i = 0; i < decoded.attribute_count; ++i) {
    const PmOiioAttribute& from = decoded.attributes[i];
    Attribute to{from.name, from.integer};
    if (from.kind == PM_OIIO_STRING) to.value = std::string(from.text);
    if (from.kind == PM_OIIO_FLOAT) to.value = from.real;
    image.attributes.push_back(std::move(to));
  }
  // Add the header entries that describe ids, parts and pictures.
  std::string id_channels;
  for (const Source& source : sources)
    if (decoded.is_id_channel && decoded.is_id_channel[source.channel])
      id_channels += (id_channels.empty() ? "" : ",") + source.name;
  if (!id_channels.empty()) image.attributes.push_back({kIdChannelsAttribute, id_channels});
  for (int i = 0; i < decoded.part_count; ++i)
    image.attributes.push_back(
        {fmt::format("{}{} of {}", kPartAttribute, i + 1, decoded.part_count),
         std::string(decoded.parts[i])});
  // The parts of a file are listed above; for pages and animation frames the number suffices.
  if (decoded.part_count == 0 && decoded.picture_count > 1)
    image.attributes.push_back(
        {"pictures", fmt::format("{}{}, of which this is the first",
                                 decoded.count_is_cut ? "at least " : "", decoded.picture_count)});
  return image;
}

/// Converts the module's image to an Image with the channels in the order of the result.
Image to_image(const PmOiioImage& decoded, const ReadImageSettings& settings) {
  const std::vector<Source> sources = list_channel_sources(decoded);
  Image image = make_header(decoded, sources);
  image.pixels = make_large_vector<float>(static_cast<std::size_t>(image.width) *
                                          static_cast<std::size_t>(image.height) * sources.size());
  const int alpha = image.find_channel("A");
  const auto colors = std::count_if(sources.begin(), sources.end(),
                                    [](const Source& s) { return channel_rank(s.name) < 3; });
  const PixelRule rule{
      static_cast<std::size_t>(colors), alpha,
      decoded.integer_format != 0 && settings.integer_curve == TransferCurve::kSrgb,
      alpha < 0 || decoded.straight_alpha != 0,
      alpha < 0 || settings.alpha == AlphaMode::kStraight};
  const CodeValues values = decoded.codes ? make_code_values(rule.curved) : CodeValues{};
  parallel_for(
      image.height,
      [&](std::int64_t y) {
        if (decoded.codes)
          look_up_codes(decoded, sources, rule, values, y, image);
        else
          convert_row(decoded, sources, rule, y, image);
      },
      /*grain=*/16);
  return image;
}

/// Settings for textures: the renderer ignores alpha.
constexpr ReadImageSettings kTextureSettings{TransferCurve::kSrgb, AlphaMode::kStraight};

/// Tests whether the channels of the result are R, G and B, or grey three times, then A if there
/// are an even number of decoded channels.
bool has_texture_channels(const PmOiioImage& decoded, const std::vector<Source>& sources) {
  const auto in_count = static_cast<std::size_t>(decoded.channels);
  const std::size_t colors = in_count < 3 ? 1 : 3, last = in_count - 1;
  const bool has_alpha = in_count % 2 == 0;
  if (sources.size() != (has_alpha ? 4u : 3u)) return false;
  for (std::size_t c = 0; c < 3; ++c)
    if (channel_rank(sources[c].name) != c || sources[c].channel != c % colors) return false;
  return !has_alpha || (sources[3].name == "A" && sources[3].channel == last);
}

/// Converts the module's image to a texture. Codes stay in the module's memory.
Texture to_texture(DecodedImage decoded) {
  const std::vector<Source> sources = list_channel_sources(*decoded);
  Texture texture;
  texture.image = make_header(*decoded, sources);
  const bool is_aces_cg =
      color_space_name(texture.image) == color_space_label(ColorSpace::kAcesCg).interop_id;
  if (!decoded->codes || !has_texture_channels(*decoded, sources) || is_aces_cg) {
    texture.image = to_image(*decoded, kTextureSettings);
    convert_to_rec709(texture.image);
    return texture;
  }
  texture.code_channels = static_cast<std::size_t>(decoded->channels);
  texture.code_values = make_code_values(decoded->integer_format != 0);
  const unsigned char* codes = decoded->codes;
  texture.codes = {std::shared_ptr<PmOiioImage>(std::move(decoded)), codes};
  return texture;
}

/// Peak memory of reading, in sizes of the result: codes of up to 16 bits (0.5), decoded floats (1)
/// and the result (1).
constexpr double kCopies = 2.5;

/// Checks the size of an image against the limits.
Status check_size(const std::string& name, const HeaderSize& size, std::size_t max_bytes) {
  const double needed = sizeof(float) * size.width * size.height * size.channels;
  const auto limit = static_cast<double>(max_bytes);
  const auto remaining = static_cast<double>(remaining_memory());
  const auto fail = [&](ErrorCode code, const std::string& why) {
    return make_error(code,
                      "{}: {} x {} pixels of {} channel{} need {} ({}) - scale the image down",
                      name, size.width, size.height, size.channels, size.channels == 1 ? "" : "s",
                      format_bytes(needed), why);
  };
  if (needed > limit)
    return fail(ErrorCode::kInput, fmt::format("more than the limit of {}", format_bytes(limit)));
  if (kCopies * needed > remaining)
    return fail(ErrorCode::kResource,
                fmt::format("several times while they are read, and the memory limit leaves {}",
                            format_bytes(remaining)));
  return Ok{};
}

/// Decodes a file by the reader of its format.
Result<DecodedImage> decode(const std::string& bytes, const std::string& format,
                            std::size_t max_bytes) {
  if (format == "png") return decode_png(bytes, max_bytes);
  PM_TRY(const OiioModule module, load_oiio_module());
  // OpenImageIO 2.4 does not check the data after the pixels of a Targa file (a thumbnail, a date).
  // It ignores them if the footer is missing, so the footer is cut off.
  constexpr std::size_t kFooterSize = 26;
  const std::size_t size = format == "targa" && bytes.size() > 18 + kFooterSize &&
                                   bytes.ends_with(std::string_view("TRUEVISION-XFILE.\0", 18))
                               ? bytes.size() - kFooterSize
                               : bytes.size();
  const PmOiioRequest request{format.c_str(), bytes.data(), size, max_bytes};
  return DecodedImage(module.decode(&request), module.release);
}

/// Decodes a file in memory, and checks it against the settings.
Result<DecodedImage> decode_checked(const std::string& bytes, const std::string& name,
                                    const ReadImageSettings& settings) {
  const Result<std::string> format = sniff_image_format(bytes, name);
  if (!format) return make_error(ErrorCode::kInput, "{}: {}", name, format.error().message);
  // Check the size in the header first, because decoders allocate memory for it before they read
  // any pixel.
  if (const auto size = header_size(bytes, *format))
    PM_TRY_STATUS(check_size(name, *size, settings.max_bytes));
  const auto max_bytes = static_cast<std::size_t>(std::min(
      static_cast<double>(settings.max_bytes), static_cast<double>(remaining_memory()) / kCopies));
  PM_TRY(DecodedImage decoded, decode(bytes, *format, max_bytes));
  if (decoded->failure == PM_OIIO_TOO_LARGE) {
    PM_TRY_STATUS(check_size(name,
                             {1.0 * decoded->width, 1.0 * decoded->height, 1.0 * decoded->channels},
                             settings.max_bytes));
    return make_error(ErrorCode::kResource,
                      "{}: needs more than the {} that the limits leave - "
                      "scale the image down",
                      name, format_bytes(static_cast<double>(max_bytes)));
  }
  if (settings.single_picture && decoded->picture_count > 1)
    return make_error(
        ErrorCode::kInput,
        "{}: holds several parts, pages or pictures, of which only the first would be "
        "looked at - give files of one each",
        name);
  if (decoded->failure != PM_OIIO_GOOD)
    return make_error(ErrorCode::kInput,
                      "{}: cannot read this {} image ({}) - the file is damaged or of an "
                      "unusual kind; save it again",
                      name, *format, decoded->error);
  return decoded;
}

}  // namespace

Result<Image> read_image(const std::filesystem::path& path, const ReadImageSettings& settings) {
  PM_TRY(const std::string bytes, read_file(path));
  return decode_image(bytes, path.string(), settings);
}

Result<Image> decode_image(const std::string& bytes, const std::string& name,
                           const ReadImageSettings& settings) {
  PM_TRY(const DecodedImage decoded, decode_checked(bytes, name, settings));
  Image image = to_image(*decoded, settings);
  if (!settings.stored_colors) convert_to_rec709(image);
  return image;
}

Result<Texture> read_texture(const std::filesystem::path& path) {
  PM_TRY(const std::string bytes, read_file(path));
  return decode_texture(bytes, path.string());
}

Result<Texture> decode_texture(const std::string& bytes, const std::string& name) {
  PM_TRY(DecodedImage decoded, decode_checked(bytes, name, kTextureSettings));
  return to_texture(std::move(decoded));
}

}  // namespace polymorph
