// Compute device selection: the surface engine that --device asks for.
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

/// Lists the devices that share a film: those of a list ("cuda:0,cuda:1"), every GPU of the machine
/// for "cuda:all", and for any other word that word. Errors: kUsage for an empty word in a list;
/// kResource for "cuda:all" where there is no GPU.
Result<std::vector<std::string>> list_devices(const std::string& asked);

/// "cpu", "cuda", "cuda:1" or "auto" (CUDA where it answers, else the CPU, said once); the first of
/// a list. Errors: those of list_devices(), kUsage for another word; kResource when a device asked
/// for by name is not there. `max_memory`: bytes for the surface's buffers and mesh; 0 = no limit.
Result<std::unique_ptr<Engine>> make_engine(const std::string& device, std::string& chosen,
                                            std::size_t max_memory = 0);

/// Opens the tracer of a GPU ("cuda:1"). Null: `error` says why.
std::unique_ptr<DeviceTracer> open_tracer(const std::string& device, std::string& error);

/// Creates a renderer that traces on `device` ("cpu", "cuda:1"), as make_engine() chose it. Errors:
/// those of Renderer::create(). A GPU that cannot trace is said once; the CPU traces then, as it
/// does where a frame would take more than `max_memory` bytes of the device (0: no limit).
Result<Renderer> make_renderer(const std::string& device, std::size_t max_memory = 0);

}  // namespace polymorph
