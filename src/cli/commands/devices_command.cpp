#include <sched.h>

#include <fstream>

#include "base/json.h"
#include "base/parallel.h"
#include "base/text.h"
#include "cli/command_line.h"
#include "kernels/devices.h"
#include "render/render.h"

namespace polymorph {
namespace {

std::string cpu_name() {
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);)
    if (line.starts_with("model name"))
      if (const auto colon = line.find(": "); colon != std::string::npos)
        return line.substr(colon + 2);
  return "unknown processor";
}

Result<int> run_devices(const JsonOutput& json_output) {
  const DeviceList list = list_cuda_devices();
  PM_TRY(const Renderer renderer, Renderer::create());
  if (json_output.enabled) {
    JsonValue json{
        {"cpu",
         {{"name", cpu_name()}, {"threads", thread_count()}, {"embree_isa", renderer.isa()}}},
        {"built_with_cuda", list.built_with_cuda},
        {"runtime", list.runtime},
        {"driver", list.driver}};
    json["cuda"] = JsonValue::array();
    for (const DeviceInfo& d : list.devices)
      json["cuda"].push_back({{"index", d.index},
                              {"name", d.name},
                              {"memory_bytes", d.memory_bytes},
                              {"capability", d.capability}});
    PM_TRY_STATUS(write_json(json_output, json));
    return 0;
  }
  print_data("cpu     {}, {} thread{}, embree {}\n", cpu_name(), thread_count(),
             thread_count() == 1 ? "" : "s", renderer.isa());
  for (const DeviceInfo& d : list.devices)
    print_data("cuda:{}  {}, {}, compute {}\n", d.index, d.name,
               format_bytes(static_cast<double>(d.memory_bytes)), d.capability);
  if (!list.built_with_cuda)
    print_data("cuda    not built in (no nvcc when polymorph was built)\n");
  else if (list.devices.empty())
    print_data("cuda    built in ({}), but no device: {}\n", list.runtime, list.driver);
  return 0;
}

}  // namespace

void add_devices(CommandLine& line) {
  auto json = std::make_shared<JsonOutput>();
  Command command = add_command(line, "devices", "List what can compute here.",
                                "  polymorph devices", "  0 listed");
  add_json(command, *json);
  set_action(line, command, [json] { return run_devices(*json); });
}

void add_schema(CommandLine& line) {
  Command command = add_command(line, "schema", "Print the JSON Schema of scene files.",
                                "  polymorph schema > scene.schema.json", "  0 printed");
  set_action(line, command, []() -> Result<int> {
    PM_TRY_STATUS(write_text({}, scene_schema()));
    return 0;
  });
}

}  // namespace polymorph
