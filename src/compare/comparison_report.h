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
  std::string message;  ///< reason of the failure; "" = the case passed
  std::string cause;    ///< one sentence about the change (explain.h); "" = unknown
  bool error = false;   ///< the case could not be tested; the message says why
  std::string detail;   ///< remark on a case that passed without a comparison
  std::string verdict;  ///< "" = that of `comparison`; without one, "error" or "missing"
  std::optional<Comparison> comparison;  ///< absent without a reference
  Tolerance tolerance;
  double seconds = 0;
  SurfaceRecord surface;          ///< surface of the new frame; unknown if surface.frame is 0
  std::string pixels;             ///< SHA-256 of the new frame's pixels; "" = unknown
  std::string file_sha256;        ///< SHA-256 of the new frame's file; "" = not kept
  std::optional<double> flicker;  ///< change towards the next frame (flicker.h)
  std::optional<double> reference_flicker;
  std::optional<double> masked_percent;  ///< percentage of pixels that are not compared
  double max_masked_percent = 0;         ///< limit of masked_percent
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
  std::vector<std::string> notes;  ///< e.g. golden frames that no suite asks for
  /// Name and hash of each suite (suite_hash()), for accepting its frames later.
  std::vector<std::pair<std::string, std::string>> suites = {};
  std::size_t failed() const;
  std::size_t errors() const;  ///< failed cases that could not be tested
};

/// A metric of a case, and the limit that it must not exceed, if any.
struct CaseMetric {
  std::string name, label;  ///< "fail_percent", "pixels over their limits, %"
  double value = 0;         ///< may be infinite (PSNR)
  std::optional<double> limit;
  bool over() const { return limit && !(value <= *limit); }
};
/// Lists the metrics of a case in the order in which they are shown. Empty without a comparison, or
/// if sizes or channels differ.
std::vector<CaseMetric> case_metrics(const ReportCase& result);

/// Bytes of PNG in a page, limited so that pages of long sequences stay usable. A case that
/// passes has full pictures while `used` is below `passing`, one that fails while it is below
/// `failing`; later ones have only a thumbnail.
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

/// Removes the files of an earlier report from `folder`. These are the files listed in its
/// report.json, if a report of its cases would have files of these names and contents.
/// Other files stay, also those beside the report.json of another program. Errors: kOutput; if a
/// file is an input of this run, nothing is removed.
Status remove_report(const std::filesystem::path& folder);

/// Writes index.html, junit.xml, report.json and a PNG per failure (reference | new | heat) to
/// `folder`, in place of an earlier report. Other files of these names are replaced only with
/// `overwrite`; without it they are an error before anything is written. Returns the page's path.
/// Errors: kOutput.
Result<std::filesystem::path> write_report_folder(const Report& report,
                                                  const std::filesystem::path& folder,
                                                  bool overwrite);

}  // namespace polymorph
