#include <nlohmann/json.hpp>

#include "base/file.h"
#include "base/log.h"
#include "cli/command_line.h"
#include "compare/compare.h"
#include "image/image_io.h"
#include "scene/json_text.h"
#include "sequence/frames.h"

namespace polymorph {
namespace {

struct CompareOptions {
  std::string actual, reference, difference;
  Tolerance tolerance;
  JsonOutput json;
};

struct ImagePair {
  std::filesystem::path actual, reference;
};

/// Two files, or two patterns whose frames must be the same.
Result<std::vector<ImagePair>> pairs_of(const CompareOptions& options) {
  PM_TRY(const FramePattern a, parse_pattern(options.actual));
  PM_TRY(const FramePattern b, parse_pattern(options.reference));
  if (!a.has_number() && !b.has_number())
    return std::vector<ImagePair>{{options.actual, options.reference}};
  if (a.has_number() != b.has_number())
    return make_error(ErrorCode::kUsage,
                      "compare two images or two sequences (with #### in both names)");
  PM_TRY(const std::vector<int> frames_a, existing_frames(a));
  PM_TRY(const std::vector<int> frames_b, existing_frames(b));
  if (frames_a.empty()) return make_error(ErrorCode::kInput, "{}: no such frames", options.actual);
  if (frames_b.empty())
    return make_error(ErrorCode::kInput, "{}: no such frames", options.reference);
  std::vector<ImagePair> pairs;
  for (const int frame : frames_b) pairs.push_back({frame_path(a, frame), frame_path(b, frame)});
  for (const int frame : frames_a)
    if (!std::binary_search(frames_b.begin(), frames_b.end(), frame))
      pairs.push_back({frame_path(a, frame), frame_path(b, frame)});
  return pairs;
}

nlohmann::ordered_json to_json(const ImagePair& pair, const Comparison& c) {
  nlohmann::ordered_json json{{"actual", pair.actual.string()},
                              {"reference", pair.reference.string()},
                              {"passed", c.passed()},
                              {"verdict", verdict_name(c.verdict)},
                              {"reason", c.reason},
                              {"pixels", c.pixels},
                              {"failing_pixels", c.failing_pixels},
                              {"not_finite_pixels", c.not_finite_pixels}};
  if (std::isfinite(c.psnr)) json["psnr"] = c.psnr;
  json["channels"] = nlohmann::ordered_json::array();
  for (const ChannelDifference& d : c.channels)
    json["channels"].push_back({{"channel", d.channel},
                                {"max", d.max},
                                {"mean", d.mean},
                                {"rms", d.rms},
                                {"at", {d.max_x, d.max_y}}});
  return json;
}

Result<int> run_compare(const CompareOptions& options) {
  PM_TRY(const std::vector<ImagePair> pairs, pairs_of(options));
  int code = 0;
  std::size_t passed = 0;
  auto json = nlohmann::ordered_json::array();
  for (const ImagePair& pair : pairs) {
    PM_TRY(const Image actual, read_image(pair.actual));
    PM_TRY(const Image reference, read_image(pair.reference));
    const Comparison comparison = compare_images(actual, reference, options.tolerance);
    passed += comparison.passed();
    if (!comparison.passed()) code = static_cast<int>(ErrorCode::kAnswerNo);
    if (options.json.wanted)
      json.push_back(to_json(pair, comparison));
    else
      print_data("{}: {}\n", pair.actual.string(), comparison.reason);
    if (!options.difference.empty() && !comparison.passed()) {
      auto path = std::filesystem::path(options.difference);
      if (pairs.size() > 1)
        path = path.parent_path() / (pair.actual.stem().string() + "." + path.filename().string());
      PM_TRY_STATUS(write_image(path, difference_triptych(actual, reference)));
      log_info("reference | actual | difference: {}", path.string());
    }
  }
  if (options.json.wanted) PM_TRY_STATUS(write_json(options.json, dump_json(json)));
  if (pairs.size() > 1 && !options.json.wanted)
    print_data("{} of {} pairs pass\n", passed, pairs.size());
  return code;
}

}  // namespace

void add_compare(CommandLine& line) {
  auto options = std::make_shared<CompareOptions>();
  CLI::App* command =
      add_command(line, "compare", "Compare two images or two sequences; NaN always fails.",
                  "  polymorph compare new.exr golden.exr\n"
                  "  polymorph compare out/f.####.exr ref/f.####.exr --fail 0.01 --diff d.png",
                  "  0 within the limits   1 different   2 usage   3 unreadable image\n"
                  "  4 cannot write");
  Tolerance& t = options->tolerance;
  command->add_option("actual", options->actual, "image, or sequence with ####")
      ->required()
      ->type_name("ACTUAL")
      ->group("Main");
  command->add_option("reference", options->reference, "what it should be")
      ->required()
      ->type_name("REFERENCE")
      ->group("Main");
  command
      ->add_option("--fail", t.fail,
                   fmt::format("a pixel fails beyond this difference ({})", t.fail))
      ->check(CLI::NonNegativeNumber)
      ->type_name("X")
      ->group("Main");
  command
      ->add_option("--relative", t.relative,
                   fmt::format("... plus this share of the reference ({})", t.relative))
      ->check(CLI::NonNegativeNumber)
      ->type_name("X")
      ->group("Main");
  command
      ->add_option("--failpercent", t.fail_percent,
                   fmt::format("so many % of pixels may fail ({})", t.fail_percent))
      ->check(CLI::Range(0.0, 100.0))
      ->type_name("P")
      ->group("Main");
  command->add_option("--hardfail", t.hard_fail, "no pixel may differ by more (off)")
      ->check(CLI::NonNegativeNumber)
      ->type_name("X")
      ->group("Main");
  command->add_option("--depth", t.depth, fmt::format("relative limit for Z ({})", t.depth))
      ->check(CLI::NonNegativeNumber)
      ->type_name("X")
      ->group("Main");
  command->add_option("--normal", t.normal, fmt::format("limit for N.* ({})", t.normal))
      ->check(CLI::NonNegativeNumber)
      ->type_name("X")
      ->group("Main");
  command
      ->add_option("--diff", options->difference,
                   "write reference | actual | difference of what fails")
      ->type_name("FILE")
      ->group("Output");
  add_json(command, options->json);
  command->callback(
      [&line, options] { line.action = [options] { return run_compare(*options); }; });
}

}  // namespace polymorph
