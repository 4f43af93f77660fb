#include "sequence/status.h"

#include <algorithm>
#include <optional>
#include <variant>

#include "base/parallel.h"
#include "image/image_io.h"
#include "sequence/content_hash.h"
#include "sequence/prepare.h"
#include "sequence/render_frame.h"

namespace polymorph {

Result<std::string> sequence_hash(const Scene& scene, std::string_view program) {
  PM_TRY(const LoadedScene loaded, load_models(scene, /*textures=*/true));
  std::optional<Image> environment;
  if (!scene.lights.environment.empty()) {
    PM_TRY(environment, read_image(scene.lights.environment));
  }
  return content_hash(scene, loaded.models, environment ? &*environment : nullptr, program);
}

FileState file_state(const std::filesystem::path& file, const std::string& hash, int frame) {
  std::error_code error;
  if (!std::filesystem::exists(file, error)) return FileState::kMissing;
  const auto image = read_image(file);
  if (!image) return FileState::kUnreadable;
  // EXR keeps the frame as a number, PNG as text.
  const auto says = [&](const char* name, const std::string& wanted) {
    return std::any_of(image->attributes.begin(), image->attributes.end(), [&](const Attribute& a) {
      return a.name == name &&
             std::visit([](const auto& v) { return fmt::format("{}", v); }, a.value) == wanted;
    });
  };
  return (says(kHashAttribute, hash) || says(kFrameHashAttribute, hash)) &&
                 says(kFrameAttribute, fmt::format("{}", frame))
             ? FileState::kWhole
             : FileState::kStale;
}

std::vector<FileState> file_states(const FramePattern& pattern, std::span<const int> frames,
                                   const std::string& hash) {
  std::vector<FileState> states(frames.size());
  parallel_for(static_cast<std::int64_t>(frames.size()), [&](std::int64_t i) {
    const auto at = static_cast<std::size_t>(i);
    states[at] = file_state(frame_path(pattern, frames[at]), hash, frames[at]);
  });
  return states;
}

std::string frame_list(std::span<const int> frames) {
  std::string out;
  for (std::size_t i = 0; i < frames.size();) {
    std::size_t end = i + 1;
    while (end < frames.size() && frames[end] == frames[end - 1] + 1) ++end;
    out += fmt::format("{}{}", out.empty() ? "" : ",", frames[i]);
    if (end - i > 1) out += fmt::format("-{}", frames[end - 1]);
    i = end;
  }
  return out;
}

}  // namespace polymorph
