// Films in memory: the frames of a scene, contact sheets of them and animated GIFs.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"
#include "film/render_sequence.h"
#include "image/image.h"
#include "scene/scene.h"
#include "sequence/prepare/engine_scene.h"

namespace polymorph {

/// Frames of a sequence as pictures, with the exposure applied.
struct Film {
  std::vector<int> numbers;  ///< frame numbers, one per image, in order of display
  std::vector<Image> images;
  float fps = 12;
  int first = 1, last = 1;  ///< first and last frame of the whole sequence, where t is 0 and 1
};

/// Settings of a contact sheet: frames side by side.
struct SheetSettings {
  int count = 8;                ///< number of cells, unless `all` is set
  bool all = false;             ///< every frame of the film is a cell
  bool by_change = false;       ///< choose_by_change() instead of choose_evenly()
  int columns = 4;              ///< cells per row
  int cell_width = 0;           ///< pixels; 0: as rendered
  std::string label = "frame";  ///< text below each cell: "frame" (number), "t" (time) or "none"
};

/// Chooses n of the numbers at equal distances, the first and last included; the middle one if n is
/// 1, all if there are no more than n.
std::vector<int> choose_evenly(const std::vector<int>& numbers, int n);

/// Chooses at most n of the film's frames, the first and last included, so that the differences of
/// successive ones are about equal. The difference of two frames is the sum, over all steps from
/// the one to the other, of the absolute differences of the pixels. If n is 1 or no pixel changes,
/// it chooses as choose_evenly().
std::vector<int> choose_by_change(const Film& film, int n);

/// Multiplies R, G and B by 2^stops.
void expose(Image& image, float stops);

/// Copies R, G, B and A without other channels, scaled to `width` pixels (0: unscaled), so that a
/// long sequence fits in memory.
Image resized_colors(const Image& image, int width);

/// Prepares a scene for pictures without AOVs. Errors: those of prepare_on_engine(); kResource if
/// the pictures need too much memory.
Result<EngineScene> prepare_film(Scene scene, const Resources& resources);

/// Content of the pictures: the scene, or its surfaces in colours that show which part of one
/// object becomes which part of the other (sequence/frame/paint_origins.h).
enum class FilmContent { kScene, kPlan };

/// Checks that all actors have plans. Errors (kInput): an actor plays a mesh sequence.
Status check_has_plans(const PreparedScene& prepared);

struct FilmSettings {
  int width = 0;  ///< pixels; 0: as in the scene
  FilmContent content = FilmContent::kScene;
  ProgressCallback progress;  ///< called after each frame; may be empty
};

/// Renders the frames `numbers` of the scene. Makes the surface of a frame while the previous frame
/// is traced. Of successive equal frames only the first is traced. Errors: those of geometry_at()
/// and render_frame(); stop_code() after a signal.
Result<Film> render_film(const EngineScene& film_scene, std::vector<int> numbers,
                         const FilmSettings& settings);

/// Checks before any work that the sheet is a .png or .exr file that may be written. Errors:
/// kUsage, kOutput.
Status check_sheet(const std::filesystem::path& path, bool overwrite);

/// Writes a contact sheet (.png or .exr) of the film.
Status write_sheet(const std::filesystem::path& path, const Film& film,
                   const SheetSettings& settings);

/// Writes the film as an animated GIF with `fps` frames per second (0: those of the film).
Status write_gif(const std::filesystem::path& path, const Film& film, float fps = 0);

}  // namespace polymorph
