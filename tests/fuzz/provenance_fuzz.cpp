// Provenance of headers, as it stands there and as the JSON within: no name leaves its folder.
#include <cstddef>
#include <cstdint>
#include <string>

#include "base/packed_text.h"
#include "base/result.h"
#include "scene/load_scene.h"
#include "scene/provenance.h"

using namespace polymorph;

namespace {

void check(const std::string& packed) {
  const auto read = decode_provenance(packed);
  if (!read) return;
  for (const InputFile& file : read->files) PM_CHECK(is_safe_name(file.name));
  (void)compare_inputs(read->files, read->files);
  if (read->scene.empty()) return;
  const auto scene = read_scene_text("/fuzz/frame.exr", read->scene);
  if (!scene) return;
  const auto is_below = [](const std::filesystem::path& path) {
    return path.empty() || path.lexically_normal().string().starts_with("/fuzz/");
  };
  for (const ActorSettings& actor : scene->scene.actors) {
    PM_CHECK(is_below(actor.source.model) && is_below(actor.target.model));
    for (const ObjectSettings& object : actor.intermediate) PM_CHECK(is_below(object.model));
  }
  PM_CHECK(is_below(scene->scene.lights.environment));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  check(text);
  check(pack_text(text));
  return 0;
}
