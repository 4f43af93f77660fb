#include "golden/golden_masks.h"

#include <algorithm>
#include <cmath>

#include "image/image_io.h"

namespace polymorph {
namespace {

using MaskedPixels = std::vector<char>;  ///< per pixel: 1 if it is masked, else 0

/// Masks the pixels where the mask's picture is not black. Errors: kInput.
Status add_picture(const GoldenMask& mask, const Image& reference, MaskedPixels& is_masked) {
  PM_TRY(const Image picture, read_image(mask.file, {.single_picture = true}));
  if (picture.width != reference.width || picture.height != reference.height)
    return make_error(ErrorCode::kInput, "{}: {} x {} pixels, the frames have {} x {}",
                      mask.file.string(), picture.width, picture.height, reference.width,
                      reference.height);
  for (std::size_t c = 0; c < picture.channel_count(); ++c) {
    if (picture.channels[c] == "A") continue;
    for (std::size_t i = 0; i < is_masked.size(); ++i)
      is_masked[i] = is_masked[i] || picture.pixels[i * picture.channel_count() + c] > 0;
  }
  return Ok{};
}

/// Masks the pixels where `image` shows one of the mask's objects.
void add_objects(const GoldenMask& mask, const Image& image, MaskedPixels& is_masked) {
  const auto id_channel = static_cast<std::size_t>(image.find_channel("id"));
  for (std::size_t i = 0; i < is_masked.size(); ++i) {
    const float shown_id = image.pixels[i * image.channel_count() + id_channel];
    is_masked[i] = is_masked[i] || std::any_of(mask.ids.begin(), mask.ids.end(), [&](int id) {
                     return shown_id == static_cast<float>(id);
                   });
  }
}

/// Tests whether a pixel with these `masked_count` values fails whatever the tolerance is. `alpha`
/// is the index of channel A, or -1 if there is none.
bool is_invalid(const float* values, std::size_t masked_count, int alpha) {
  return (alpha >= 0 && values[alpha] < 0) ||
         std::any_of(values, values + masked_count, [](float v) { return !std::isfinite(v); });
}

}  // namespace

Result<double> replace_masked_pixels(const GoldenSuite& suite, const Image& reference,
                                     Image& actual) {
  if (suite.masks.empty() || actual.width != reference.width || actual.height != reference.height ||
      actual.channels != reference.channels || reference.pixels.empty())
    return 0.0;
  const std::size_t channels = reference.channel_count();
  MaskedPixels is_masked(reference.pixels.size() / channels);
  for (const GoldenMask& mask : suite.masks) {
    if (!mask.file.empty()) {
      PM_TRY_STATUS(add_picture(mask, reference, is_masked));
      continue;
    }
    if (reference.find_channel("id") < 0)
      return make_error(ErrorCode::kInput, "{}: a mask by ids, but the frames have no layer 'id'",
                        (suite.folder / "suite.json").string());
    add_objects(mask, reference, is_masked);
    add_objects(mask, actual, is_masked);
  }
  // Count the masked pixels, and copy the reference to those that are valid.
  const int alpha = actual.find_channel("A");
  std::size_t masked_count = 0;
  for (std::size_t i = 0; i < is_masked.size(); ++i) {
    if (!is_masked[i]) continue;
    ++masked_count;
    float* const values = &actual.pixels[i * channels];
    if (!is_invalid(values, channels, alpha))
      std::copy_n(&reference.pixels[i * channels], channels, values);
  }
  return 100.0 * static_cast<double>(masked_count) / static_cast<double>(is_masked.size());
}

}  // namespace polymorph
