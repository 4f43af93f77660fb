#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <cstring>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "image/color_description.h"
#include "image/oiio_module.h"

namespace {

/// The returned image, with the storage that its pointers refer to.
struct Decoded : PmOiioImage {
  Decoded() : PmOiioImage{} {}
  std::string error_text;
  std::vector<float> pixel_store;
  std::vector<unsigned char> code_store;
  std::vector<std::string> names;
  std::vector<const char*> name_pointers;
  std::vector<std::unique_ptr<std::string>> texts;
  std::vector<PmOiioAttribute> attribute_store;
  std::vector<std::string> part_texts;
  std::vector<const char*> part_pointers;
  std::vector<unsigned char> is_id_store;
};

/// Pixels of a picture or of a part of an OpenEXR file.
struct Part {
  int index = 0;         ///< index of the picture or part in the file
  OIIO::ImageSpec spec;  ///< layout, with the channels that split_large_ids() adds
  std::vector<unsigned char> is_id_channel;  ///< part of PmOiioImage::is_id_channel
  std::vector<float> pixels;  ///< data window; after to_display_window() the display window
};

void fail(Decoded& image, PmOiioFailure failure, std::string reason) {
  image.failure = failure;
  image.error_text = std::move(reason);
  image.error = image.error_text.c_str();
}

/// Sets OpenImageIO's global attributes on the first call.
void set_up_once() {
  static const bool done = [] {
    // One thread, because the caller manages threads. -1 keeps the OpenEXR reader from changing
    // OpenEXR's global pool, which the program's own encoder uses too.
    OIIO::attribute("threads", 1);
    OIIO::attribute("exr_threads", -1);
    OIIO::attribute("limits:channels", 256);  // per picture or part
    return true;
  }();
  (void)done;
}

/// Tests for entries that describe the encoding, not the picture. They are not copied as they are:
/// encoders write their own, and add_display_entries() adds those that matter for display.
bool is_structural(const std::string& name) {
  static const char* const kNames[] = {"compression",
                                       "PixelAspectRatio",
                                       "screenWindowCenter",
                                       "screenWindowWidth",
                                       "planarconfig",
                                       "ResolutionUnit",
                                       "XResolution",
                                       "YResolution",
                                       "Orientation",
                                       "CompressionQuality",
                                       "name"};  // of an OpenEXR part
  for (const char* known : kNames)
    if (name == known) return true;
  for (const char* prefix : {"oiio:", "openexr:", "tiff:", "png:", "jpeg:", "Exif:", "ICCProfile"})
    if (name.rfind(prefix, 0) == 0) return true;
  return false;
}

/// Adds the header entries that change how viewers display the pixels (image_io.h), unless their
/// values are the usual ones.
void add_display_entries(const OIIO::ImageSpec& spec, Decoded& image) {
  const float aspect = spec.get_float_attribute("PixelAspectRatio", 1);
  const int orientation = spec.get_int_attribute("Orientation", 1);
  if (aspect != 1)
    image.attribute_store.push_back({"pixelAspectRatio", PM_OIIO_FLOAT, nullptr, 0, aspect});
  if (orientation != 1)
    image.attribute_store.push_back({"Orientation", PM_OIIO_INT, nullptr, orientation, 0});
  const auto add = [&](const char* name, std::string text) {
    image.texts.push_back(std::make_unique<std::string>(std::move(text)));
    image.attribute_store.push_back(
        {name, PM_OIIO_STRING, image.texts.back()->c_str(), /*integer=*/0, /*real=*/0});
  };
  const OIIO::ParamValue* profile = spec.find_attribute("ICCProfile");
  if (profile && profile->datasize() > 0)
    add("colorProfile", polymorph::describe_profile(profile->data(),
                                                    static_cast<std::size_t>(profile->datasize())));
  const OIIO::ParamValue* xy =
      spec.find_attribute("chromaticities", OIIO::TypeDesc(OIIO::TypeDesc::FLOAT, 8));
  if (!xy) return;
  float primaries[8];
  std::memcpy(primaries, xy->data(), sizeof primaries);
  if (std::string text = polymorph::describe_primaries(primaries); !text.empty())
    add("colorPrimaries", std::move(text));
}

/// Adds the header entries of a part, except those whose names an earlier part has. The part that
/// adds the first entries also adds the display entries.
void add_attributes(const OIIO::ImageSpec& spec, Decoded& image) {
  std::set<std::string> known_names;
  for (const PmOiioAttribute& attribute : image.attribute_store) known_names.insert(attribute.name);
  if (image.attribute_store.empty()) add_display_entries(spec, image);
  for (const OIIO::ParamValue& entry : spec.extra_attribs) {
    const std::string name = entry.name().string();
    if (is_structural(name) || entry.nvalues() != 1 || known_names.count(name)) continue;
    image.texts.push_back(std::make_unique<std::string>(name));
    PmOiioAttribute attribute{image.texts.back()->c_str(), PM_OIIO_INT, /*text=*/nullptr,
                              /*integer=*/0, /*real=*/0};
    if (entry.type() == OIIO::TypeString) {
      attribute.kind = PM_OIIO_STRING;
      image.texts.push_back(std::make_unique<std::string>(entry.get_string()));
      attribute.text = image.texts.back()->c_str();
    } else if (entry.type() == OIIO::TypeInt) {
      attribute.integer = entry.get_int();
    } else if (entry.type() == OIIO::TypeFloat) {
      attribute.kind = PM_OIIO_FLOAT;
      attribute.real = entry.get_float();
    } else {
      continue;
    }
    image.attribute_store.push_back(attribute);
  }
  image.attribute_count = static_cast<int>(image.attribute_store.size());
  image.attributes = image.attribute_store.data();
}

/// Tests for integers of 32 bits, which OpenEXR files use for ids.
bool is_id(const OIIO::ImageSpec& spec, int channel) {
  return spec.channelformat(channel) == OIIO::TypeDesc::UINT;
}

/// Finds the channels with ids above 2^24, which a float would round; `native` has the pixels in
/// the file's types. For each such channel NAME adds a channel NAME.low to `spec`. It will hold the
/// low byte of the ids, and NAME the rest. Returns the indices of the channels NAME.
std::vector<int> split_large_ids(const std::vector<unsigned char>& native, OIIO::ImageSpec& spec) {
  constexpr std::uint32_t kMaxExact = 1u << 24;
  const std::size_t bytes = spec.pixel_bytes(/*native=*/true);
  std::vector<int> split_channels;
  std::size_t offset = 0;
  const int channels = spec.nchannels;
  for (int c = 0; c < channels; offset += spec.channelformat(c++).size()) {
    if (!is_id(spec, c)) continue;
    bool has_large_ids = false;
    for (std::size_t at = offset; at < native.size() && !has_large_ids; at += bytes) {
      std::uint32_t value = 0;
      std::memcpy(&value, &native[at], sizeof value);
      has_large_ids = value > kMaxExact;
    }
    if (!has_large_ids) continue;
    split_channels.push_back(c);
    spec.channelnames.push_back(spec.channelnames[static_cast<std::size_t>(c)] + ".low");
    ++spec.nchannels;
  }
  return split_channels;
}

/// Reads the data window as floats. OpenEXR's uint channels contain ids, which must not be scaled
/// to 0..1 as OpenImageIO does with integers; large ids get an additional channel
/// (split_large_ids()).
bool read_pixels(OIIO::ImageInput& input, Part& part) {
  OIIO::ImageSpec& spec = part.spec;
  const auto count = static_cast<std::size_t>(spec.width) * static_cast<std::size_t>(spec.height);
  const int file_channels = spec.nchannels;
  if (std::count(part.is_id_channel.begin(), part.is_id_channel.end(), 1) == 0) {
    part.pixels.resize(count * static_cast<std::size_t>(file_channels));
    return input.read_image(part.index, /*miplevel=*/0, /*chbegin=*/0, file_channels,
                            OIIO::TypeFloat, part.pixels.data());
  }
  // Read the pixels in the file's types, then convert them channel by channel.
  const std::size_t bytes = spec.pixel_bytes(/*native=*/true);
  std::vector<unsigned char> native(count * bytes);
  if (!input.read_image(part.index, /*miplevel=*/0, /*chbegin=*/0, file_channels, OIIO::TypeUnknown,
                        native.data()))
    return false;
  const OIIO::ImageSpec file_spec = spec;
  const std::vector<int> split_channels = split_large_ids(native, spec);
  part.is_id_channel.resize(static_cast<std::size_t>(spec.nchannels),
                            1);  // the added channels hold ids too
  const auto channels = static_cast<std::size_t>(spec.nchannels);
  part.pixels.resize(count * channels);
  std::size_t offset = 0;
  for (int c = 0; c < file_channels; ++c) {
    const OIIO::TypeDesc type = file_spec.channelformat(c);
    const auto split = std::find(split_channels.begin(), split_channels.end(), c);
    for (std::size_t i = 0; i < count; ++i) {
      const unsigned char* from = &native[i * bytes + offset];
      float* to = &part.pixels[i * channels];
      if (!is_id(file_spec, c)) {
        OIIO::convert_pixel_values(type, from, OIIO::TypeFloat, to + c, 1);
        continue;
      }
      std::uint32_t value = 0;
      std::memcpy(&value, from, sizeof value);
      if (split != split_channels.end()) {
        to[file_channels + (split - split_channels.begin())] = static_cast<float>(value & 0xff);
        value &= ~0xffu;
      }
      to[c] = static_cast<float>(value);
    }
    offset += type.size();
  }
  return true;
}

bool fills_display_window(const OIIO::ImageSpec& spec) {
  return spec.x == spec.full_x && spec.y == spec.full_y && spec.width == spec.full_width &&
         spec.height == spec.full_height;
}

/// Tests whether the pixels are returned as codes (PmOiioImage::codes): grey or three channels of 8
/// bits.
bool has_codes(const OIIO::ImageSpec& spec) {
  return spec.format == OIIO::TypeDesc::UINT8 && spec.channelformats.empty() &&
         spec.alpha_channel < 0 && (spec.nchannels == 1 || spec.nchannels == 3) &&
         fills_display_window(spec);
}

/// Reads the pixels of the first picture as codes.
bool read_codes(OIIO::ImageInput& input, const OIIO::ImageSpec& spec,
                std::vector<unsigned char>& codes) {
  codes.resize(static_cast<std::size_t>(spec.width) * static_cast<std::size_t>(spec.height) *
               static_cast<std::size_t>(spec.nchannels));
  return input.read_image(/*subimage=*/0, /*miplevel=*/0, /*chbegin=*/0, spec.nchannels,
                          OIIO::TypeDesc::UINT8, codes.data());
}

/// Copies the data window to its position in the display window.
std::vector<float> to_display_window(const OIIO::ImageSpec& spec, std::vector<float> pixels) {
  if (fills_display_window(spec)) return pixels;
  const auto channels = static_cast<std::int64_t>(spec.nchannels);
  // Offset of the data window in the display window.
  const std::int64_t dx = std::int64_t{spec.x} - spec.full_x,
                     dy = std::int64_t{spec.y} - spec.full_y;
  // Columns of the display window that the data window covers.
  const std::int64_t begin = std::clamp<std::int64_t>(dx, 0, spec.full_width);
  const std::int64_t end = std::clamp<std::int64_t>(dx + spec.width, begin, spec.full_width);
  std::vector<float> full(
      static_cast<std::size_t>(std::int64_t{spec.full_width} * spec.full_height * channels));
  for (std::int64_t y = std::max<std::int64_t>(dy, 0);
       y < std::min<std::int64_t>(dy + spec.height, spec.full_height); ++y)
    std::copy_n(&pixels[static_cast<std::size_t>(((y - dy) * spec.width + begin - dx) * channels)],
                (end - begin) * channels,
                &full[static_cast<std::size_t>((y * spec.full_width + begin) * channels)]);
  return full;
}

/// Describes the parts of an OpenEXR file, whose headers OpenImageIO has read already.
void list_parts(OIIO::ImageInput& input, Decoded& image) {
  OIIO::ImageSpec part;
  for (int i = 0; input.seek_subimage(i, /*miplevel=*/0, part); ++i) {
    std::string text = std::string(part.get_string_attribute("oiio:subimagename", "no name")) +
                       ": " + std::to_string(part.full_width) + " x " +
                       std::to_string(part.full_height);
    for (const std::string& name : part.channelnames) text += ", " + name;
    image.part_texts.push_back(std::move(text));
  }
  for (const std::string& text : image.part_texts) image.part_pointers.push_back(text.c_str());
  image.part_count = static_cast<int>(image.part_pointers.size());
  image.parts = image.part_pointers.data();
}

/// Counts the pictures of a file, up to limits of their number and of their bytes. These bound the
/// time, because seeking a picture of a GIF decodes all pictures before it.
void count_pictures(OIIO::ImageInput& input, double max_bytes, Decoded& image) {
  constexpr int kMaxPictures = 1000;
  OIIO::ImageSpec next;
  double bytes = 0;
  image.picture_count = 1;
  while (input.seek_subimage(image.picture_count, /*miplevel=*/0, next)) {
    bytes += static_cast<double>(next.image_bytes());
    ++image.picture_count;
    image.count_is_cut = image.picture_count == kMaxPictures || bytes > max_bytes;
    if (image.count_is_cut) return;
  }
}

bool has_usable_size(const OIIO::ImageSpec& spec) {
  return spec.width >= 1 && spec.height >= 1 && spec.full_width >= 1 && spec.full_height >= 1 &&
         spec.depth <= 1 && spec.nchannels >= 1;
}

/// Lists the parts of an OpenEXR file that are joined to one picture: all parts if they are flat,
/// have usable sizes, the same display window and not too many channels together; else the first.
std::vector<Part> list_joined_parts(OIIO::ImageInput& input, const OIIO::ImageSpec& first) {
  constexpr int kMaxChannels = 256;  // of all parts together; limits:channels bounds each
  std::vector<Part> parts(1);
  parts[0].spec = first;
  int channels = first.nchannels;
  OIIO::ImageSpec spec;
  for (int i = 1; input.seek_subimage(i, /*miplevel=*/0, spec); ++i) {
    channels += spec.nchannels;
    if (spec.deep || !has_usable_size(spec) || spec.full_x != first.full_x ||
        spec.full_y != first.full_y || spec.full_width != first.full_width ||
        spec.full_height != first.full_height || channels > kMaxChannels) {
      parts.resize(1);
      break;
    }
    parts.push_back({i, spec, /*is_id_channel=*/{}, /*pixels=*/{}});
  }
  return parts;
}

/// Returns the bytes of the data or the display window, whichever is larger. Each channel of ids
/// counts twice, because it may be split.
double needed_bytes(const Part& part) {
  const OIIO::ImageSpec& spec = part.spec;
  const auto channels = static_cast<double>(
      spec.nchannels + std::count(part.is_id_channel.begin(), part.is_id_channel.end(), 1));
  return channels * sizeof(float) *
         std::max(1.0 * spec.width * spec.height, 1.0 * spec.full_width * spec.full_height);
}

/// Interleaves the channels of all parts in the returned image. A channel whose name an earlier
/// part has gets the prefix "PART." and, if this name exists too, "NUMBER.".
void join_parts(std::vector<Part> parts, Decoded& image) {
  std::set<std::string> known_names;
  for (const Part& part : parts) {
    const std::string label = part.spec.get_string_attribute("oiio:subimagename");
    for (int c = 0; c < part.spec.nchannels; ++c) {
      std::string name = part.spec.channelnames[static_cast<std::size_t>(c)];
      if (known_names.count(name) && !label.empty()) name = label + "." + name;
      if (known_names.count(name)) name = std::to_string(part.index + 1) + "." + name;
      known_names.insert(name);
      image.names.push_back(std::move(name));
    }
    image.is_id_store.insert(image.is_id_store.end(), part.is_id_channel.begin(),
                             part.is_id_channel.end());
  }
  image.channels = static_cast<int>(image.names.size());
  if (parts.size() == 1) {
    image.pixel_store = std::move(parts[0].pixels);
    return;
  }
  const std::size_t count =
      static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height);
  image.pixel_store.resize(count * image.names.size());
  std::size_t first_channel = 0;  // of the part, in the returned image
  for (Part& part : parts) {
    const auto channels = static_cast<std::size_t>(part.spec.nchannels);
    for (std::size_t i = 0; i < count; ++i)
      std::copy_n(&part.pixels[i * channels], channels,
                  &image.pixel_store[i * image.names.size() + first_channel]);
    first_channel += channels;
    part.pixels = {};
  }
}

/// Decodes the request's file into `image`, or sets why that failed.
void decode(const PmOiioRequest& request, Decoded& image) {
  // Open the file, and list the parts to read.
  set_up_once();
  const std::unique_ptr<OIIO::ImageInput> input = OIIO::ImageInput::create(request.format);
  if (!input) return fail(image, PM_OIIO_BROKEN, "this OpenImageIO has no reader for it");
  OIIO::Filesystem::IOMemReader memory(const_cast<void*>(request.bytes), request.size);
  OIIO::ImageSpec config, spec;
  config.attribute("oiio:UnassociatedAlpha", 1);
  OIIO::Filesystem::IOProxy* proxy = &memory;
  config.attribute("oiio:ioproxy", OIIO::TypeDesc::PTR, &proxy);
  if (!input->open("memory", spec, config)) return fail(image, PM_OIIO_BROKEN, input->geterror());
  if (spec.deep) return fail(image, PM_OIIO_BROKEN, "deep images are not read");
  if (!has_usable_size(spec)) return fail(image, PM_OIIO_BROKEN, "the header gives no usable size");
  const bool exr = std::strcmp(request.format, "openexr") == 0;
  std::vector<Part> parts{{/*index=*/0, spec, /*is_id_channel=*/{}, /*pixels=*/{}}};
  if (exr) parts = list_joined_parts(*input, spec);
  // Check the size of all parts before any pixels are read.
  double needed = 0;
  int channels = 0;
  for (Part& part : parts) {
    for (int c = 0; c < part.spec.nchannels; ++c)
      part.is_id_channel.push_back(exr && is_id(part.spec, c));
    needed += needed_bytes(part);
    channels += part.spec.nchannels;
  }
  if (needed > static_cast<double>(request.max_bytes)) {
    image.width = spec.width;
    image.height = spec.height;
    image.channels = channels;
    return fail(image, PM_OIIO_TOO_LARGE, "");
  }
  // Read the parts, and join them to one image.
  image.width = spec.full_width;
  image.height = spec.full_height;
  const bool is_coded = !exr && has_codes(spec);
  for (Part& part : parts) {
    if (!(is_coded ? read_codes(*input, part.spec, image.code_store) : read_pixels(*input, part))) {
      std::string reason = input->geterror();
      return fail(image, PM_OIIO_BROKEN, reason.empty() ? "the pixels cannot be decoded" : reason);
    }
    if (!is_coded) part.pixels = to_display_window(part.spec, std::move(part.pixels));
    add_attributes(part.spec, image);
  }
  const bool is_joined = parts.size() > 1;
  join_parts(std::move(parts), image);
  for (const std::string& name : image.names) image.name_pointers.push_back(name.c_str());
  image.channel_names = image.name_pointers.data();
  image.is_id_channel = image.is_id_store.data();
  if (is_coded)
    image.codes = image.code_store.data();
  else
    image.pixels = image.pixel_store.data();
  image.integer_format = !exr && !spec.format.is_floating_point();
  image.straight_alpha = spec.get_int_attribute("oiio:UnassociatedAlpha") != 0;
  // The pictures of an OpenEXR file are its parts. Joined parts are one picture.
  count_pictures(*input, static_cast<double>(request.max_bytes), image);
  if (exr && image.picture_count > 1) list_parts(*input, image);
  if (is_joined) image.picture_count = 1;
}

}  // namespace

extern "C" {

__attribute__((visibility("default"))) int polymorph_oiio_interface(void) {
  return PM_OIIO_INTERFACE;
}

__attribute__((visibility("default"))) PmOiioImage* polymorph_oiio_decode(
    const PmOiioRequest* request) {
  auto* image = new Decoded;
  // No exception may cross the C interface; those of OpenEXR and bad_alloc arrive here.
  try {
    decode(*request, *image);
  } catch (const std::exception& e) {
    fail(*image, PM_OIIO_BROKEN, e.what());
  }
  return image;
}

__attribute__((visibility("default"))) void polymorph_oiio_free(PmOiioImage* image) {
  delete static_cast<Decoded*>(image);
}

}  // extern "C"
