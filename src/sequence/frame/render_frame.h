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

/// The image attribute that holds PreparedScene::hash.
inline constexpr const char* kHashAttribute = "polymorph/scene_hash";
/// The attribute that holds frame_hash(), the hash of the settings as they are in this frame.
inline constexpr const char* kFrameHashAttribute = "polymorph/frame_hash";
/// The attribute that holds it instead in an image of some of a frame's samples, so that such an
/// image is never mistaken for the frame.
inline constexpr const char* kPartOfAttribute = "polymorph/part_of";
/// The attribute that holds the frame's number.
inline constexpr const char* kFrameAttribute = "polymorph/frame";
/// The attributes that hold FrameOrigin.
inline constexpr const char* kIsaAttribute = "polymorph/isa";
inline constexpr const char* kDeviceAttribute = "polymorph/device";
inline constexpr const char* kCommandAttribute = "polymorph/command";

/// Returns a key that is equal for frames whose pixels are the same to the bit; empty if the frame
/// equals no other.
std::string picture_key(const PreparedScene& prepared, int frame);

/// Checks, before any work, that so many pictures at once fit into `limit` bytes (0: no limit).
/// Errors: kResource, with the bytes needed.
Status check_picture_memory(const ImageSettings& image, std::size_t pictures, std::uint64_t limit,
                            const std::optional<SampleRange>& part = {});

/// Renders one frame in memory. `geometry`: the result of geometry_at().
Result<Image> render_frame(const PreparedScene& prepared, const FrameGeometry& geometry,
                           Renderer& renderer, const std::string& device,
                           const std::string& command);

/// The run of the program that a frame comes from, as its header names it.
struct FrameOrigin {
  std::string isa, device, command;
};

/// A frame, or some of its samples alone (render/film/part.h).
struct FrameShare {
  const FrameGeometry& geometry;
  std::optional<SampleRange> part;  ///< empty: the whole frame
};
/// Renders a share of a frame in memory. The header names the renderer's isa, not the origin's.
Result<Image> render_share(const PreparedScene& prepared, const FrameShare& share,
                           Renderer& renderer, const FrameOrigin& origin);

/// Replaces the image's header by that of this frame, but for the entries by which its mattes are
/// read and a part is merged.
void put_header(const PreparedScene& prepared, int frame, const FrameOrigin& origin, Image& image);

}  // namespace polymorph
