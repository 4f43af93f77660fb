#include "sequence/device.h"

#include <atomic>
#include <optional>

#include "base/log.h"
#include "base/text.h"

namespace polymorph {

Result<std::unique_ptr<SurfaceExtractor>> make_extractor(const std::string& device,
                                                         std::string& chosen,
                                                         std::size_t max_memory) {
  chosen = "cpu";
  const auto cpu = [&] {
    auto extractor = make_cpu_extractor();
    extractor->limit_memory(max_memory);
    return extractor;
  };
  if (device == "cpu") return cpu();
  const bool automatic = device == "auto";
  int index = 0;
  if (!automatic) {
    const auto number = device == "cuda"              ? std::optional<long long>(0)
                        : device.starts_with("cuda:") ? parse_integer(device.substr(5))
                                                      : std::nullopt;
    if (!number || *number < 0 || *number > 1023)
      return make_error(ErrorCode::kUsage, "--device {}: write cpu, cuda, cuda:1 or auto", device);
    index = static_cast<int>(*number);
  }
  ExtractStatus status;
  auto extractor = make_cuda_extractor(index, status);
  if (extractor) {
    chosen = fmt::format("cuda:{}", index);
    extractor->limit_memory(max_memory);
    return extractor;
  }
  if (!automatic)
    return make_error(ErrorCode::kResource, "--device {}: {} - use --device cpu or auto", device,
                      status.message);
  // Said once, not for every scene of a command.
  static std::atomic_flag said;
  if (!said.test_and_set()) {
    log_info("device: cpu (no GPU is needed; -v says why none is used)");
    log_debug("no GPU: {}", status.message);
  }
  return cpu();
}

}  // namespace polymorph
