// Files of balls.
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "base/result.h"
#include "field/balls_io.h"

using namespace polymorph;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto balls = decode_balls(text, "fuzz.json");
  if (!balls) return 0;
  const std::string written = encode_balls(balls->balls, balls->kind);
  encode_balls_csv(balls->balls, balls->kind);
  const auto again = decode_balls(written, "written.json");
  PM_CHECK(again && again->balls.size() == balls->balls.size());
  return 0;
}
