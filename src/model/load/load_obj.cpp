#include "model/load/load_obj.h"

#include "base/file.h"
#include "model/load/build_model.h"
#include "model/load/obj_scan.h"
#include "model/load/textures.h"

namespace polymorph {

Result<LoadedModel> load_obj(const std::filesystem::path& path, const LoadObjSettings& settings) {
  remember_input(path);
  PM_TRY(const std::string bytes, read_file(path, settings.max_bytes));
  PM_TRY(ObjScan scan, scan_obj(bytes, path.string()));
  PM_TRY(const MtlSet mtls, load_mtls(path, scan.libraries, settings.strict));
  LoadedModel loaded;
  loaded.file_points = scan.points;
  loaded.warnings = scan.warnings;
  loaded.warnings.insert(loaded.warnings.end(), mtls.warnings.begin(), mtls.warnings.end());
  PM_TRY(loaded.model, build_model(scan, mtls, path, loaded.warnings));
  if (settings.textures) {
    PM_TRY_STATUS(load_textures(path, scan, mtls, settings.strict, loaded.model, loaded.warnings));
  }
  return loaded;
}

}  // namespace polymorph
