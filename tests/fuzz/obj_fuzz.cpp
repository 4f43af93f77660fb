// OBJ and MTL text: what the scan lets through, the loader takes.
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "base/log.h"
#include "base/result.h"
#include "model/load/build_model.h"
#include "model/repair/diagnose.h"

using namespace polymorph;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  const auto library = parse_mtl(bytes, "fuzz.mtl");
  auto scan = scan_obj(bytes, "fuzz.obj");
  if (!scan) return 0;
  std::vector<std::string> warnings;
  const auto model = build_model(*scan, library ? *library : MtlSet{}, "fuzz.obj", warnings);
  if (!model) return 0;
  for (const Triangle& t : model->triangles)
    for (const std::uint32_t v : t.v) PM_CHECK(v < model->points.size());
  PM_CHECK(model->corner_normals.size() == 3 * model->triangles.size());
  describe_problems(diagnose(*model));
  return 0;
}
