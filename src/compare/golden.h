// Golden image suites on disk: golden_frames/SUITE/{suite.json, tolerance.json, surface.csv,
// frame.####.exr, CHANGES.md}.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"
#include "compare/compare.h"

namespace polymorph {

/// One row of surface.csv: what the geometry of a frame must be, exactly.
struct SurfaceRecord {
  int frame = 0;
  std::size_t vertices = 0, triangles = 0;
  std::string digest;
};

/// Pixels that are not compared: where the picture `file` is not black, or where one of the objects
/// `ids` is, before or now.
struct GoldenMask {
  std::filesystem::path file;  ///< empty: by ids
  std::vector<int> ids;
  std::string why;
};

struct GoldenSuite {
  std::string name;
  std::filesystem::path folder;
  std::filesystem::path scene;  ///< suite.json's, resolved against the suite's folder
  std::string command;          ///< shell command of another program; then there is no scene
  std::string format = "exr";   ///< extension of that program's frames
  std::vector<int> frames;      ///< the frames that have a golden, rising
  Tolerance tolerance;          ///< `why` has the reasons of all limits
  std::vector<GoldenMask> masks;
  double max_masked_percent = 0;  ///< share of the pixels that the masks may cover, %
};

/// Reads `root`/NAME/suite.json, {"scene": "../../scenes/x/scene.json", "frames": [1, 12, 24]} or
/// {"command": "blender -b x.blend -o {out} -f {frame}", "format": "png", "frames": [1]}, with
/// "masks": [{"file": "mask.png", "why": "..."}, {"ids": [3], "why": "..."}] and
/// "max_masked_percent": 5 if wanted, and the limits from tolerance.json beside it, each with its
/// reason:
///   {"fail": {"value": 0.004, "why": "..."}, "fail_percent": {...}, "hard_fail", "relative",
///   "depth", "normal", "flip_mean", "flip_p99", "warn", "warn_percent"}
/// A limit that is not named is 0 in a suite with a scene: polymorph's frames are the same bits
/// everywhere; in one with a command it is Tolerance's default. In place of the file suite.json may
/// hold "tolerance": {"fail": 0.004, ..., "why": "..."} with one reason for all. Limits that no
/// frame could exceed are refused. Errors: kInput, naming the file and what is missing; an unknown
/// suite names the nearest.
Result<GoldenSuite> load_golden_suite(const std::filesystem::path& root, const std::string& name);
/// Names of all folders and links below `root`, sorted. Each of them is a suite or an error of
/// load_golden_suite(): a suite whose suite.json is gone must not vanish. Files are left out.
/// Errors: kInput where `root` cannot be listed.
Result<std::vector<std::string>> list_golden_suites(const std::filesystem::path& root);

/// The suite.json of a suite with a scene, without limits and masks.
std::string suite_json_text(const GoldenSuite& suite);

/// SUITE/frame.0012.exr, or with the suite's own format.
std::filesystem::path golden_image_path(const GoldenSuite& suite, int frame);

/// "frame,vertices,triangles,digest" and a line per frame, rising. Errors: kInput with the line.
Result<std::vector<SurfaceRecord>> read_surface_records(const std::filesystem::path& csv);
std::string surface_records_text(const std::vector<SurfaceRecord>& records);

}  // namespace polymorph
