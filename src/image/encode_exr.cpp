#include <ImfChannelList.h>
#include <ImfFloatAttribute.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfIntAttribute.h>
#include <ImfOutputFile.h>
#include <ImfStandardAttributes.h>
#include <ImfStringAttribute.h>
#include <ImfThreading.h>
#include <half.h>

#include <algorithm>
#include <cmath>
#include <cstring>
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

bool is_half(const std::string& channel) {
  return channel == "R" || channel == "G" || channel == "B" || channel == "A";
}

/// Converts to half; a highlight beyond half's range stays finite, because an infinity would fail
/// every comparison.
half to_half(float value) {
  return half(std::isfinite(value) ? std::clamp(value, -65504.0f, 65504.0f) : value);
}

Status add_attributes(const Image& image, Imf::Header& header) {
  for (const Attribute& attribute : image.attributes) {
    if (const float* aspect = std::get_if<float>(&attribute.value);
        aspect && attribute.name == kPixelAspectAttribute) {
      header.pixelAspectRatio() = *aspect;
      continue;
    }
    if (attribute.name == kColorInteropAttribute) continue;  // that of the settings holds
    const char* name = attribute.name.c_str();
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

void add_color_space(ColorSpace space, Imf::Header& header) {
  const ColorSpaceLabel& label = color_space_label(space);
  const float(&xy)[8] = label.chromaticities;
  Imf::addChromaticities(header, {{xy[0], xy[1]}, {xy[2], xy[3]}, {xy[4], xy[5]}, {xy[6], xy[7]}});
  header.insert(kColorInteropAttribute, Imf::StringAttribute(label.interop_id));
}

Image converted(Image image, ColorSpace space) {
  convert_colors(image, space);
  return image;
}

/// One plane per channel: OpenEXR copies planes faster than interleaved samples.
struct Planes {
  std::vector<std::vector<half>> halves;
  std::vector<std::vector<float>> floats;
};

Imf::FrameBuffer fill_planes(const Image& image, Planes& planes) {
  const std::size_t pixels =
      static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height);
  const std::size_t count = image.channel_count();
  planes.halves.resize(count);
  planes.floats.resize(count);
  Imf::FrameBuffer buffer;
  for (std::size_t c = 0; c < count; ++c) {
    const bool small = is_half(image.channels[c]);
    if (small)
      planes.halves[c].resize(pixels);
    else
      planes.floats[c].resize(pixels);
    const std::size_t size = small ? sizeof(half) : sizeof(float);
    char* base = small ? reinterpret_cast<char*>(planes.halves[c].data())
                       : reinterpret_cast<char*>(planes.floats[c].data());
    buffer.insert(image.channels[c], Imf::Slice(small ? Imf::HALF : Imf::FLOAT, base, size,
                                                size * static_cast<std::size_t>(image.width)));
  }
  parallel_ranges(
      static_cast<std::int64_t>(pixels), 1 << 14, [&](std::int64_t begin, std::int64_t end) {
        for (std::size_t c = 0; c < count; ++c)
          for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i) {
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

/// Sets up OpenEXR's thread pool, which compresses the chunks; the bytes do not depend on the
/// number of threads.
int prepare_exr_threads() {
  const int count = thread_count() > 1 ? thread_count() : 0;
  if (Imf::globalThreadCount() < count) Imf::setGlobalThreadCount(count);
  return count;
}

}  // namespace

Result<std::string> encode_exr(const Image& image, const ExrSettings& settings) {
  PM_TRY_STATUS(check_channels(image));
  try {
    Imf::Header header(image.width, image.height);
    header.compression() = to_openexr(settings.compression);
    // zlib's level 1 takes less than half the time of OpenEXR's default of 4, and files with
    // rendered noise become 5 % larger.
    header.zipCompressionLevel() = 1;
    add_color_space(settings.color_space, header);
    for (const std::string& name : image.channels)
      header.channels().insert(name, Imf::Channel(is_half(name) ? Imf::HALF : Imf::FLOAT));
    PM_TRY_STATUS(add_attributes(image, header));
    Planes planes;
    const Imf::FrameBuffer buffer =
        settings.color_space == ColorSpace::kRec709
            ? fill_planes(image, planes)
            : fill_planes(converted(image, settings.color_space), planes);
    MemoryStream stream;
    {
      // Its destructor writes the table of line offsets.
      Imf::OutputFile file(stream, header, prepare_exr_threads());
      file.setFrameBuffer(buffer);
      file.writePixels(image.height);
    }
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
