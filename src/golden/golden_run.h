// Golden image tests: render a suite's frames and compare them with the committed ones.
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
  std::string device = "cpu";
  std::filesystem::path cache_folder;
  std::filesystem::path failures;  ///< actual, reference and difference of failing frames go here
  /// Budget of a report's pictures; null: none are made.
  PictureBudget* pictures = nullptr;
};

struct GoldenFrame {
  int frame = 0;
  bool missing = false;             ///< no golden image
  bool unreadable = false;          ///< there is one, but damaged
  bool surface_passed = false;      ///< counts and digest are equal
  std::optional<Comparison> image;  ///< absent when the golden is missing
  double masked_percent = 0;        ///< share of the pixels that masks cover
  std::string message;              ///< why it failed, empty when it passed
  ReportCase report;                ///< the same for a report; `accept` is left to the caller
  bool passed() const { return message.empty(); }
};

struct GoldenResult {
  std::string suite;
  std::vector<GoldenFrame> frames;
  std::vector<std::filesystem::path>
      orphans;  ///< images in the folder that no frame of the suite asks for
  std::size_t failed() const;
};

/// Renders and compares; writes nothing but failures. A golden image that cannot be read is its
/// frame's failure; all else that cannot is an error: kInput, kResource, kOutput.
Result<GoldenResult> test_golden(const GoldenSuite& suite, const GoldenSettings& settings);

/// Replaces failing, damaged and missing goldens (and surface.csv), refuses NaN, appends to
/// CHANGES.md with the reason; all of it or nothing, once every frame is rendered (base/file.h,
/// write_files). Returns what was written. Errors: kUsage without a reason or when CI is set in the
/// environment.
Result<std::vector<std::filesystem::path>> update_golden(const GoldenSuite& suite,
                                                         const GoldenSettings& settings,
                                                         const std::string& reason);

/// Makes a suite of a scene: renders its frames and writes them with suite.json, all of it or
/// nothing. `suite` needs name, folder, scene and frames. Returns what was written. Errors: those
/// of update_golden(), and kOutput where the folder exists.
Result<std::vector<std::filesystem::path>> create_golden_suite(GoldenSuite suite,
                                                               const GoldenSettings& settings,
                                                               const std::string& reason);

/// A frame, and the SHA-256 of its pixels as rendered (size, channel names, floats).
struct FrameHash {
  int frame = 0;
  std::string sha256;
};
/// Renders the suite's frames, or the first, the middle and the last one of its scene where it
/// names none; compares and writes nothing.
Result<std::vector<FrameHash>> hash_golden(GoldenSuite suite, const GoldenSettings& settings);

}  // namespace polymorph
