#include "film/run_report.h"

#include "base/json.h"
#include "base/program_identity.h"

namespace polymorph {
namespace {

const char* state_name(FrameRecord::State state) {
  switch (state) {
    case FrameRecord::State::kDone:
      return "done";
    case FrameRecord::State::kSkipped:
      return "skipped";
    case FrameRecord::State::kFailed:
      return "failed";
    case FrameRecord::State::kPlanned:
      return "planned";
  }
  return "";
}

}  // namespace

std::size_t RunReport::count(FrameRecord::State state) const {
  std::size_t n = 0;
  for (const FrameRecord& record : frames) n += record.state == state;
  return n;
}

JsonValue to_json(const RunReport& report) {
  JsonValue json{{"build", program_identity()},
                 {"scene_hash", report.scene_hash},
                 {"device", report.device},
                 {"isa", report.isa},
                 {"threads", report.threads},
                 {"prepare_seconds", report.prepare_seconds},
                 {"frames_seconds", report.frames_seconds},
                 {"total_seconds", report.total_seconds},
                 {"peak_memory_bytes", report.peak_memory},
                 {"stopped", report.stopped}};
  json["frames"] = JsonValue::array();
  for (const FrameRecord& record : report.frames) {
    JsonValue files = JsonValue::array();
    for (const std::filesystem::path& file : record.files) files.push_back(file.string());
    JsonValue frame{{"frame", record.frame},
                    {"state", state_name(record.state)},
                    {"stage", record.stage},
                    {"files", files}};
    if (record.state == FrameRecord::State::kDone)
      frame.update({{"seconds", record.seconds},
                    {"surface_seconds", record.surface_seconds},
                    {"trace_seconds", record.trace_seconds},
                    {"write_seconds", record.write_seconds},
                    {"balls", record.balls},
                    {"vertices", record.vertices},
                    {"triangles", record.triangles},
                    {"digest", record.digest}});
    if (!record.error.empty()) frame["error"] = record.error;
    json["frames"].push_back(frame);
  }
  if (report.estimate)
    json["estimate"] = {{"measured_frames", report.estimate->measured},
                        {"frame_seconds", report.estimate->seconds},
                        {"frame_exr_bytes", report.estimate->exr_bytes},
                        {"frame_png_bytes", report.estimate->png_bytes},
                        {"unfitted", report.estimate->unfitted},
                        {"fit_seconds", report.estimate->fit_seconds},
                        {"memory_bytes", report.estimate->memory}};
  return json;
}

}  // namespace polymorph
