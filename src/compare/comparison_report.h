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
  std::string group;  ///< golden suite, "SUITE, bits" for `golden bits`; "" = none
  std::string name;   ///< "frame N", the file's name, or a run of `golden bits`
  std::filesystem::path actual, reference;
  std::string message;  ///< reason of the failure; "" = the case passed
  std::string cause;    ///< one sentence about the change (explain.h); "" = unknown
  bool error = false;   ///< the case could not be tested; the message says why
  std::string detail;   ///< remark on a case that passed without a comparison
  /// A word in place of the verdict of `comparison`. "" = that verdict; if there is no comparison,
  /// "error" or "missing", as `error` says.
  std::string verdict;
  std::optional<Comparison> comparison;  ///< absent without a reference
  Tolerance tolerance;
  double seconds = 0;
  /// Number and surface of the new frame of a golden suite (without digest: its surface is
  /// unknown); absent in other reports.
  std::optional<SurfaceRecord> surface;
  std::string pixels_sha256;      ///< SHA-256 of the new frame's pixels; "" = unknown
  std::string file_sha256;        ///< SHA-256 of the new frame's file; "" = the file is not kept
  std::optional<double> flicker;  ///< Flicker::mean (flicker.h) towards the next frame
  std::optional<double> reference_flicker;  ///< the same for the reference frames
  std::optional<double> masked_percent;     ///< percentage of pixels that are not compared
  double max_masked_percent = 0;            ///< limit of masked_percent
  std::string accept;  ///< the command that makes the new picture the reference

  /// PNG bytes for the page, "" = not shown; filled by add_pictures().
  std::string reference_png, actual_png, heat_png, limits_png, thumbnail_png;
  std::string triptych_png;  ///< reference | new | heat, only for failures
  int width = 0, height = 0;
  bool passed() const { return message.empty(); }
  bool warned() const { return passed() && comparison && comparison->warned; }
};

struct Report {
  std::string title;
  /// Labels and values that are shown below the title.
  std::vector<std::pair<std::string, std::string>> facts;
  std::vector<ReportCase> cases;
  std::vector<std::string> notes;  ///< e.g. golden frames that no suite asks for
  /// Name and hash of each suite (suite_hash()), for accepting its frames later.
  std::vector<std::pair<std::string, std::string>> suites = {};
  std::size_t failed() const;
  std::size_t errors() const;  ///< failed cases that could not be tested
};

/// A metric of a case, and the limit that it must not exceed, if any.
struct CaseMetric {
  std::string name;   ///< key in report.json and junit.xml, such as "fail_percent"
  std::string label;  ///< words for the page, such as "pixels over their limits, %"
  double value = 0;   ///< may be infinite (PSNR)
  std::optional<double> limit;
  bool over() const { return limit && !(value <= *limit); }
};
/// Lists the metrics of a case in the order in which they are shown. Empty without a comparison, or
/// if sizes or channels differ.
std::vector<CaseMetric> case_metrics(const ReportCase& result);

/// Bytes of PNG in a page, limited so that pages of long sequences stay usable. A passing case has
/// full pictures while `used` is below `passing`, a failing case while `used` is below `failing`.
/// Later cases have only a thumbnail.
struct PictureBudget {
  std::size_t used = 0;
  std::size_t passing = std::size_t{12} << 20, failing = std::size_t{96} << 20;
};

/// Makes the pictures of a case; `reference` is null if there is none. Errors: kOutput.
Status add_pictures(ReportCase& result, const Image& actual, const Image* reference,
                    const PixelMaps& maps, PictureBudget& budget);

/// Makes a self-contained page: failing cases first, with swipe and flip views, heat map,
/// histogram, metrics against limits and the command that accepts the frame. It has dark and light
/// themes and keyboard control.
std::string report_html(const Report& report);

/// Makes JUnit XML with a suite per group, a test case per frame and the metrics as properties.
std::string report_junit(const Report& report);

/// Makes {"passed", "failed", "errors", "cases": [{"group", "name", "passed", "verdict", "reason",
/// "figures", "channels", ...}]}. `files`, the names of the report's files, become
/// "polymorph_report".
JsonValue report_json(const Report& report, const std::vector<std::string>& files = {});

/// Removes the files of an earlier report from `folder`: those that its report.json lists, if their
/// names fit the cases in it and their contents are a report's. Other files stay, as do all files
/// beside the report.json of another program. Errors: kOutput; if a file is an input of this run,
/// nothing is removed.
Status remove_report(const std::filesystem::path& folder);

/// Writes index.html, junit.xml, report.json and a PNG per failure (reference | new | heat) to
/// `folder`, in place of an earlier report. Other files of these names are replaced only with
/// `overwrite`; without it they are an error before anything is written. Returns the page's path.
/// Errors: kOutput.
Result<std::filesystem::path> write_report_folder(const Report& report,
                                                  const std::filesystem::path& folder,
                                                  bool overwrite);

}  // namespace polymorph
