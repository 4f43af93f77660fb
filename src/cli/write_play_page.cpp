#include "cli/write_play_page.h"

#include <algorithm>

#include "base/file.h"
#include "base/plural.h"
#include "base/text.h"
#include "device/device.h"
#include "export/play_data.h"

namespace polymorph {

Status check_play_page(const CommandLine& line, const std::filesystem::path& path) {
  if (path.extension() != ".html")
    return make_error(ErrorCode::kUsage, "{}: unknown page format \"{}\" - use .html",
                      path.string(), path.extension().string());
  return check_output(path, line.common.overwrite);
}

Result<EngineScene> prepare_page(const CommandLine& line, Scene scene) {
  scene.surface.resolution = std::min(scene.surface.resolution, kPlayResolution);
  PM_TRY(EngineScene page,
         prepare_on_engine(scene, resources(line.common), /*pictures=*/0, Sharing::kNone));
  PM_TRY_STATUS(check_has_no_mesh_sequence(page.prepared));
  return page;
}

Status write_play_page(const CommandLine& line, Scene scene, const std::filesystem::path& path) {
  PM_TRY(const EngineScene page_scene, prepare_page(line, std::move(scene)));
  // Check again: now all input files are known, also those that models and materials name.
  PM_TRY_STATUS(check_play_page(line, path));
  PM_TRY(const PlayPage page, make_play_page(page_scene.prepared, *page_scene.engine));
  const std::string html = encode_play_page(page);
  PM_TRY_STATUS(write_file(path, html));
  print_data("{} {}, {} frames, {}\n", path.string(), plural(page.actors.size(), "actor"),
             page_scene.prepared.frame_count, format_bytes(static_cast<double>(html.size())));
  return Ok{};
}

}  // namespace polymorph
