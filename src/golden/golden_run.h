// Golden image tests: a suite's frames are rendered and compared with the committed ones.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "compare/compare.h"
#include "compare/comparison_report.h"
#include "compare/golden.h"

namespace polymorph {

struct GoldenSettings {
  std::string device = "cpu";          ///< a device as in make_engine()
  std::filesystem::path cache_folder;  ///< empty: no cache
  /// Folder for the actual frame, the reference and the difference of failing frames; empty: none.
  std::filesystem::path failures;
  /// Budget of the report's pictures; null: makes no pictures.
  PictureBudget* pictures = nullptr;
};

struct GoldenFrame {
  int frame = 0;
  bool unreadable = false;          ///< the golden image cannot be read
  bool surface_passed = false;      ///< vertices, triangles and digest equal those in surface.csv;
                                    ///< always true if another program renders
  std::optional<Comparison> image;  ///< absent if the golden is missing or unreadable
  double masked_percent = 0;        ///< percentage of the pixels that masks cover
  std::string message;              ///< reason for the failure; empty if the frame passed
  ReportCase report;                ///< case of the report; the caller sets `accept`
  bool passed() const { return message.empty(); }
};

struct GoldenResult {
  std::vector<GoldenFrame> frames;
  /// Images of the suite's format in its folder that are neither goldens of its frames nor masks.
  std::vector<std::filesystem::path> orphans;
  std::size_t failed() const;  ///< number of frames that failed
};

/// Renders a suite's frames and compares them with the goldens. Writes only the files of failing
/// frames. A frame whose golden image is missing or unreadable fails. Errors: kInput if anything
/// else cannot be read; kResource; kOutput.
Result<GoldenResult> test_golden(const GoldenSuite& suite, const GoldenSettings& settings);

/// Renders a suite's frames, then replaces failing and damaged goldens, adds missing ones, updates
/// surface.csv and appends the reason to CHANGES.md: all or nothing (base/file.h, write_files).
/// Returns the written files. Errors: kUsage without a reason, or if CI is set in the environment;
/// kInternal or kInput for NaN and infinite pixels; those of test_golden().
Result<std::vector<std::filesystem::path>> update_golden(const GoldenSuite& suite,
                                                         const GoldenSettings& settings,
                                                         const std::string& reason);

/// Makes a suite from a scene: renders the suite's frames and writes them with suite.json, all or
/// nothing. `suite` needs name, folder, scene and frames. Returns the written files. Errors: those
/// of update_golden(); kOutput if the folder exists.
Result<std::vector<std::filesystem::path>> create_golden_suite(GoldenSuite suite,
                                                               const GoldenSettings& settings,
                                                               const std::string& reason);

/// A frame's number, and the pixel_sha256() of its pixels before encoding.
struct FrameHash {
  int frame = 0;
  std::string sha256;
};
/// Renders and hashes the suite's frames or, if the suite lists none, the first, middle and last
/// frame of its scene. Writes nothing. Errors: those of SuiteRenderer (golden/golden_frames.h).
Result<std::vector<FrameHash>> hash_golden(GoldenSuite suite, const GoldenSettings& settings);

}  // namespace polymorph
