#include "farm/receipt.h"

#include <map>
#include <vector>

#include "base/file.h"
#include "base/json.h"
#include "base/sha256.h"
#include "film/status.h"

namespace polymorph {
namespace {

// Types of the statement and its members (docs/provenance.md).
constexpr const char* kStatement = "https://in-toto.io/Statement/v1";
constexpr const char* kPredicate = "https://slsa.dev/provenance/v1";
constexpr const char* kBuildType = "urn:polymorph:render:1";
constexpr const char* kBuilder = "urn:polymorph:program";

/// Makes in-toto's ResourceDescriptor of a file.
JsonValue describe_resource(const std::string& name, const std::string& sha256) {
  return {{"name", name}, {"digest", {{"sha256", sha256}}}};
}

}  // namespace

Result<std::string> make_receipt(const RunReport& report) {
  std::map<int, const FrameRecord*> finished;  // by frame number, in ascending order
  for (const FrameRecord& record : report.frames)
    if (record.state == FrameRecord::State::kDone || record.state == FrameRecord::State::kSkipped)
      finished[record.frame] = &record;
  JsonValue subjects = JsonValue::array(), inputs = JsonValue::array();
  std::vector<int> frames;
  for (const auto& [frame, record] : finished) {
    frames.push_back(frame);
    for (const std::filesystem::path& file : record->files) {
      const auto bytes = read_file(file);
      if (!bytes) return make_error(ErrorCode::kOutput, "{}", bytes.error().message);
      subjects.push_back(describe_resource(file.filename().string(),
                                           Sha256().add(bytes->data(), bytes->size()).hex()));
    }
  }
  for (const InputFile& file : report.provenance.files)
    inputs.push_back(describe_resource(file.name, file.sha256));
  const auto scene = parse_json("scene", report.provenance.scene);
  PM_CHECK(scene.ok());
  const JsonValue statement{{"_type", kStatement},
                            {"subject", subjects},
                            {"predicateType", kPredicate},
                            {"predicate",
                             {{"buildDefinition",
                               {{"buildType", kBuildType},
                                {"externalParameters",
                                 {{"frames", format_frame_list(frames)},
                                  {"coarse", report.provenance.coarse},
                                  {"scene", scene->root}}},
                                {"resolvedDependencies", inputs}}},
                              {"runDetails",
                               {{"builder",
                                 {{"id", kBuilder},
                                  {"version",
                                   {{"polymorph", report.provenance.version},
                                    {"build", report.provenance.program}}}}}}}}}};
  return dump_json(statement);
}

bool is_receipt(const std::string& text) {
  return text.starts_with(std::string("{\n  \"_type\": \"") + kStatement + "\"");
}

}  // namespace polymorph
