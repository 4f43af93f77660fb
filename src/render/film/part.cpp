#include "render/film/part.h"

#include <algorithm>
#include <bit>
#include <cstdint>

#include "base/parallel.h"
#include "base/text.h"
#include "image/attributes.h"
#include "kernels/floating_point.h"
#include "render/aov.h"
#include "render/film/film.h"
#include "render/film/smooth.h"
#include "render/math/vector_math.h"

namespace polymorph {
namespace {

constexpr const char* kNodeNames[kNodeChannels] = {"R", "G", "B", "A", "floor", "lit", "unlit"};
constexpr const char* kFirstMatteSuffix = "00.R";  // of the first channel of a matte layer

/// Makes the prefix of the channels of a node, such as "s0-15.".
std::string node_prefix(BlockSpan node, int total) {
  const int first = node.first * kSampleBlock;
  return fmt::format("s{}.", format_samples(first, first + count_samples(node, total)));
}
/// Makes the name of a channel of mattes, such as "s0-15.crypto_object.0.id".
std::string matte_channel(const std::string& prefix, const std::string& layer, std::size_t index,
                          const char* suffix) {
  return fmt::format("{}{}.{}.{}", prefix, layer, index, suffix);
}

/// Reads a node's sums from its channels, in the order of kNodeNames. PixelSum::odd is no channel,
/// because parts exclude adaptive sampling.
PixelSum read_node(const float* pixel, std::span<const int> channels, int samples) {
  const auto at = [&](int i) { return pixel[channels[static_cast<std::size_t>(i)]]; };
  PixelSum sum;
  sum.light = {at(0), at(1), at(2)};
  sum.alpha = at(3);
  sum.floor = at(4);
  sum.lit = at(5);
  sum.unlit = at(6);
  sum.samples = samples;
  return sum;
}

/// Indices of the channels of a part's image that contain the sums of one node.
struct NodeChannels {
  BlockSpan blocks;
  int samples = 0;
  std::vector<int> sums;  ///< channels of kNodeNames
  struct Pair {
    int id = 0, sum = 0;
  };
  /// Per matte layer: the channels of ids and of their sums of coverages, one pair per id.
  std::vector<std::vector<Pair>> mattes;
};

MattePixel read_mattes(const float* pixel, const std::vector<NodeChannels::Pair>& pairs) {
  MattePixel sum;
  for (const NodeChannels::Pair& pair : pairs) sum.add(pixel[pair.id], pixel[pair.sum]);
  return sum;
}

/// Finds the channels of each node of a part. Errors (kInput): a channel is missing.
Result<std::vector<NodeChannels>> find_node_channels(const Part& part,
                                                     const std::vector<std::string>& layers) {
  std::vector<NodeChannels> nodes;
  for (const BlockSpan node : list_nodes(part.samples)) {
    NodeChannels channels{node, count_samples(node, part.samples.total), /*sums=*/{},
                          /*mattes=*/{}};
    const std::string prefix = node_prefix(node, part.samples.total);
    for (const char* name : kNodeNames) {
      const int channel = part.image.find_channel(prefix + name);
      if (channel < 0)
        return make_error(ErrorCode::kInput, "{}: is no whole part: the channel {}{} is missing",
                          part.name, prefix, name);
      channels.sums.push_back(channel);
    }
    for (const std::string& layer : layers) {
      std::vector<NodeChannels::Pair>& pairs = channels.mattes.emplace_back();
      for (std::size_t index = 0;; ++index) {
        const int id = part.image.find_channel(matte_channel(prefix, layer, index, "id")),
                  sum = part.image.find_channel(matte_channel(prefix, layer, index, "sum"));
        if (id < 0 && sum < 0) break;  // the layer has no more ids
        if (id < 0 || sum < 0)
          return make_error(ErrorCode::kInput, "{}: is no whole part: half of {}{}.{} is missing",
                            part.name, prefix, layer, index);
        pairs.push_back({id, sum});
      }
      if (pairs.empty())
        return make_error(ErrorCode::kInput, "{}: is no whole part: the layer {} is missing",
                          part.name, layer);
    }
    nodes.push_back(std::move(channels));
  }
  return nodes;
}

/// Lists the channels that are not sums of samples.
std::vector<std::string> other_channels(const Image& image,
                                        const std::vector<NodeChannels>& nodes) {
  std::vector<bool> is_sum(image.channel_count(), false);
  for (const NodeChannels& node : nodes) {
    for (const int channel : node.sums) is_sum[static_cast<std::size_t>(channel)] = true;
    for (const auto& pairs : node.mattes)
      for (const NodeChannels::Pair& pair : pairs)
        is_sum[static_cast<std::size_t>(pair.id)] = is_sum[static_cast<std::size_t>(pair.sum)] =
            true;
  }
  std::vector<std::string> channels;
  for (std::size_t i = 0; i < is_sum.size(); ++i)
    if (!is_sum[i]) channels.push_back(image.channels[i]);
  return channels;
}

/// Checks that two parts have the same size, colour space and bits in these channels. Errors:
/// kInput.
Status check_equal(const Part& a, const Part& b, const std::vector<std::string>& channels) {
  if (a.image.width != b.image.width || a.image.height != b.image.height)
    return make_error(ErrorCode::kInput, "{} is {} x {} pixels, and {} is {} x {}", a.name,
                      a.image.width, a.image.height, b.name, b.image.width, b.image.height);
  if (merged_exr_settings(a.image).color_space != merged_exr_settings(b.image).color_space)
    return make_error(ErrorCode::kInput, "{} and {} are of pictures in different colour spaces",
                      a.name, b.name);
  const std::size_t pixels =
      static_cast<std::size_t>(a.image.width) * static_cast<std::size_t>(a.image.height);
  for (const std::string& channel : channels) {
    const int in_a = a.image.find_channel(channel), in_b = b.image.find_channel(channel);
    bool equal = in_b >= 0;
    for (std::size_t i = 0; equal && i < pixels; ++i)
      equal = std::bit_cast<std::uint32_t>(
                  a.image.pixels[i * a.image.channel_count() + static_cast<std::size_t>(in_a)]) ==
              std::bit_cast<std::uint32_t>(
                  b.image.pixels[i * b.image.channel_count() + static_cast<std::size_t>(in_b)]);
    if (!equal)
      return make_error(ErrorCode::kInput,
                        "{} and {}: the layer {} differs, so they are not parts of one picture",
                        a.name, b.name, channel);
  }
  return Ok{};
}

/// Merges parts that have been checked into a picture (`is_picture`) or into a larger part.
/// `mattes` gives the layers; for a larger part, run() sets mattes.sums.
class Merger {
 public:
  Merger(std::span<const Part> parts, const std::vector<std::vector<NodeChannels>>& part_nodes,
         const std::vector<std::string>& other_names, MatteSums& mattes, bool is_picture)
      : parts_(parts),
        part_nodes_(part_nodes),
        mattes_(mattes),
        range_{parts.front().samples.first, parts.back().samples.end, parts.front().samples.total},
        is_picture_(is_picture) {
    for (const Part& part : parts) samples_ += part.samples.count();
    std::vector<std::string> channels{"R", "G", "B", "A"};
    if (!is_picture_) channels = list_node_channels(range_);
    first_other_ = channels.size();
    for (const std::string& channel : other_names) {
      other_channels_.push_back(parts.front().image.find_channel(channel));
      channels.push_back(channel);
    }
    if (is_picture_)
      for (const std::string& layer : mattes.layers)
        for (const std::string& channel : list_matte_channels(layer)) channels.push_back(channel);
    const Image& first = parts.front().image;
    film_ = make_image(first.width, first.height, std::move(channels));
    if (!is_picture_)
      mattes.sums.resize(static_cast<std::size_t>(first.width) *
                         static_cast<std::size_t>(first.height) * mattes.layers.size() *
                         list_nodes(range_).size());
  }

  Image run() {
    parallel_for(film_.height, [&](std::int64_t y) {
      const FlushDenormals flush;  // as during rendering, so that the sums have the same bits
      const auto width = static_cast<std::size_t>(film_.width);
      for (std::size_t i = 0; i < width; ++i) merge_pixel(static_cast<std::size_t>(y) * width + i);
    });
    return std::move(film_);
  }

 private:
  const float* find_pixel(std::size_t part, std::size_t i) const {
    const Image& image = parts_[part].image;
    return &image.pixels[i * image.channel_count()];
  }

  void merge_pixel(std::size_t i) {
    // Sums of light: their mean colour, or the larger part's nodes.
    float* pixel = &film_.pixels[i * film_.channel_count()];
    SampleSums<PixelSum> sums;
    for (std::size_t p = 0; p < parts_.size(); ++p)
      for (const NodeChannels& node : part_nodes_[p])
        sums.add({node.blocks, read_node(find_pixel(p, i), node.sums, node.samples)});
    if (is_picture_) {
      write_colors(sums.total(), pixel);
    } else {
      const auto nodes = sums.nodes();
      for (std::size_t n = 0; n < nodes.size(); ++n)
        write_node(nodes[n].sum, pixel + n * kNodeChannels);
    }
    // Channels that do not depend on samples are the same in all parts.
    float* next_channel = pixel + first_other_;
    for (const int channel : other_channels_) *next_channel++ = find_pixel(0, i)[channel];
    // Mattes: ranked coverages, or the larger part's nodes.
    for (std::size_t layer = 0; layer < mattes_.layers.size(); ++layer) {
      SampleSums<MattePixel> matte;
      for (std::size_t p = 0; p < parts_.size(); ++p)
        for (const NodeChannels& node : part_nodes_[p])
          matte.add({node.blocks, read_mattes(find_pixel(p, i), node.mattes[layer])});
      if (is_picture_) {
        const auto rank = matte.total().rank(static_cast<float>(samples_));
        next_channel = std::copy(rank.begin(), rank.end(), next_channel);
        continue;
      }
      const auto nodes = matte.nodes();
      for (std::size_t n = 0; n < nodes.size(); ++n)
        mattes_.sums[(i * mattes_.layers.size() + layer) * nodes.size() + n] = nodes[n].sum;
    }
  }

  std::span<const Part> parts_;
  const std::vector<std::vector<NodeChannels>>& part_nodes_;  ///< per part and node
  MatteSums& mattes_;
  SampleRange range_;
  bool is_picture_ = false;
  int samples_ = 0;                  ///< samples of all parts
  std::size_t first_other_ = 0;      ///< index in the film of the first channel that is no sum
  std::vector<int> other_channels_;  ///< indices in the first part
  Image film_;
};

/// Makes the attributes of the merged image: a picture has none that begin with kPartPrefix, and a
/// larger part has its own range.
std::vector<Attribute> merge_attributes(const Image& first, const SampleRange& range,
                                        bool is_picture) {
  std::vector<Attribute> attributes;
  for (const Attribute& attribute : first.attributes) {
    if (attribute.name == kPartSamplesAttribute && !is_picture)
      attributes.push_back({kPartSamplesAttribute, format_sample_range(range)});
    else if (!attribute.name.starts_with(kPartPrefix) || !is_picture)
      attributes.push_back(attribute);
  }
  return attributes;
}

}  // namespace

ExrSettings merged_exr_settings(const Image& part) {
  ExrSettings settings;
  if (find_text(part, kPartColorSpaceAttribute) ==
      color_space_label(ColorSpace::kAcesCg).interop_id)
    settings.color_space = ColorSpace::kAcesCg;
  settings.multipart = format_entry(part, kPartMultipartAttribute) == "1";
  return settings;
}

void write_colors(const PixelSum& sum, float* pixel) {
  const float n = static_cast<float>(sum.samples);
  // The control variate may leave a pixel slightly below 0.
  const Vec3 light = max(sum.light / n, Vec3{});
  const float shadow = sum.unlit > 0 ? 1 - sum.lit / sum.unlit : 0.0f;
  pixel[0] = light.x;
  pixel[1] = light.y;
  pixel[2] = light.z;
  // Without transparency the samples' alphas are exactly 1, and so is their mean.
  pixel[3] = clamp01((sum.alpha + sum.floor * clamp01(shadow)) / n);
}

void write_node(const PixelSum& sum, float* pixel) {
  for (const float value :
       {sum.light.x, sum.light.y, sum.light.z, sum.alpha, sum.floor, sum.lit, sum.unlit})
    *pixel++ = value;
}

std::vector<std::string> list_node_channels(const SampleRange& range) {
  std::vector<std::string> channels;
  for (const BlockSpan node : list_nodes(range))
    for (const char* name : kNodeNames) channels.push_back(node_prefix(node, range.total) + name);
  return channels;
}

Image append_matte_sums(Image part, const SampleRange& range, const MatteSums& mattes) {
  if (mattes.layers.empty()) return part;
  const std::vector<BlockSpan> nodes = list_nodes(range);
  const std::size_t columns = mattes.layers.size() * nodes.size();  // node's index runs fastest
  std::vector<std::size_t> counts(columns, 1);  // maximum number of ids per layer and node
  for (std::size_t i = 0; i < mattes.sums.size(); ++i)
    counts[i % columns] = std::max(counts[i % columns], mattes.sums[i].sums().size());
  std::vector<std::string> channels = part.channels;
  for (std::size_t c = 0; c < columns; ++c)
    for (std::size_t index = 0; index < counts[c]; ++index)
      for (const char* suffix : {"id", "sum"})
        channels.push_back(matte_channel(node_prefix(nodes[c % nodes.size()], range.total),
                                         mattes.layers[c / nodes.size()], index, suffix));
  Image image = make_image(part.width, part.height, std::move(channels));
  image.attributes = std::move(part.attributes);
  const std::size_t part_channels = part.channel_count(), image_channels = image.channel_count();
  for (std::size_t i = 0; i * image_channels < image.pixels.size(); ++i) {
    float* pixel = std::copy_n(&part.pixels[i * part_channels], part_channels,
                               image.pixels.data() + i * image_channels);
    for (std::size_t c = 0; c < columns; ++c) {
      auto sums = mattes.sums[i * columns + c].sums();
      std::sort(sums.begin(), sums.end());  // by id, so that the order of hits does not matter
      for (std::size_t index = 0; index < sums.size(); ++index) {
        pixel[2 * index] = sums[index].first;
        pixel[2 * index + 1] = sums[index].second;
      }
      pixel += 2 * counts[c];
    }
  }
  return image;
}

Image select_channels(Image film, std::vector<std::string> channels) {
  if (film.channels == channels) return film;
  std::vector<int> sources;
  for (const std::string& channel : channels) sources.push_back(film.find_channel(channel));
  Image image = make_image(film.width, film.height, std::move(channels));
  for (std::size_t i = 0, k = 0; i < image.pixels.size(); k += film.channel_count())
    for (const int channel : sources)
      image.pixels[i++] = film.pixels[k + static_cast<std::size_t>(channel)];
  image.attributes = std::move(film.attributes);
  return image;
}

Result<Image> merge_parts(std::span<const Part> parts, bool is_draft) {
  PM_CHECK(!parts.empty());
  const Part& first = parts.front();
  // The channels of the finished picture name the matte layers, too.
  const std::vector<std::string> channels =
      split(find_text(first.image, kPartChannelsAttribute), ',');
  MatteSums mattes;
  for (const std::string& channel : channels)
    if (channel.starts_with("crypto_") && channel.ends_with(kFirstMatteSuffix))
      mattes.layers.push_back(channel.substr(0, channel.find(kFirstMatteSuffix)));
  // Find the channels of all parts, and check that the parts belong to one picture.
  std::vector<std::vector<NodeChannels>> part_nodes;
  std::vector<std::string> other_names;
  for (const Part& part : parts) {
    PM_TRY(std::vector<NodeChannels> nodes, find_node_channels(part, mattes.layers));
    if (part_nodes.empty()) other_names = other_channels(part.image, nodes);
    part_nodes.push_back(std::move(nodes));
    PM_TRY_STATUS(check_equal(first, part, other_names));
  }
  const SampleRange range{first.samples.first, parts.back().samples.end, first.samples.total};
  const bool is_picture = is_draft || range.is_whole();
  Image film = Merger(parts, part_nodes, other_names, mattes, is_picture).run();
  film.attributes = merge_attributes(first.image, range, is_picture);
  if (!is_picture) return append_matte_sums(std::move(film), range, mattes);
  // Finish the picture: smooth it, and drop the channels that only smoothing needs.
  const bool smooth = format_entry(first.image, kPartSmoothAttribute) == "1";
  std::vector<std::string> needed = channels;
  if (smooth)
    for (std::string& channel : list_film_channels(choose_aovs(kSmoothLayers)))
      needed.push_back(std::move(channel));
  for (const std::string& channel : needed)
    if (film.find_channel(channel) < 0)
      return make_error(ErrorCode::kInput, "{}: is no whole part: the channel {} is missing",
                        first.name, channel);
  if (smooth) smooth_noise(film);
  return select_channels(std::move(film), channels);
}

}  // namespace polymorph
