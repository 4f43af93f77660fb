// Files of balls.
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "base/result.h"
#include "surface/balls_io.h"

using namespace polymorph;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::string field = "gaussian";
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto balls = decode_balls(text, "fuzz.json", field);
  if (!balls) return 0;
  const std::string written = encode_balls(*balls, FieldKind::kGaussian);
  encode_balls_csv(*balls, FieldKind::kGaussian);
  const auto again = decode_balls(written, "written.json", field);
  PM_CHECK(again && again->size() == balls->size());
  return 0;
}
