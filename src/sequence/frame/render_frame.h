// Rendering of one frame in memory, with the attributes of its image header.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "base/result.h"
#include "image/image.h"
#include "render/render.h"
#include "render/sample_range.h"
#include "sequence/frame/frame_geometry.h"

namespace polymorph {

/// The image attribute that holds the scene's hash, SequenceHashes::scene.
inline constexpr const char* kHashAttribute = "polymorph/scene_hash";
/// The attribute that holds frame_hash() (sequence/prepare/film_settings.h).
inline constexpr const char* kFrameHashAttribute = "polymorph/frame_hash";
/// The attribute that holds frame_hash() in an image of only some of a frame's samples, so that
/// such an image is never mistaken for the frame.
inline constexpr const char* kPartOfAttribute = "polymorph/part_of";
/// The attribute that holds the frame's number.
inline constexpr const char* kFrameAttribute = "polymorph/frame";
/// The attributes that hold FrameOrigin.
inline constexpr const char* kIsaAttribute = "polymorph/isa";
inline constexpr const char* kDeviceAttribute = "polymorph/device";
inline constexpr const char* kCommandAttribute = "polymorph/command";

/// Returns a key that is equal only for frames with bit-identical pixels; empty if every other
/// frame may have different pixels.
std::string picture_key(const PreparedScene& prepared, int frame);

/// Checks that `pictures` rendered frames at once fit into `limit` bytes (0: no limit). `part`:
/// samples that each picture has; empty: all. Errors: kResource, with the bytes needed.
Status check_picture_memory(const ImageSettings& image, std::size_t pictures, std::uint64_t limit,
                            const std::optional<SampleRange>& part = {});

/// Renders one whole frame in memory. `geometry`: the result of geometry_at(); `device` and
/// `command`: members of FrameOrigin.
Result<Image> render_frame(const PreparedScene& prepared, const FrameGeometry& geometry,
                           Renderer& renderer, const std::string& device,
                           const std::string& command);

/// The run of the program that made a frame, as stated in the frame's header.
struct FrameOrigin {
  std::string isa;      ///< instruction set of the renderer
  std::string device;   ///< device of the engine
  std::string command;  ///< command line
};

/// A frame, or only some of its samples (render/film/part.h).
struct FrameSamples {
  const FrameGeometry& geometry;
  std::optional<SampleRange> part;  ///< empty: the whole frame
};
/// Renders samples of a frame in memory. The header has renderer.isa() in place of origin.isa.
Result<Image> render_samples(const PreparedScene& prepared, const FrameSamples& samples,
                             Renderer& renderer, const FrameOrigin& origin);

/// Replaces the image's header by the header of this frame. Entries that describe Cryptomatte
/// layers, and those that are needed to merge a part, are kept.
void put_header(const PreparedScene& prepared, int frame, const FrameOrigin& origin, Image& image);

}  // namespace polymorph
