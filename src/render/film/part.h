// Parts of a picture: images whose channels are sums over a range of the picture's samples. Merging
// all parts gives the same bits as rendering the picture at once.
//
// For each node of the sums of its samples (sample_sums.h) a part has the channels "s0-15.R", ".G",
// ".B", ".A", ".floor", ".lit" and ".unlit" (PixelSum), and for each id of a matte the pair
// "s0-15.crypto_object.0.id" and ".sum". A part's other layers do not depend on the samples and
// equal those of the picture.
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

/// Prefix of the header attributes that merging needs.
inline constexpr const char* kPartPrefix = "polymorph/part/";
/// The part's range of samples, as format_sample_range() writes it.
inline constexpr const char* kPartSamplesAttribute = "polymorph/part/samples";
/// The channels of the merged picture, in order, separated by commas.
inline constexpr const char* kPartChannelsAttribute = "polymorph/part/channels";
/// Int attribute: 1 if the merged picture is smoothed (film/smooth.h).
inline constexpr const char* kPartSmoothAttribute = "polymorph/part/smooth";
/// Colour space of the merged picture (a value of kColorInteropAttribute) if it is not Rec. 709.
/// The colours of a part are always in Rec. 709.
inline constexpr const char* kPartColorSpaceAttribute = "polymorph/part/colorspace";
/// Int attribute: 1 if the merged picture's file has an EXR part per layer
/// (ExrSettings::multipart).
inline constexpr const char* kPartMultipartAttribute = "polymorph/part/multipart";

/// Returns the file settings of the picture to which a part is merged.
ExrSettings merged_exr_settings(const Image& part);

/// Number of channels per node, without mattes.
inline constexpr int kNodeChannels = 7;

/// Computes R, G, B, A of a pixel from the sums of its samples, and writes them to pixel[0...3].
void write_colors(const PixelSum& sum, float* pixel);
/// Writes the kNodeChannels channels of a node, from pixel[0] on.
void write_node(const PixelSum& sum, float* pixel);

/// Lists the channels of all nodes of a range, without mattes.
std::vector<std::string> list_node_channels(const SampleRange& range);

/// Matte sums of a part.
struct MatteSums {
  std::vector<std::string> layers;  ///< names, such as "crypto_object"
  /// One entry per pixel (in rows), layer and node. The node's index runs fastest.
  std::vector<MattePixel> sums;
};
/// Appends the channels of the mattes. Each layer and node gets channels for as many ids as the
/// pixel with the most ids has.
Image append_matte_sums(Image part, const SampleRange& range, const MatteSums& mattes);

/// Returns an image with only these channels of `film`, in this order. `film` must have them all.
Image select_channels(Image film, std::vector<std::string> channels);

/// A part that has been read from a file.
struct Part {
  std::string name;  ///< name in messages
  SampleRange samples;
  Image image;
};

/// Merges parts of one picture, which come in ascending order. The result is the picture if the
/// parts have all of its samples, or if `is_draft`; otherwise it is a larger part. A draft is a
/// picture of the parts that there are, so samples may be missing between them; otherwise none may.
/// The result has the attributes of the first part; a picture lacks those that begin with
/// kPartPrefix.
/// Errors (kInput): a channel is missing; sizes, colour spaces or layers differ.
Result<Image> merge_parts(std::span<const Part> parts, bool is_draft = false);

}  // namespace polymorph
