#include "model/load/load_obj.h"

#include "base/file.h"
#include "base/memory.h"
#include "base/text.h"
#include "model/load/build_model.h"
#include "model/load/import_process.h"
#include "model/load/obj_scan.h"
#include "model/load/textures.h"

namespace polymorph {
namespace {

/// Checks that a model of `bytes` bytes of text fits into the remaining memory. Small files are not
/// checked.
Status check_text_memory(const std::filesystem::path& path, std::size_t bytes) {
  constexpr std::size_t kMinChecked = 1 << 20;  // bytes
  if (bytes < kMinChecked) return Ok{};
  const double needed = kModelBytesPerTextByte * static_cast<double>(bytes);
  const auto available = static_cast<double>(remaining_memory());
  if (needed <= available) return Ok{};
  return make_error(ErrorCode::kResource,
                    "{}: the model needs about {} of memory, and the limit leaves {} - use a "
                    "smaller model or raise --max-memory",
                    path.string(), format_bytes(needed), format_bytes(available));
}

}  // namespace

Result<LoadedModel> load_obj(const std::filesystem::path& path, const LoadObjSettings& settings) {
  remember_input(path);
  PM_TRY(const std::string bytes, read_file(path, settings.max_bytes));
  PM_TRY_STATUS(check_text_memory(path, bytes.size()));
  PM_TRY(ObjScan scan, scan_obj(bytes, path.string()));
  PM_TRY(const MtlSet mtls, load_mtls(path, scan.libraries, settings.strict));
  LoadedModel loaded;
  loaded.file_points = scan.point_count();
  loaded.warnings = scan.warnings;
  loaded.warnings.insert(loaded.warnings.end(), mtls.warnings.begin(), mtls.warnings.end());
  PM_TRY(loaded.model, build_model(scan, mtls, path, loaded.warnings,
                                   settings.vertices ? &loaded.vertices : nullptr));
  if (settings.textures) {
    PM_TRY_STATUS(load_textures({path, scan, mtls, /*embedded=*/{}}, settings.strict, loaded.model,
                                loaded.warnings));
  }
  return loaded;
}

}  // namespace polymorph
