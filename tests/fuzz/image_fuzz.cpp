// Pictures: PNG, EXR, and what tells formats apart; then what is done with them.
#include <cstddef>
#include <cstdint>
#include <string>

#include "base/result.h"
#include "compare/compare.h"
#include "image/image_io.h"

using namespace polymorph;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  ReadImageSettings settings;
  settings.max_bytes = std::size_t{1} << 22;
  const auto image = decode_image({reinterpret_cast<const char*>(data), size}, "fuzz", settings);
  if (!image) return 0;
  PM_CHECK(image->pixels.size() * sizeof(float) <= settings.max_bytes);
  const Comparison same = compare_images(*image, *image, zero_tolerance());
  PM_CHECK(same.verdict == Verdict::kSame || same.not_finite_pixels > 0 ||
           same.negative_alpha_pixels > 0);
  const auto png = encode_png(*image);
  if (png) PM_CHECK(decode_image(*png, "written"));
  const auto exr = encode_exr(*image);
  if (exr) PM_CHECK(decode_image(*exr, "written"));
  return 0;
}
