// Comparison reports: an HTML page, JUnit XML and JSON from the results of many comparisons.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/json.h"
#include "base/result.h"
#include "compare/compare.h"
#include "compare/golden.h"
#include "image/image.h"

namespace polymorph {

/// One frame or pair of images.
struct ReportCase {
  std::string group;  ///< suite; "" = none
  std::string name;   ///< "frame 12", "a.exr"
  std::filesystem::path actual, reference;
  std::string message;  ///< why it failed; "" = it passed
  std::string cause;    ///< one sentence about the change (explain.h); "" = unknown
  bool error = false;   ///< it could not even be tested; the message says why
  std::string detail;   ///< worth knowing though it passed; used without a comparison
  std::string verdict;  ///< a word; "" = the comparison's, or "error" or "missing" without one
  std::optional<Comparison> comparison;  ///< absent when there is nothing to compare with
  Tolerance tolerance;
  double seconds = 0;
  SurfaceRecord surface;          ///< surface of the new frame; frame 0: unknown
  std::string pixels;             ///< SHA-256 of the new frame's pixels; "" = unknown
  std::string file_sha256;        ///< SHA-256 of the new frame's file, where it is kept
  std::optional<double> flicker;  ///< change towards the next frame (flicker.h)
  std::optional<double> reference_flicker;
  std::optional<double> masked_percent;  ///< share of the pixels that are not compared
  double max_masked_percent = 0;         ///< its limit
  std::string accept;                    ///< the command that makes the new picture the reference

  /// PNG bytes for the page, "" = not shown; filled by add_pictures().
  std::string reference_png, actual_png, heat_png, limits_png, thumbnail_png;
  std::string triptych_png;  ///< reference | new | heat, only for failures
  int width = 0, height = 0;
  bool passed() const { return message.empty(); }
  bool warned() const { return passed() && comparison && comparison->warned; }
};

struct Report {
  std::string title;
  std::vector<std::pair<std::string, std::string>> facts;  ///< shown below the title
  std::vector<ReportCase> cases;
  std::vector<std::string> notes;  ///< orphans and the like
  /// Name and hash of each suite (suite_hash()), for accepting its frames later.
  std::vector<std::pair<std::string, std::string>> suites = {};
  std::size_t failed() const;
  std::size_t errors() const;  ///< those of the failed that could not even be tested
};

/// A number of a case, with the limit it must not exceed, if there is one.
struct CaseMetric {
  std::string name, label;  ///< "fail_percent", "failing pixels, %"
  double value = 0;         ///< may be infinite (PSNR)
  std::optional<double> limit;
  bool over() const { return limit && !(value <= *limit); }
};
/// Lists a case's numbers in the order they are shown. Empty without a comparison, or when sizes or
/// channels differ.
std::vector<CaseMetric> case_metrics(const ReportCase& result);

/// Bytes of pictures that a page holds, limited to keep pages of long sequences readable. Cases
/// that pass are shown whole while there is room for them, failing ones nearly always; all have a
/// thumbnail.
struct PictureBudget {
  std::size_t used = 0;
  std::size_t passing = std::size_t{12} << 20, failing = std::size_t{96} << 20;
};

/// Makes the case's pictures. `reference` null: there is none. Errors: kOutput.
Status add_pictures(ReportCase& result, const Image& actual, const Image* reference,
                    const PixelMaps& maps, PictureBudget& budget);

/// One page that needs nothing but itself and opens from disk: failing cases first, swipe, flip,
/// heat map, histogram, numbers against limits, the command to accept; dark and light; keyboard.
std::string report_html(const Report& report);

/// JUnit XML: a suite per group, a test case per frame, the figures as properties.
std::string report_junit(const Report& report);

/// {"passed", "failed", "errors", "cases": [{"group", "name", "passed", "verdict", "reason",
/// "figures", "channels", ...}]}; with `files`, the report's names in its folder as
/// "polymorph_report".
JsonValue report_json(const Report& report, const std::vector<std::string>& files = {});

/// Removes the files of an earlier report from `folder`: those that its report.json lists, that a
/// report of its cases can have, and whose contents are of that kind. Other files stay, and so does
/// everything beside a report.json of another program. Errors: kOutput; also, and then nothing is
/// removed, where one of them is an input of this run.
Status remove_report(const std::filesystem::path& folder);

/// index.html, junit.xml, report.json and a PNG per failure (reference | new | heat) in `folder`,
/// in place of an earlier report there; other files of these names are replaced only with
/// `overwrite`. Returns the page's path. Errors: kOutput, before anything is written where a file
/// is in the way.
Result<std::filesystem::path> write_report_folder(const Report& report,
                                                  const std::filesystem::path& folder,
                                                  bool overwrite);

}  // namespace polymorph
