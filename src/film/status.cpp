#include "film/status.h"

#include <algorithm>
#include <array>
#include <fstream>

#include "assets/content_hash.h"
#include "assets/load_models.h"
#include "base/parallel.h"
#include "image/attributes.h"
#include "image/image_io.h"
#include "render/film/part.h"
#include "sequence/frame/render_frame.h"
#include "sequence/prepare/film_settings.h"

namespace polymorph {
namespace {

/// Reads the bits per channel from a PNG's header. Returns 0 if the file is no PNG.
int read_png_bits(const std::filesystem::path& file) {
  constexpr std::string_view kSignature = "\x89PNG\r\n\x1a\n";
  // Byte of the bit depth, after signature (8 bytes), length, type, width and height (4 each).
  constexpr std::size_t kBits = 24;
  std::array<char, kBits + 1> head{};
  std::ifstream in(file, std::ios::binary);
  in.read(head.data(), head.size());
  return std::string_view(head.data(), head.size()).starts_with(kSignature) ? head[kBits] : 0;
}

/// Tests whether an EXR has the colour space and multipart layout of `expected.output`. A file with
/// some of the samples has both as attributes (merged_exr_settings()). Any other picture is
/// multipart only if it has layers.
bool has_output_settings(const Image& image, const ExpectedFrame& expected) {
  const ColorSpace space = expected.output.color_space;
  if (expected.part) {
    const ExrSettings merged = merged_exr_settings(image);
    return merged.color_space == space && merged.multipart == expected.output.multipart;
  }
  const bool has_layers =
      std::any_of(image.channels.begin(), image.channels.end(), [](const std::string& name) {
        return name != "R" && name != "G" && name != "B" && name != "A";
      });
  const bool is_multipart = std::any_of(
      image.attributes.begin(), image.attributes.end(),
      [](const Attribute& attribute) { return attribute.name.starts_with(kPartAttribute); });
  return color_space_name(image) == color_space_label(space).interop_id &&
         is_multipart == (expected.output.multipart && has_layers);
}

}  // namespace

Result<std::string> source_hash(const Scene& scene) {
  const std::vector<ChainObject> chain = chain_objects(scene);
  PM_TRY(const LoadedScene loaded, load_models(scene, chain, /*textures=*/true));
  PM_TRY(const std::shared_ptr<const Image> environment, load_environment(scene));
  return content_hash(
      {scene, chain, loaded.models, environment.get(), loaded.placements, loaded.sequences},
      /*program=*/"");
}

Result<ExpectedHashes> expected_hashes(const Scene& scene, std::span<const int> frames) {
  if (const std::string problem = find_turntable_problem(scene); !problem.empty())
    return make_error(ErrorCode::kInput, "{}: {}", scene.path.string(), problem);
  const std::vector<ChainObject> chain = chain_objects(scene);
  PM_TRY(const LoadedScene loaded, load_models(scene, chain, /*textures=*/true));
  PM_TRY(const std::shared_ptr<const Image> environment, load_environment(scene));
  const SequenceHashes hashes = hash_sequence(
      {scene, chain, loaded.models, environment.get(), loaded.placements, loaded.sequences});
  ExpectedHashes expected{hashes.scene, std::vector<std::string>(frames.size()), scene.output,
                          /*view=*/{}};
  parallel_for(static_cast<std::int64_t>(frames.size()), [&](std::int64_t i) {
    const auto index = static_cast<std::size_t>(i);
    expected.frames[index] = frame_hash(scene, hashes, frames[index]);
  });
  return expected;
}

FileState file_state(const std::filesystem::path& file, const ExpectedFrame& expected) {
  std::error_code error;
  if (!std::filesystem::exists(file, error)) return FileState::kMissing;
  const auto image = read_image(file, {.stored_colors = true});
  if (!image) return FileState::kUnreadable;
  // Entries are compared as text, because EXR stores the frame as a number and PNG as text.
  const auto has_entry = [&](const char* name, const std::string& value) {
    return format_entry(*image, name) == value;
  };
  const int bits = read_png_bits(file);
  if (bits != 0 && (bits != expected.output.png_bits ||
                    find_text(*image, kViewAttribute) != view_text(expected.view)))
    return FileState::kStale;
  if (bits == 0 && !has_output_settings(*image, expected)) return FileState::kStale;
  const bool matches =
      expected.part ? has_entry(kPartOfAttribute, expected.hash) &&
                          has_entry(kPartSamplesAttribute, format_sample_range(*expected.part))
                    : has_entry(kFrameHashAttribute, expected.hash);
  if (!has_entry(kFrameAttribute, fmt::format("{}", expected.frame))) return FileState::kStale;
  if (matches) return FileState::kCurrent;
  return has_entry(kPartOfAttribute, expected.hash) ? FileState::kPart : FileState::kStale;
}

std::vector<FileState> frame_states(const FrameFiles& files, std::span<const int> frames,
                                    const ExpectedHashes& expected) {
  std::vector<FileState> states(frames.size());  // all kCurrent, the first enumerator
  parallel_for(static_cast<std::int64_t>(frames.size()), [&](std::int64_t i) {
    const auto index = static_cast<std::size_t>(i);
    for (const FramePattern* pattern : {&files.exr, &files.png}) {
      if (pattern->empty()) continue;
      const FileState state = file_state(
          frame_path(*pattern, frames[index]),
          {expected.frames[index], frames[index], expected.output, expected.view, std::nullopt});
      if (state != FileState::kCurrent) states[index] = state;
    }
  });
  return states;
}

std::string format_frame_list(std::span<const int> frames) {
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
