#include <sched.h>

#include <fstream>

#include "base/json.h"
#include "base/parallel.h"
#include "base/plural.h"
#include "base/program_identity.h"
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

/// Description of the machine's processors and GPUs, as JSON and as lines of text.
struct Devices {
  JsonValue json;
  std::string text;
};

Result<Devices> find_devices() {
  const DeviceList list = list_cuda_devices();
  PM_TRY(const Renderer renderer, Renderer::create());
  Devices devices;
  devices.json = {
      {"cpu", {{"name", cpu_name()}, {"threads", thread_count()}, {"embree_isa", renderer.isa()}}},
      {"built_with_cuda", list.built_with_cuda},
      {"runtime", list.runtime},
      {"driver", list.driver}};
  devices.json["cuda"] = JsonValue::array();
  devices.text = fmt::format("cpu     {}, {}, embree {}\n", cpu_name(),
                             plural(thread_count(), "thread"), renderer.isa());
  for (const DeviceInfo& d : list.devices) {
    devices.json["cuda"].push_back({{"index", d.index},
                                    {"name", d.name},
                                    {"memory_bytes", d.memory_bytes},
                                    {"capability", d.capability}});
    devices.text += fmt::format("cuda:{}  {}, {}, compute {}\n", d.index, d.name,
                                format_bytes(static_cast<double>(d.memory_bytes)), d.capability);
  }
  if (!list.built_with_cuda)
    devices.text += "cuda    not built in (no nvcc when polymorph was built)\n";
  else if (list.devices.empty())
    devices.text +=
        fmt::format("cuda    built in ({}), but no device: {}\n", list.runtime, list.driver);
  return devices;
}

Result<int> run_devices(const JsonOutput& json) {
  PM_TRY(const Devices devices, find_devices());
  if (json.enabled) PM_TRY_STATUS(write_json(json, devices.json));
  if (!json.enabled) print_data("{}", devices.text);
  return 0;
}

/// Prints the version, the build, the libraries and the devices, which a bug report needs.
Result<int> run_version(const JsonOutput& json) {
  PM_TRY(const Devices devices, find_devices());
  if (json.enabled) {
    PM_TRY_STATUS(write_json(
        json,
        {{"build", program_identity()}, {"libraries", PM_LIBRARIES}, {"devices", devices.json}}));
    return 0;
  }
  print_data("polymorph {}\nbuild   {}\nwith    {}\n{}", program_version(), program_identity(),
             PM_LIBRARIES, devices.text);
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

void add_version(CommandLine& line) {
  auto json = std::make_shared<JsonOutput>();
  Command command =
      add_command(line, "version",
                  "Print the version, the commit and flags of the build, libraries and devices.",
                  "  polymorph version", "  0 printed");
  add_json(command, *json);
  set_action(line, command, [json] { return run_version(*json); });
}

}  // namespace polymorph
