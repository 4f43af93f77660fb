// Parts of a picture: its sums over a range of its samples, as channels of an image, and the
// picture that parts add up to. All of them give the same bits as the picture rendered at once.
//
// A part has, for each node of its samples' sums (sample_sums.h), the channels "s0-15.R", ".G",
// ".B", ".A", ".floor", ".lit" and ".unlit", and for each id of a matte a pair
// "s0-15.crypto_object.0.id" and ".sum". The other layers are the picture's own: they do not depend
// on samples.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "base/result.h"
#include "image/image.h"
#include "image/image_io.h"
#include "render/film/cryptomatte.h"
#include "render/film/pixel_sum.h"
#include "render/film/sample_sums.h"
#include "render/sample_range.h"

namespace polymorph {

/// Beginning of the names of the header entries by which a part is merged.
inline constexpr const char* kPartPrefix = "polymorph/part/";
inline constexpr const char* kPartSamplesAttribute = "polymorph/part/samples";  ///< "0-15/64"
/// The channels of the merged picture, in order, separated by commas.
inline constexpr const char* kPartChannelsAttribute = "polymorph/part/channels";
inline constexpr const char* kPartSmoothAttribute =
    "polymorph/part/smooth";  ///< int: 1 if the merged picture is smoothed (film/smooth.h)
/// The space of the merged picture's colours (kColorInteropAttribute's values), if it is not Rec.
/// 709; a part's own are always in Rec. 709.
inline constexpr const char* kPartColorSpaceAttribute = "polymorph/part/colorspace";

/// int: 1 if the file of the merged picture has a part for each layer (ExrSettings::multipart).
inline constexpr const char* kPartMultipartAttribute = "polymorph/part/multipart";

/// Settings of the file of the picture that a part is merged to.
ExrSettings merged_exr_settings(const Image& part);

/// Number of channels of a node, without its mattes.
inline constexpr int kNodeChannels = 7;

/// Writes R, G, B, A of a pixel whose samples have been summed.
void write_colors(const PixelSum& sum, float* pixel);
/// Writes the kNodeChannels channels of a node.
void write_node(const PixelSum& sum, float* pixel);

/// Lists the channels of all nodes of a range, without mattes.
std::vector<std::string> list_node_channels(const SampleRange& range);

/// Matte sums of a part, indexed by pixel, layer and node.
struct MatteSums {
  std::vector<std::string> layers;  ///< "crypto_object"
  std::vector<MattePixel> sums;
};
/// Appends the channels of the mattes: as many ids as the pixel with the most has.
Image append_matte_sums(Image part, const SampleRange& range, const MatteSums& mattes);

/// Returns the image with these of its channels, in this order.
Image select_channels(Image film, std::vector<std::string> channels);

/// A part as it was read.
struct Part {
  std::string name;  ///< name in messages
  SampleRange samples;
  Image image;
};

/// Merges parts of one picture that follow each other, in ascending order: to the picture if they
/// are all of it, else to a larger part. A draft is a picture of any of its samples. It has the
/// attributes of the first, without those of kPartPrefix where it is a picture. Errors (kInput): a
/// channel is missing, sizes or layers differ.
Result<Image> merge_parts(std::span<const Part> parts, bool is_draft = false);

}  // namespace polymorph
