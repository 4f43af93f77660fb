// Failover from a GPU to the CPU, which gives the same bits.
#pragma once

#include <memory>

#include "kernels/engine.h"

namespace polymorph {

/// Makes an engine that uses `device` and, where that fails, the CPU, so that a film is completed.
/// A call for which the device has too little memory runs on the CPU. After any other device error,
/// this call and all later calls run on the CPU. The reason is logged if it differs from the one
/// logged before.
std::unique_ptr<Engine> make_failover_engine(std::unique_ptr<Engine> device);

}  // namespace polymorph
