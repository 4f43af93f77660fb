#include "base/file.h"
#include "base/json.h"
#include "base/log.h"
#include "base/program_identity.h"
#include "base/text.h"
#include "cli/command_line.h"
#include "farm/reproduce.h"
#include "scene/provenance.h"

namespace polymorph {
namespace {

struct ReproduceOptions {
  std::string frame, models = ".", output;
  JsonOutput json;
};

/// Exit codes: the bits are the same, the pixels or an input differ, an input is missing.
constexpr int kSame = 0, kDiffers = static_cast<int>(ErrorCode::kAnswerNo),
              kMissing = static_cast<int>(ErrorCode::kInput);

int exit_code(const Reproduction& result) {
  if (!result.changed.empty()) return kDiffers;
  if (!result.missing.empty()) return kMissing;
  return result.same_pixels ? kSame : kDiffers;
}

std::string this_program() { return fmt::format("{} ({})", program_version(), shared_identity()); }

/// Describes how the rendered frame differs from the file, or that it does not.
std::string describe(const Reproduction& result) {
  if (result.same_pixels && !result.same_program)
    return "same bits in every pixel, by another build: it is of " + result.program + ", this is " +
           this_program();
  if (result.same_bytes) return "same bits, every byte of the file";
  if (result.same_pixels)
    return "same bits in every pixel; its header or its compression is not as this build writes it";
  return "differs: " + result.difference +
         (result.same_program
              ? ""
              : "; and it is of another build, " + result.program + ", this is " + this_program());
}

void print_result(const ReproduceOptions& options, const Reproduction& result) {
  for (const std::string& line : result.changed)
    print_data("{}: differs: {}\n", options.frame, line);
  for (const std::string& line : result.missing) print_data("{}: {}\n", options.frame, line);
  if (result.changed.empty() && result.missing.empty()) {
    print_data("{}: {}\n", options.frame, describe(result));
    return;
  }
  if (!result.same_program)
    print_data("{}: is of another build, {}, this is {}\n", options.frame, result.program,
               this_program());
  if (!result.missing.empty())
    log_info("--models names the folder that these names begin at (now {})", options.models);
}

JsonValue to_json(const ReproduceOptions& options, const Reproduction& result) {
  const bool rendered = !result.bytes.empty();
  JsonValue json{{"file", options.frame},     {"frame", result.frame},
                 {"program", result.program}, {"same_program", result.same_program},
                 {"missing", result.missing}, {"changed", result.changed},
                 {"rendered", rendered}};
  if (!rendered) return json;
  json["same_pixels"] = result.same_pixels;
  json["same_bytes"] = result.same_bytes;
  if (!result.same_pixels) json["difference"] = result.difference;
  return json;
}

/// Checks before any work that the output has the frame's format and may be written.
Status check_reproduced_output(const ReproduceOptions& options, bool overwrite) {
  if (options.output.empty()) return Ok{};
  const auto format = [](const std::string& file) {
    return lower_case(std::filesystem::path(file).extension().string());
  };
  if (format(options.output) != format(options.frame))
    return make_error(ErrorCode::kUsage, "{}: the frame is written in its own format, {}",
                      options.output, format(options.frame));
  return check_output(options.output, overwrite);
}

Result<int> run_reproduce(const CommandLine& line, const ReproduceOptions& options) {
  remember_input(options.frame);
  PM_TRY_STATUS(check_reproduced_output(options, line.common.overwrite));
  PM_TRY(const Reproduction result,
         reproduce_frame(options.frame, options.models, resources(line.common)));
  if (!options.output.empty() && !result.bytes.empty())
    PM_TRY_STATUS(write_file(options.output, result.bytes));
  if (options.json.enabled)
    PM_TRY_STATUS(write_json(options.json, to_json(options, result)));
  else
    print_result(options, result);
  return exit_code(result);
}

}  // namespace

void add_reproduce(CommandLine& line) {
  auto options = std::make_shared<ReproduceOptions>();
  Command command = add_command(
      line, "reproduce", "Render a frame again from its own header, and compare the bits.",
      "  polymorph reproduce out/frame.0012.exr\n"
      "  polymorph reproduce frame.0012.png --models scenes/models -o again.png",
      "  0 same bits   1 the pixels or an input differ   2 usage\n"
      "  3 no usable header, an input is missing, or a bad scene   4 cannot write\n"
      "  5 device or memory");
  command.add_option("frame", options->frame, "FRAME", "EXR or PNG that render or golden wrote")
      .required();
  command.add_option("--models", options->models, "DIR",
                     "folder of the files that the header names; default: the current one");
  command
      .add_option("-o,--output", options->output, "FILE", "write the frame as it is rendered now")
      .group("Output");
  add_json(command, options->json);
  set_action(line, command, [&line, options] { return run_reproduce(line, *options); });
}

}  // namespace polymorph
