#include <half.h>
#include <libdeflate.h>
#include <openexr.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <map>
#include <memory>
#include <new>
#include <set>

#include "base/parallel.h"
#include "base/text.h"
#include "image/image_io.h"

namespace polymorph {
namespace {

/// The file that OpenEXR writes.
struct Output {
  std::string bytes;
  bool has_memory = true;
};

/// Stores bytes at a position of the Output. OpenEXR fills in the table of chunks at the end.
std::int64_t store(exr_const_context_t, void* output, const void* data, std::uint64_t size,
                   std::uint64_t position, exr_stream_error_func_ptr_t) {
  auto& [bytes, has_memory] = *static_cast<Output*>(output);
  try {
    if (position + size > bytes.size()) bytes.resize(position + size);
  } catch (const std::bad_alloc&) {  // no exception may pass through OpenEXR, which is C
    has_memory = false;
    return -1;
  }
  std::memcpy(&bytes[position], data, size);
  return static_cast<std::int64_t>(size);
}

/// Keeps OpenEXR from printing its message. Here nothing of OpenEXR may be called, not even for the
/// Output: it reports some errors while it holds the lock that this would wait for.
void ignore_message(exr_const_context_t, exr_result_t, const char*) {}

/// Throws std::bad_alloc if there is no memory. Other failures of OpenEXR are errors (kOutput).
Status check(exr_result_t result, const Output& output) {
  if (result == EXR_ERR_SUCCESS) return Ok{};
  if (result == EXR_ERR_OUT_OF_MEMORY || !output.has_memory) throw std::bad_alloc();
  return make_error(ErrorCode::kOutput, "cannot encode the EXR: {}",
                    exr_get_default_error_message(result));
}

/// Tests whether a channel is stored as half: colours and alpha. All others are stored as float.
bool is_half(const std::string& channel) {
  return channel == "R" || channel == "G" || channel == "B" || channel == "A";
}

/// Converts a sample to half. A highlight beyond half's range is clamped, because an infinity would
/// fail every comparison.
half to_half(float value) {
  return half(std::isfinite(value) ? std::clamp(value, -65504.0f, 65504.0f) : value);
}

/// The channel names of each layer, by the layer's name, which is the channel's name up to the last
/// dot; a channel without a dot, such as Z, is a layer of its own. The channels R, G, B and A are
/// the layer kColorPart.
using Layers = std::map<std::string, std::vector<std::string>>;
constexpr const char* kColorPart = "rgba";

Layers list_layers(const Image& image) {
  Layers layers;
  for (const std::string& name : image.channels)
    layers[is_half(name) ? kColorPart : name.substr(0, name.rfind('.'))].push_back(name);
  return layers;
}

/// Lists the header entries "cryptomatte/ID/..." of the Cryptomatte that a layer belongs to. The
/// layer's name begins with that of the Cryptomatte.
std::vector<Attribute> list_cryptomatte_entries(const Image& image, const std::string& layer) {
  std::vector<Attribute> entries;
  for (const Attribute& entry : image.attributes) {
    const auto* text = std::get_if<std::string>(&entry.value);
    if (!text || !entry.name.starts_with("cryptomatte/") || !entry.name.ends_with("/name") ||
        !layer.starts_with(*text))
      continue;
    const std::string prefix = entry.name.substr(0, entry.name.rfind('/') + 1);
    for (const Attribute& attribute : image.attributes)
      if (attribute.name.starts_with(prefix)) entries.push_back(attribute);
  }
  return entries;
}

constexpr std::size_t kMaxName = 255;  ///< bytes of the name of a channel or a header entry

/// Tests whether a text has a byte of zero, where OpenEXR's C library would end it.
bool has_zero(const std::string& text) { return text.find('\0') != std::string::npos; }

Status check_channels(const Image& image) {
  if (image.width < 1 || image.height < 1 || image.channels.empty())
    return make_error(ErrorCode::kInternal, "cannot encode an image without pixels or channels");
  const std::set<std::string> names(image.channels.begin(), image.channels.end());
  if (names.size() != image.channels.size() || names.count(""))
    return make_error(ErrorCode::kInternal,
                      "cannot encode an image with equal or empty channel names");
  for (const std::string& name : image.channels)
    if (name.size() > kMaxName || has_zero(name))
      return make_error(ErrorCode::kInternal,
                        "cannot encode a channel whose name is longer than {} bytes, or has a byte "
                        "of zero",
                        kMaxName);
  return Ok{};
}

/// A channel of a part.
struct PartChannel {
  std::size_t index;  ///< index in the image
  bool is_half;
};
/// A part of the file.
struct Part {
  std::string name;  ///< name of its layer; empty in a file of one part
  std::vector<std::string> names;
  std::vector<PartChannel> channels;  ///< sorted by name, as in the file
  std::vector<Attribute> attributes;
  bool has_colors;
  std::size_t row_size;  ///< bytes of a row that is not compressed
};

/// Makes a part of the channels with the given names.
Part make_part(const Image& image, std::string name, std::vector<std::string> names,
               std::vector<Attribute> attributes, bool has_colors) {
  std::sort(names.begin(), names.end());
  Part part{std::move(name), std::move(names), {}, std::move(attributes), has_colors, 0};
  for (const std::string& channel : part.names) {
    part.channels.push_back(
        {static_cast<std::size_t>(image.find_channel(channel)), is_half(channel)});
    part.row_size +=
        static_cast<std::size_t>(image.width) * (is_half(channel) ? sizeof(half) : sizeof(float));
  }
  return part;
}

/// Lists the parts of the file: one, or one per layer. The first part has the colours and all of
/// the image's entries; the others repeat only the entries of the Cryptomatte that they belong to.
std::vector<Part> list_parts(const Image& image, bool multipart) {
  const Layers layers = list_layers(image);
  std::vector<Part> parts;
  if (!multipart || layers.size() == 1) {
    parts.push_back(make_part(image, "", image.channels, image.attributes, true));
    return parts;
  }
  std::vector<std::string> order;
  for (const auto& [layer, channels] : layers)
    order.insert(layer == kColorPart ? order.begin() : order.end(), layer);  // colours first
  for (const std::string& layer : order)
    parts.push_back(
        make_part(image, layer, layers.at(layer),
                  parts.empty() ? image.attributes : list_cryptomatte_entries(image, layer),
                  layer == kColorPart || is_color_layer(image, layer)));
  return parts;
}

/// Tests whether a header entry is one that this encoder or OpenEXR writes.
bool is_encoders_own(exr_const_context_t file, int part, const std::string& name) {
  static const std::set<std::string_view> names{"channels", "chunkCount", "name",
                                                "tiles",    "type",       "version"};
  const exr_attribute_t* attribute = nullptr;
  return names.contains(name) ||
         exr_get_attribute_by_name(file, part, name.c_str(), &attribute) == EXR_ERR_SUCCESS;
}

Status add_attributes(const std::vector<Attribute>& attributes, const Output& output,
                      exr_context_t file, int part) {
  for (const Attribute& attribute : attributes) {
    // add_header() and the settings provide these two.
    if (attribute.name == kPixelAspectAttribute && std::get_if<float>(&attribute.value)) continue;
    if (attribute.name == kColorInteropAttribute) continue;
    const char* name = attribute.name.c_str();
    if (attribute.name.empty() || attribute.name.size() > kMaxName ||
        is_encoders_own(file, part, attribute.name))
      return make_error(
          ErrorCode::kInternal,
          "cannot write the header entry '{}' twice, or in place of the encoder's own",
          attribute.name);
    const auto* const value = std::get_if<std::string>(&attribute.value);
    if (has_zero(attribute.name) || (value && has_zero(*value)))
      return make_error(ErrorCode::kOutput,
                        "cannot encode the EXR: its header entry '{}' has a byte of zero",
                        printable(attribute.name));
    exr_result_t result = EXR_ERR_SUCCESS;
    if (value)
      result = exr_attr_set_string(file, part, name, value->c_str());
    else if (const auto* integer = std::get_if<int>(&attribute.value))
      result = exr_attr_set_int(file, part, name, *integer);
    else
      result = exr_attr_set_float(file, part, name, std::get<float>(attribute.value));
    PM_TRY_STATUS(check(result, output));
  }
  return Ok{};
}

/// Adds a part's header to the file, with the entries that OpenEXR requires to be equal in all
/// parts of a file.
Status add_header(const Image& image, const Part& part, const ExrSettings& settings,
                  const Output& output, exr_context_t file) {
  int index = 0;
  PM_TRY_STATUS(check(exr_add_part(file, part.name.empty() ? nullptr : part.name.c_str(),
                                   EXR_STORAGE_SCANLINE, &index),
                      output));
  float aspect = 1;
  for (const Attribute& attribute : image.attributes)
    if (const float* value = std::get_if<float>(&attribute.value);
        value && attribute.name == kPixelAspectAttribute)
      aspect = *value;
  const exr_attr_box2i_t window{{0, 0}, {image.width - 1, image.height - 1}};
  const exr_attr_v2f_t center{0, 0};
  PM_TRY_STATUS(check(exr_initialize_required_attr(file, index, &window, &window, aspect, &center,
                                                   /*screenWindowWidth=*/1,
                                                   EXR_LINEORDER_INCREASING_Y, EXR_COMPRESSION_ZIP),
                      output));
  const ColorSpaceLabel& label = color_space_label(settings.color_space);
  const float(&xy)[8] = label.chromaticities;
  const exr_attr_chromaticities_t chromaticities{xy[0], xy[1], xy[2], xy[3],
                                                 xy[4], xy[5], xy[6], xy[7]};
  PM_TRY_STATUS(
      check(exr_attr_set_chromaticities(file, index, "chromaticities", &chromaticities), output));
  PM_TRY_STATUS(check(exr_attr_set_string(file, index, kColorInteropAttribute,
                                          part.has_colors ? label.interop_id : "data"),
                      output));
  for (std::size_t c = 0; c < part.channels.size(); ++c)
    PM_TRY_STATUS(check(exr_add_channel(file, index, part.names[c].c_str(),
                                        part.channels[c].is_half ? EXR_PIXEL_HALF : EXR_PIXEL_FLOAT,
                                        EXR_PERCEPTUALLY_LOGARITHMIC, /*xsamp=*/1, /*ysamp=*/1),
                        output));
  return add_attributes(part.attributes, output, file, index);
}

/// Rows of a chunk that ZIP compresses together.
constexpr int kRowsPerChunk = 16;

/// Copies rows [begin, end) of a part's channels in the order of the file.
std::vector<std::uint8_t> pack_rows(const Image& image, const Part& part, int begin, int end) {
  static_assert(std::endian::native == std::endian::little);  // as in the file
  std::vector<std::uint8_t> bytes(part.row_size * static_cast<std::size_t>(end - begin));
  std::uint8_t* out = bytes.data();
  const std::size_t count = image.channel_count(), width = static_cast<std::size_t>(image.width);
  const auto store_row = [&](const float* pixel, auto convert) {
    for (std::size_t x = 0; x < width; ++x, pixel += count) {
      const auto value = convert(*pixel);
      std::memcpy(out, &value, sizeof(value));
      out += sizeof(value);
    }
  };
  for (int y = begin; y < end; ++y)
    for (const PartChannel& channel : part.channels) {
      const float* first =
          &image.pixels[static_cast<std::size_t>(y) * width * count + channel.index];
      if (channel.is_half)
        store_row(first, to_half);
      else
        store_row(first, [](float value) { return value; });
    }
  return bytes;
}

/// Separates the bytes at even places from those at odd ones, then replaces each byte by its
/// difference to the one before, plus 128, as OpenEXR's ZIP does ("OpenEXR File Layout").
std::vector<std::uint8_t> filter(const std::vector<std::uint8_t>& bytes) {
  const std::size_t size = bytes.size(), evens = (size + 1) / 2;
  std::vector<std::uint8_t> separated(size), filtered(size);
  for (std::size_t i = 0; i < size / 2; ++i) {
    separated[i] = bytes[2 * i];
    separated[evens + i] = bytes[2 * i + 1];
  }
  if (size % 2) separated[evens - 1] = bytes[size - 1];
  filtered[0] = separated[0];
  for (std::size_t i = 1; i < size; ++i)
    filtered[i] = static_cast<std::uint8_t>(separated[i] - separated[i - 1] + 128);
  return filtered;
}

/// Compresses a chunk. Returns its bytes as they are if they become no smaller. libdeflate takes
/// 0.6 of zlib's time at level 1, and files with rendered noise become 4 % smaller.
std::vector<std::uint8_t> compress(std::vector<std::uint8_t> bytes) {
  constexpr int kLevel = 1;  // of 12; level 6 takes 1.5 times as long for 2 % smaller files
  const std::unique_ptr<libdeflate_compressor, void (*)(libdeflate_compressor*)> compressor(
      libdeflate_alloc_compressor(kLevel), &libdeflate_free_compressor);
  if (!compressor) throw std::bad_alloc();
  const std::vector<std::uint8_t> filtered = filter(bytes);
  std::vector<std::uint8_t> packed(bytes.size() - 1);
  packed.resize(libdeflate_zlib_compress(compressor.get(), filtered.data(), filtered.size(),
                                         packed.data(), packed.size()));
  if (packed.empty()) return bytes;
  packed.shrink_to_fit();
  return packed;
}

/// Writes all chunks. They are compressed on all threads.
Status write_chunks(const Image& image, const std::vector<Part>& parts, const Output& output,
                    exr_context_t file) {
  const auto chunks_per_part =
      static_cast<std::size_t>((image.height + kRowsPerChunk - 1) / kRowsPerChunk);
  std::vector<std::vector<std::uint8_t>> chunks(parts.size() * chunks_per_part);
  const auto first_row = [&](std::size_t chunk) {
    return static_cast<int>(chunk % chunks_per_part) * kRowsPerChunk;
  };
  parallel_for(static_cast<std::int64_t>(chunks.size()), [&](std::int64_t i) {
    const auto chunk = static_cast<std::size_t>(i);
    const int begin = first_row(chunk), end = std::min(begin + kRowsPerChunk, image.height);
    chunks[chunk] = compress(pack_rows(image, parts[chunk / chunks_per_part], begin, end));
  });
  for (std::size_t i = 0; i < chunks.size(); ++i) {
    const std::vector<std::uint8_t> chunk = std::move(chunks[i]);  // frees its memory below
    PM_TRY_STATUS(check(exr_write_scanline_chunk(file, static_cast<int>(i / chunks_per_part),
                                                 first_row(i), chunk.data(), chunk.size()),
                        output));
  }
  return Ok{};
}

/// Writes headers and parts. Errors: those of check() and of add_attributes().
Status write_file(const Image& image, const ExrSettings& settings, const Output& output,
                  exr_context_t file) {
  // OpenEXR marks a file whose names may be longer than 31 bytes, which readers before 2.0 refuse.
  const auto is_long = [](const std::string& name) { return name.size() > 31; };
  const bool has_long_names =
      std::any_of(image.channels.begin(), image.channels.end(), is_long) ||
      std::any_of(image.attributes.begin(), image.attributes.end(),
                  [&](const Attribute& attribute) { return is_long(attribute.name); });
  PM_TRY_STATUS(check(exr_set_longname_support(file, has_long_names), output));
  const std::vector<Part> parts = list_parts(image, settings.multipart);
  for (const Part& part : parts) PM_TRY_STATUS(add_header(image, part, settings, output, file));
  PM_TRY_STATUS(check(exr_write_header(file), output));
  return write_chunks(image, parts, output, file);
}

/// Encodes an image whose colours are in the space of the settings.
Result<std::string> encode_converted(const Image& image, const ExrSettings& settings) {
  Output output;
  exr_context_initializer_t callbacks = EXR_DEFAULT_CONTEXT_INITIALIZER;
  callbacks.user_data = &output;
  callbacks.write_fn = &store;
  callbacks.error_handler_fn = &ignore_message;
  exr_context_t file = nullptr;
  PM_TRY_STATUS(
      check(exr_start_write(&file, "the file", EXR_WRITE_FILE_DIRECTLY, &callbacks), output));
  const auto finish = [&] { return exr_finish(&file); };
  try {
    Status status = write_file(image, settings, output, file);
    const exr_result_t result = finish();
    PM_TRY_STATUS(std::move(status));
    PM_TRY_STATUS(check(result, output));
  } catch (...) {
    finish();  // does nothing if it was called before
    throw;
  }
  return std::move(output.bytes);
}

}  // namespace

Result<std::string> encode_exr(const Image& image, const ExrSettings& settings) {
  PM_TRY_STATUS(check_channels(image));
  if (settings.color_space == ColorSpace::kRec709) return encode_converted(image, settings);
  Image converted = image;
  convert_colors(converted, settings.color_space);
  return encode_converted(converted, settings);
}

}  // namespace polymorph
