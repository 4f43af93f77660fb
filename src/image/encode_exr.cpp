#include <ImfChannelList.h>
#include <ImfFloatAttribute.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfIntAttribute.h>
#include <ImfMultiPartOutputFile.h>
#include <ImfOutputFile.h>
#include <ImfOutputPart.h>
#include <ImfPartType.h>
#include <ImfStandardAttributes.h>
#include <ImfStringAttribute.h>
#include <ImfThreading.h>
#include <half.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <mutex>
#include <new>
#include <set>
#include <system_error>

#include "base/parallel.h"
#include "image/image_io.h"

namespace polymorph {
namespace {

/// Output stream in memory. It needs seekp because OpenEXR fills in the table of line offsets at
/// the end.
class MemoryStream : public Imf::OStream {
 public:
  MemoryStream() : Imf::OStream("memory") {}
  void write(const char data[], int count) override {
    const auto n = static_cast<std::size_t>(count);
    if (position_ + n > bytes_.size()) bytes_.resize(position_ + n);
    std::memcpy(&bytes_[position_], data, n);
    position_ += n;
  }
  std::uint64_t tellp() override { return position_; }
  void seekp(std::uint64_t position) override { position_ = position; }
  std::string take() { return std::move(bytes_); }

 private:
  std::string bytes_;
  std::size_t position_ = 0;
};

Imf::Compression to_openexr(ExrCompression compression) {
  switch (compression) {
    case ExrCompression::kNone:
      return Imf::NO_COMPRESSION;
    case ExrCompression::kZip:
      return Imf::ZIP_COMPRESSION;
    case ExrCompression::kZips:
      return Imf::ZIPS_COMPRESSION;
    case ExrCompression::kPiz:
      return Imf::PIZ_COMPRESSION;
  }
  return Imf::ZIP_COMPRESSION;
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

Status add_attributes(const std::vector<Attribute>& attributes, Imf::Header& header) {
  for (const Attribute& attribute : attributes) {
    // make_header() and the settings provide these two.
    if (attribute.name == kPixelAspectAttribute && std::get_if<float>(&attribute.value)) continue;
    if (attribute.name == kColorInteropAttribute) continue;
    const char* name = attribute.name.c_str();
    // OpenEXR's names have 1 to 255 bytes.
    if (attribute.name.empty() || attribute.name.size() > 255 ||
        header.find(name) != header.end() || attribute.name == "channels")
      return make_error(
          ErrorCode::kInternal,
          "cannot write the header entry '{}' twice, or in place of the encoder's own",
          attribute.name);
    if (const auto* text = std::get_if<std::string>(&attribute.value))
      header.insert(name, Imf::StringAttribute(*text));
    else if (const auto* integer = std::get_if<int>(&attribute.value))
      header.insert(name, Imf::IntAttribute(*integer));
    else
      header.insert(name, Imf::FloatAttribute(std::get<float>(attribute.value)));
  }
  return Ok{};
}

/// Makes a header with the compression and with the entries that OpenEXR requires to be equal in
/// all parts of a file.
Imf::Header make_header(const Image& image, const ExrSettings& settings) {
  Imf::Header header(image.width, image.height);
  header.compression() = to_openexr(settings.compression);
  // zlib's level 1 takes less than half the time of OpenEXR's default of 4, and files with
  // rendered noise become 5 % larger.
  header.zipCompressionLevel() = 1;
  for (const Attribute& attribute : image.attributes)
    if (const float* aspect = std::get_if<float>(&attribute.value);
        aspect && attribute.name == kPixelAspectAttribute)
      header.pixelAspectRatio() = *aspect;
  const float(&xy)[8] = color_space_label(settings.color_space).chromaticities;
  Imf::addChromaticities(header, {{xy[0], xy[1]}, {xy[2], xy[3]}, {xy[4], xy[5]}, {xy[6], xy[7]}});
  return header;
}

void add_channel(const std::string& name, Imf::Header& header) {
  header.channels().insert(name, Imf::Channel(is_half(name) ? Imf::HALF : Imf::FLOAT));
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

/// Makes a header for each part, one part per layer. The first part has the colours and all of the
/// image's entries; the others repeat only the entries of the Cryptomatte that they belong to.
Result<std::vector<Imf::Header>> make_part_headers(const Image& image, const Layers& layers,
                                                   const ExrSettings& settings) {
  std::vector<std::string> order;
  for (const auto& [layer, channels] : layers)
    order.insert(layer == kColorPart ? order.begin() : order.end(), layer);  // colours first
  std::vector<Imf::Header> headers;
  for (const std::string& layer : order) {
    Imf::Header header = make_header(image, settings);
    header.setName(layer);
    header.setType(Imf::SCANLINEIMAGE);
    const bool has_colors = layer == kColorPart || is_color_layer(image, layer);
    header.insert(kColorInteropAttribute,
                  Imf::StringAttribute(
                      has_colors ? color_space_label(settings.color_space).interop_id : "data"));
    for (const std::string& name : layers.at(layer)) add_channel(name, header);
    PM_TRY_STATUS(add_attributes(
        headers.empty() ? image.attributes : list_cryptomatte_entries(image, layer), header));
    headers.push_back(std::move(header));
  }
  return headers;
}

Image convert_copy(Image image, ColorSpace space) {
  convert_colors(image, space);
  return image;
}

/// One plane per channel, in `halves` or in `floats`; the other is empty. OpenEXR copies planes
/// faster than interleaved samples.
struct Planes {
  std::vector<std::vector<half>> halves;
  std::vector<std::vector<float>> floats;
};

/// Copies the channels into planes. Returns OpenEXR's description of these planes.
Imf::FrameBuffer fill_planes(const Image& image, Planes& planes) {
  const std::size_t pixels =
      static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height);
  const std::size_t count = image.channel_count();
  planes.halves.resize(count);
  planes.floats.resize(count);
  Imf::FrameBuffer buffer;
  for (std::size_t c = 0; c < count; ++c) {
    const bool is_half_channel = is_half(image.channels[c]);
    if (is_half_channel)
      planes.halves[c].resize(pixels);
    else
      planes.floats[c].resize(pixels);
    const std::size_t size = is_half_channel ? sizeof(half) : sizeof(float);
    char* base = is_half_channel ? reinterpret_cast<char*>(planes.halves[c].data())
                                 : reinterpret_cast<char*>(planes.floats[c].data());
    buffer.insert(image.channels[c],
                  Imf::Slice(is_half_channel ? Imf::HALF : Imf::FLOAT, base, size,
                             size * static_cast<std::size_t>(image.width)));
  }
  parallel_ranges(static_cast<std::int64_t>(pixels), /*grain=*/1 << 14,
                  [&](std::int64_t begin, std::int64_t end) {
                    for (std::size_t c = 0; c < count; ++c)
                      for (auto i = static_cast<std::size_t>(begin);
                           i < static_cast<std::size_t>(end); ++i) {
                        const float value = image.pixels[i * count + c];
                        if (planes.floats[c].empty())
                          planes.halves[c][i] = to_half(value);
                        else
                          planes.floats[c][i] = value;
                      }
                  });
  return buffer;
}

Status check_channels(const Image& image) {
  if (image.width < 1 || image.height < 1 || image.channels.empty())
    return make_error(ErrorCode::kInternal, "cannot encode an image without pixels or channels");
  const std::set<std::string> names(image.channels.begin(), image.channels.end());
  if (names.size() != image.channels.size() || names.count(""))
    return make_error(ErrorCode::kInternal,
                      "cannot encode an image with equal or empty channel names");
  return Ok{};
}

/// Sets up OpenEXR's thread pool, which compresses the chunks. Returns the number of its threads to
/// use; 0 stands for the caller's thread alone. The bytes do not depend on the number of threads.
int prepare_exr_threads() {
  const int count = thread_count() > 1 ? thread_count() : 0;
  static std::mutex mutex;
  const std::lock_guard lock(mutex);
  // Add one thread at a time. If several are requested and one of them cannot be started, OpenEXR
  // 3.1 frees the new pool while the threads started before wait in it.
  for (int n = Imf::globalThreadCount() + 1; n <= count; ++n) Imf::setGlobalThreadCount(n);
  return count;
}

Status write_one_part(const Image& image, const ExrSettings& settings,
                      const Imf::FrameBuffer& buffer, MemoryStream& stream) {
  Imf::Header header = make_header(image, settings);
  header.insert(kColorInteropAttribute,
                Imf::StringAttribute(color_space_label(settings.color_space).interop_id));
  for (const std::string& name : image.channels) add_channel(name, header);
  PM_TRY_STATUS(add_attributes(image.attributes, header));
  // OutputFile's destructor writes the table of line offsets.
  Imf::OutputFile file(stream, header, prepare_exr_threads());
  file.setFrameBuffer(buffer);
  file.writePixels(image.height);
  return Ok{};
}

Status write_parts(const Image& image, const Layers& layers, const ExrSettings& settings,
                   const Imf::FrameBuffer& buffer, MemoryStream& stream) {
  PM_TRY(const std::vector<Imf::Header> headers, make_part_headers(image, layers, settings));
  const int count = static_cast<int>(headers.size());
  Imf::MultiPartOutputFile file(stream, headers.data(), count, /*overrideSharedAttributes=*/false,
                                prepare_exr_threads());
  for (int i = 0; i < count; ++i) {
    Imf::OutputPart part(file, i);
    part.setFrameBuffer(buffer);
    part.writePixels(image.height);
  }
  return Ok{};
}

}  // namespace

Result<std::string> encode_exr(const Image& image, const ExrSettings& settings) {
  PM_TRY_STATUS(check_channels(image));
  try {
    Planes planes;
    const Imf::FrameBuffer buffer =
        settings.color_space == ColorSpace::kRec709
            ? fill_planes(image, planes)
            : fill_planes(convert_copy(image, settings.color_space), planes);
    MemoryStream stream;
    const Layers layers = list_layers(image);
    PM_TRY_STATUS(settings.multipart && layers.size() > 1
                      ? write_parts(image, layers, settings, buffer, stream)
                      : write_one_part(image, settings, buffer, stream));
    return stream.take();
  } catch (const std::bad_alloc&) {
    throw;  // main() reports it
  } catch (const std::system_error& e) {
    return make_thread_error(e.what());  // from OpenEXR's pool
  } catch (const std::exception& e) {
    return make_error(ErrorCode::kOutput, "cannot encode the EXR: {}", e.what());
  }
}

}  // namespace polymorph
