// Golden image suites on disk: golden_frames/SUITE/{suite.json, tolerance.json, surface.csv,
// frame.####.exr, CHANGES.md}.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"
#include "compare/compare.h"

namespace polymorph {

/// A row of surface.csv: counts and digest that the surface of a frame must have.
struct SurfaceRecord {
  int frame = 0;
  std::size_t vertices = 0, triangles = 0;
  std::string digest;  ///< mesh_digest() (mesh/mesh_check.h); "" = unknown
};

/// Pixels that are not compared: those where the picture `file` is not black, or those of the
/// objects `ids` in the golden or in the new frame.
struct GoldenMask {
  std::filesystem::path file;  ///< empty = mask by ids
  std::vector<int> ids;
  std::string why;  ///< the reason for the mask
};

struct GoldenSuite {
  std::string name;
  std::filesystem::path folder;
  std::filesystem::path scene;  ///< path in suite.json, resolved against `folder`; or empty
  std::string command;          ///< shell command of another program, in place of a scene; or ""
  std::string format = "exr";   ///< extension of the frames; other than "exr" only with a command
  std::vector<int> frames;      ///< frames with a golden image, ascending
  Tolerance tolerance;          ///< `why` contains the reasons for all limits
  std::vector<GoldenMask> masks;
  double max_masked_percent = 0;  ///< largest percentage of pixels that masks may cover
};

/// Reads `root`/NAME/suite.json, {"scene": "../../scenes/x/scene.json", "frames": [1, 12, 24]} or
/// {"command": "blender -b x.blend -o {out} -f {frame}", "format": "png", "frames": [1]}. Optional
/// are "masks": [{"file": "mask.png", "why": "..."}, {"ids": [3], "why": "..."}] with
/// "max_masked_percent": 5. A tolerance.json beside suite.json may state limits and their reasons:
///   {"fail": {"value": 0.004, "why": "..."}, "fail_percent": {...}, "hard_fail", "relative",
///   "depth", "normal", "flip_mean", "flip_p99", "warn", "warn_percent"}
/// Instead of that file, suite.json may contain "tolerance": {"fail": 0.004, ..., "why": "..."}
/// with one reason for all limits. Missing limits are those of zero_tolerance() in a suite with a
/// scene, since polymorph's frames have the same bits everywhere, else those of Tolerance{}. Limits
/// that no frame could exceed are refused. Errors: kInput, naming the file and what is missing; for
/// an unknown suite, the message suggests the nearest name.
Result<GoldenSuite> load_golden_suite(const std::filesystem::path& root, const std::string& name);
/// Lists the names of all entries of `root`, sorted, except for notes (README, *.md, *.txt and the
/// like). Each is a suite or an error of load_golden_suite(), so that a suite without its
/// suite.json is noticed. Errors: kInput if `root` cannot be listed.
Result<std::vector<std::string>> list_golden_suites(const std::filesystem::path& root);

/// Makes the suite.json of a suite with a scene, without limits and masks.
std::string suite_json_text(const GoldenSuite& suite);

/// Path of a golden image: SUITE/frame.0012.exr, or with the suite's own format.
std::filesystem::path golden_image_path(const GoldenSuite& suite, int frame);

/// Reads "frame,vertices,triangles,digest" and a line per frame, ascending. Errors: kInput.
Result<std::vector<SurfaceRecord>> read_surface_records(const std::filesystem::path& csv);
/// Writes the text that read_surface_records() reads.
std::string surface_records_text(const std::vector<SurfaceRecord>& records);

}  // namespace polymorph
