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
/// The one that holds frame_hash(): of the settings as this frame has them.
inline constexpr const char* kFrameHashAttribute = "polymorph/frame_hash";
/// A part of a frame has it here instead, so that no part is taken for the frame.
inline constexpr const char* kPartOfAttribute = "polymorph/part_of";
/// And the one that holds the frame's number.
inline constexpr const char* kFrameAttribute = "polymorph/frame";
/// And those that hold FrameOrigin.
inline constexpr const char* kIsaAttribute = "polymorph/isa";
inline constexpr const char* kDeviceAttribute = "polymorph/device";
inline constexpr const char* kCommandAttribute = "polymorph/command";

/// Equal for frames that show the same to the bit; empty: the frame is like no other.
std::string picture_key(const PreparedScene& prepared, int frame);

/// Is there room for so many pictures at once in `limit` bytes (0: no limit)? Asked before any
/// work. Errors: kResource, with what they need.
Status check_picture_memory(const ImageSettings& image, std::size_t pictures, std::uint64_t limit,
                            const std::optional<SampleRange>& part = {});

/// One frame in memory: `geometry` as geometry_at() gave it.
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
/// Renders a share of a frame in memory. The origin's isa is ignored for the renderer's.
Result<Image> render_share(const PreparedScene& prepared, const FrameShare& share,
                           Renderer& renderer, const FrameOrigin& origin);

/// Replaces the image's header by that of this frame, but for the entries by which its mattes are
/// read and a part is merged.
void put_header(const PreparedScene& prepared, int frame, const FrameOrigin& origin, Image& image);

}  // namespace polymorph
