#include "device/device.h"

#include <algorithm>
#include <atomic>
#include <optional>

#include "base/log.h"
#include "base/text.h"
#include "device/failover_engine.h"
#include "kernels/devices.h"
#include "render/device/device_tracer.h"

namespace polymorph {

Result<std::vector<std::string>> list_devices(const std::string& option) {
  std::vector<std::string> devices;
  if (option == "cuda:all") {
    for (const DeviceInfo& device : list_cuda_devices().devices)
      devices.push_back(fmt::format("cuda:{}", device.index));
    if (devices.empty())
      return make_error(ErrorCode::kResource,
                        "--device cuda:all: there is no GPU - use --device cpu or auto");
    return devices;
  }
  devices = split(option, ',');
  if (devices.empty() || std::find(devices.begin(), devices.end(), "") != devices.end())
    return make_error(ErrorCode::kUsage,
                      "--device \"{}\": a device has no name - write cuda:0,cuda:1", option);
  return devices;
}

Result<std::unique_ptr<Engine>> make_engine(const std::string& option, std::string& chosen,
                                            std::size_t max_memory) {
  PM_TRY(const std::vector<std::string> devices, list_devices(option));
  const std::string& device = devices.front();
  chosen = "cpu";
  const auto make_cpu = [&] {
    auto engine = make_cpu_engine();
    engine->limit_memory(max_memory);
    return engine;
  };
  if (device == "cpu") return make_cpu();
  const bool is_automatic = device == "auto";
  int index = 0;
  if (!is_automatic) {
    const auto number = device == "cuda"              ? std::optional<long long>(0)
                        : device.starts_with("cuda:") ? parse_integer(device.substr(5))
                                                      : std::nullopt;
    // 1023 is more than any machine has, and keeps the cast below in range.
    if (!number || *number < 0 || *number > 1023)
      return make_error(ErrorCode::kUsage, "--device {}: write cpu, cuda, cuda:1, cuda:all or auto",
                        device);
    index = static_cast<int>(*number);
  }
  EngineStatus status;
  auto engine = make_cuda_engine(index, status);
  if (engine) {
    chosen = fmt::format("cuda:{}", index);
    engine = make_failover_engine(std::move(engine));
    engine->limit_memory(max_memory);
    return engine;
  }
  if (!is_automatic)
    return make_error(ErrorCode::kResource, "--device {}: {} - use --device cpu or auto", device,
                      status.message);
  // Log this once per command, not for each of its scenes.
  static std::atomic_flag is_logged;
  if (!is_logged.test_and_set()) {
    log_info("device: cpu (no GPU is needed; -v says why none is used)");
    log_debug("no GPU: {}", status.message);
  }
  return make_cpu();
}

std::unique_ptr<DeviceTracer> open_tracer(const std::string& device, std::string& error) {
  // make_engine() has checked the number.
  const auto index = parse_integer(device.substr(device.find(':') + 1));
  return make_cuda_tracer(static_cast<int>(index.value_or(0)), error);
}

Result<Renderer> make_renderer(const std::string& device, std::size_t max_memory) {
  PM_TRY(Renderer renderer, Renderer::create());
  if (!device.starts_with("cuda:")) return renderer;
  std::string error;
  auto tracer = open_tracer(device, error);
  static std::atomic_flag is_logged;  // logs the reason once per command
  if (tracer) {
    tracer->limit_memory(max_memory);
    renderer.set_device_tracer(std::move(tracer));
  } else if (!is_logged.test_and_set()) {
    log_info("the CPU traces paths, because {} cannot: {}", device, error);
  }
  return renderer;
}

}  // namespace polymorph
