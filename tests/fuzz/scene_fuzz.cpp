// Scene JSON: what reads without findings reads the same after it was written.
#include <cstddef>
#include <cstdint>
#include <string>

#include "base/result.h"
#include "scene/load_scene.h"

using namespace polymorph;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  const auto read = read_scene_text("/fuzz/scene.json", text);
  if (!read || !read->findings.empty()) return 0;
  const std::string written = scene_to_json(read->scene, "/fuzz");
  const auto again = read_scene_text("/fuzz/scene.json", written);
  PM_CHECK(again && again->findings.empty());
  PM_CHECK(scene_to_json(again->scene, "/fuzz") == written);
  return 0;
}
