// Image reading and writing. PNG files are read by libpng, all others by OpenImageIO, which is
// linked into a module that is opened on first use (loading its 259 shared objects takes 0.3 s);
// writing encodes to memory, then writes whole files.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

#include "base/result.h"
#include "image/color_space.h"
#include "image/image.h"
#include "image/srgb.h"
#include "image/texture.h"

namespace polymorph {

/// Transfer curve of encoded colours.
enum class TransferCurve { kLinear, kSrgb };
/// Convention for colours with alpha: multiplied by alpha, or not.
enum class AlphaMode { kPremultiplied, kStraight };

/// Header entries that change how viewers display the pixels; this program does not apply them. An
/// image that was read has an entry only if its value is unusual: an aspect other than 1, an
/// orientation other than 1 (Exif's numbers), a gamma other than sRGB's.
inline constexpr const char* kPixelAspectAttribute = "pixelAspectRatio";  ///< float
inline constexpr const char* kOrientationAttribute = "Orientation";       ///< int
inline constexpr const char* kGammaAttribute = "gamma";                   ///< float, a PNG's gAMA
/// Strings (image/color_description.h): the first describes an ICC profile or a PNG's cICP chunk
/// other than sRGB's, the second describes primaries other than those of Rec. 709.
inline constexpr const char* kColorProfileAttribute = "colorProfile";
inline constexpr const char* kColorPrimariesAttribute = "colorPrimaries";
/// String that names the colour space of an EXR, as the Color Interop Forum recommends
/// (github.com/AcademySoftwareFoundation/ColorInterop), as in "lin_rec709_scene".
inline constexpr const char* kColorInteropAttribute = "colorInteropID";

/// String: comma-separated names of the channels that hold whole numbers, such as ids (OpenEXR's
/// UINT).
inline constexpr const char* kIdChannelsAttribute = "idChannels";
/// Prefix of the entries "part 1 of 2", "part 2 of 2" and so on: strings that state the name, size
/// and channels of each part of a multi-part OpenEXR file.
inline constexpr const char* kPartAttribute = "part ";

struct ReadImageSettings {
  /// Curve for decoding 8- and 16-bit formats (colour textures: kSrgb); float formats are always
  /// linear.
  TransferCurve integer_curve = TransferCurve::kSrgb;
  /// Alpha mode of the result: premultiplied as Image requires, or straight (for textures of which
  /// only the colours are used). The file's mode is converted in linear light.
  AlphaMode alpha = AlphaMode::kPremultiplied;
  /// Limit of the decoded size in bytes. Both this limit and the memory that the process may still
  /// take (base/memory.h) are checked before the pixels are allocated.
  std::size_t max_bytes = std::size_t{1} << 30;
  /// If true, a file of several pages or pictures is an error, and so is an OpenEXR file whose
  /// parts cannot be joined. If false, the first of them is read.
  bool single_picture = false;
  /// If true, colours keep the file's numbers, in the space that color_space_name() returns. If
  /// false, colours in ACEScg are converted to Rec. 709 (convert_to_rec709()).
  bool stored_colors = false;
};

/// Reads PNG, JPEG, TIFF, OpenEXR, Radiance, Targa, BMP, GIF (its first picture), WebP, PSD, DDS,
/// JPEG 2000 and PNM. The format is detected from the content, and from the name only if the
/// content does not show it (image/sniff.h). Errors: kInput for a file that is missing, not an
/// image, truncated or too large (the message names file and reason); kResource if the module is
/// missing.
///
/// The order of channels is R, G, B, A, Z, N.X, N.Y, N.Z, then the rest by name; grey becomes R, G
/// and B. NaN and infinite pixels are kept, because comparisons must see them. The size is that of
/// the display window; pixels outside the data window are 0. The attributes are the string, int and
/// float header entries that do not describe the encoding.
///
/// Numbers of OpenEXR's UINT channels are not scaled. If one exceeds 2^24, which a float would
/// round, the lowest byte of each goes to an additional channel NAME.low, and NAME holds the number
/// without it: their sum is the number. The parts of an OpenEXR file are joined if all are flat and
/// have the same display window. A channel whose name an earlier part has is then called PART.NAME.
/// If several parts have a header entry of the same name, only the first part's entry is kept.
Result<Image> read_image(const std::filesystem::path& path, const ReadImageSettings& settings = {});
/// Decodes an image in memory; `name` is used in messages.
Result<Image> decode_image(const std::string& bytes, const std::string& name,
                           const ReadImageSettings& settings = {});

/// Reads an image as a texture, whose colours are not multiplied by alpha. A file of 8 bits stays
/// codes, unless its channels are not grey or R, G, B, with or without A, or its colours are in
/// ACEScg. Formats and errors are those of read_image(). Other channels follow R, G and B, if the
/// image has these.
Result<Texture> read_texture(const std::filesystem::path& path);
/// Decodes a texture in memory; `name` is used in messages.
Result<Texture> decode_texture(const std::string& bytes, const std::string& name);

struct ExrSettings {
  ColorSpace color_space = ColorSpace::kRec709;  ///< space that the colours are converted to
  /// If true, writes one part per layer: first `rgba` with R, G, B and A, then the other layers in
  /// the order of their names. Channels keep their full names. The first part has all header
  /// entries; a part of a Cryptomatte has the entries of this Cryptomatte. An image of one layer is
  /// written as one part.
  bool multipart = false;
};

/// Encodes all channels: R, G, B, A half (finite values are clamped to half's +-65504), everything
/// else float. Chromaticities and kColorInteropAttribute are those of the settings, not of `image`;
/// the other attributes are written as given. The display window equals the data window, and there
/// is no time stamp: the same image gives the same bytes. Errors: kInternal for an attribute or
/// channel name that occurs twice, is too long or is the encoder's own; kOutput for what OpenEXR
/// cannot store.
Result<std::string> encode_exr(const Image& image, const ExrSettings& settings = {});

/// Trade-off between time and size. kFast: some milliseconds for a 640x480 frame. kSmall: the
/// smallest of several slower encodings, for pictures that are kept (contact sheets).
enum class PngEffort { kFast, kSmall };

struct PngSettings {
  int bits = 8;            ///< 8 or 16
  bool dither = false;     ///< random rounding against banding; never for golden frames
  float exposure = 0;      ///< stops, applied before the curve
  std::uint64_t seed = 0;  ///< seed of the dither: the same seed gives the same bytes
  PngEffort effort = PngEffort::kFast;
};

/// Encodes R, G, B (and A, if the image has it and any pixel is not opaque) with the sRGB curve,
/// tagged sRGB, gAMA and cHRM. Premultiplied colours are divided by alpha, as PNG requires; values
/// are clamped to [0, 1], NaN becomes 0. Errors: kInput if R, G or B is missing.
Result<std::string> encode_png(const Image& image, const PngSettings& settings = {});

/// Encodes an animated, looping GIF with one palette for all frames, from sRGB-encoded R, G, B,
/// dithered with a pattern that does not move. All frames must have one size. Pixels that changed
/// by at most 3/255 since they were last drawn stay unchanged, so that noise does not flicker in
/// still regions. Frame times are rounded to GIF's 1/100 s without accumulating errors; at most 50
/// frames per second. Errors: kInput for no frames, unequal sizes, missing channels, sides over
/// 65535.
Result<std::string> encode_gif(std::span<const Image> frames, float frames_per_second);

/// Writes an EXR or PNG, chosen by the extension of `path`. Errors: kUsage for another extension,
/// kOutput when writing fails.
Status write_image(const std::filesystem::path& path, const Image& image,
                   const PngSettings& png = {}, const ExrSettings& exr = {});

/// Hash of size, channel names and decoded float pixels (not of file bytes).
std::string pixel_digest(const Image& image);
/// Hash of a texture's size, channel names and pixels as they are stored: codes have another digest
/// than floats, though they are the same picture.
std::string pixel_digest(const Texture& texture);

}  // namespace polymorph
