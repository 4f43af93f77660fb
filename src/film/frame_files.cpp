#include "film/frame_files.h"

#include "morph/timeline.h"

namespace polymorph {

Result<FrameFiles> frame_files(const Scene& scene, const std::string& output, bool png,
                               bool is_sequence) {
  PM_TRY(FramePattern pattern, parse_pattern(output.empty() ? scene.output.file : output));
  if (is_sequence) pattern = add_number(pattern);
  // An extension of digits is the frame number, as in "frame.####": the real one is missing.
  const std::string extension = frame_path(pattern, /*frame=*/1).extension().string();
  if (extension.empty() ||
      (extension.size() > 1 && extension.find_first_not_of("0123456789", 1) == std::string::npos))
    return make_error(ErrorCode::kUsage, "{}: has no extension - add .exr or .png", output);
  if (extension != ".exr" && extension != ".png")
    return make_error(ErrorCode::kUsage, "{}: unknown image format \"{}\" - use .exr or .png",
                      frame_path(pattern, /*frame=*/1).string(), extension);
  FrameFiles files;
  if (extension == ".exr") files.exr = pattern;
  if (extension == ".png" || png || scene.output.png) files.png = with_extension(pattern, ".png");
  // Numbers up to `count` do not fit if 10^digits <= count. Multiply the power of 10 digit by
  // digit, and end once it exceeds `count`, before it overflows.
  const int count = frame_count(scene);
  if (pattern.has_number() && count >= 1)
    for (int digits = pattern.digits, power = 1; digits-- > 0 && power <= count; power *= 10)
      if (digits == 0 && power * 10 <= count)
        return make_error(ErrorCode::kUsage, "{} digits are too few for {} frames - write more #",
                          pattern.digits, count);
  return files;
}

ExrSettings exr_settings(const Scene& scene) {
  return {.color_space = scene.output.color_space, .multipart = scene.output.multipart};
}

PngSettings png_settings(const Scene& scene, int frame) {
  PngSettings png;
  png.exposure = scene_at(scene, static_cast<double>(frame)).image.exposure;
  png.bits = scene.output.png_bits;
  png.dither = png.bits == 8;
  // With image.steady the noise is the same in all frames, so the dither must be, too.
  png.seed = scene.image.seed + (scene.image.steady ? 0 : static_cast<std::uint64_t>(frame));
  return png;
}

}  // namespace polymorph
