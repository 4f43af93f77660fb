// Selection of compute devices: the surface engine and the renderer for the option --device.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "base/result.h"
#include "kernels/engine.h"
#include "render/device/device_tracer.h"
#include "render/render.h"

namespace polymorph {

/// Lists the devices that share a film, from the text of --device: the entries of a list
/// ("cuda:0,cuda:1"), or every GPU of the machine for "cuda:all". The entries are not checked.
/// Errors: kUsage for an empty entry; kResource for "cuda:all" without a GPU.
Result<std::vector<std::string>> list_devices(const std::string& option);

/// Makes the engine for the first device of `option`: "cpu", "cuda" (the first GPU), "cuda:1" or
/// "auto" (the first GPU if it works, else the CPU, which is logged once). Sets `chosen` to "cpu"
/// or "cuda:N". `max_memory`: bytes for the surface's buffers and mesh; 0: no limit. Errors: as
/// list_devices(); kUsage for another name; kResource if the named GPU does not work.
Result<std::unique_ptr<Engine>> make_engine(const std::string& option, std::string& chosen,
                                            std::size_t max_memory = 0);

/// Opens the tracer of a GPU ("cuda:1"). If it fails, returns null and sets `error` to the reason.
std::unique_ptr<DeviceTracer> open_tracer(const std::string& device, std::string& error);

/// Creates a renderer that traces on `device`, "cpu" or "cuda:N" as chosen by make_engine(). If the
/// GPU cannot trace, the CPU does, and the reason is logged once. The CPU also traces frames for
/// which the GPU would need more than `max_memory` bytes (0: no limit). Errors: as
/// Renderer::create().
Result<Renderer> make_renderer(const std::string& device, std::size_t max_memory = 0);

}  // namespace polymorph
