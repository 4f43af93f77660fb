// Films in memory: the frames of a scene, contact sheets of them and animated GIFs.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "cli/command_line.h"
#include "image/image.h"
#include "kernels/engine.h"
#include "scene/scene.h"
#include "sequence/prepare/prepared_scene.h"

namespace polymorph {

/// Pictures of a sequence, exposed and ready to be shown.
struct Film {
  std::vector<int> numbers;  ///< frame numbers, in the order to show them
  std::vector<Image> images;
  float fps = 12;
  int first = 1, last = 1;  ///< ends of the whole sequence, for labels in t
};

struct SheetSettings {
  int count = 8;           ///< cells, evenly spread over the film
  bool all = false;        ///< every frame of the film is a cell
  bool by_change = false;  ///< choose_by_change() instead of evenly
  int columns = 4;
  int cell_width = 0;           ///< pixels; 0 = as rendered
  std::string label = "frame";  ///< frame, t or none
};

/// n of the numbers, evenly spread, first and last included.
std::vector<int> choose_evenly(const std::vector<int>& numbers, int n);

/// Chooses at most n of the film's frames, first and last included, so that the picture changes by
/// about as much from each to the next (the sum of the pixels' differences): where an easing
/// lingers, one is enough.
std::vector<int> choose_by_change(const Film& film, int n);

/// Brightens R, G, B by `stops`.
void expose(Image& image, float stops);

/// R, G, B and A alone, scaled to `width` (0 = as they are): what a long sequence may hold in
/// memory.
Image resized_colors(const Image& image, int width);

/// A scene made ready for pictures without layers, with what surfaces are asked of.
struct FilmScene {
  std::unique_ptr<Engine> engine;
  std::string device;  ///< name of the engine's device
  PreparedScene prepared;
};

/// Prepares a scene for pictures and logs its warnings. Errors: those of make_engine() and
/// prepare_scene(); kResource where the pictures need too much memory.
Result<FilmScene> prepare_film(const CommandLine& line, Scene scene);

/// Content of pictures: the scene, or colours of what becomes what
/// (sequence/frame/paint_origins.h).
enum class FilmContent { kScene, kPlan };

/// Tests whether all actors morph: meshes that are played have no plan. Errors: kInput.
Status check_has_plans(const PreparedScene& prepared);

/// Renders these frames of the scene, each `width` pixels wide (0 = as the scene says), with
/// progress. The surface of a frame is made while the one before is traced, and frames that show
/// the same are traced once. Errors: those of geometry_at() and render_frame(); the signal's code
/// when stopped.
Result<Film> render_film(const CommandLine& line, const FilmScene& ready, std::vector<int> numbers,
                         int width, FilmContent content = FilmContent::kScene);

/// Before any work: is it a .png or .exr file that may be written? Errors: kUsage, kOutput.
Status check_sheet(const std::filesystem::path& path, bool overwrite);

/// Writes a contact sheet (.png or .exr) of the film.
Status write_sheet(const std::filesystem::path& path, const Film& film,
                   const SheetSettings& settings);

/// Writes the film as an animated GIF; `fps` 0 = its own.
Status write_gif(const std::filesystem::path& path, const Film& film, float fps = 0);

}  // namespace polymorph
