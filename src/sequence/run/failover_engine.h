// Failover from a GPU to the CPU, which gives the same bits.
#pragma once

#include <memory>

#include "kernels/engine.h"

namespace polymorph {

/// Makes an engine that does with the CPU what `device` fails at, so that a film goes on: each call
/// for which it has no memory, and every call after an error of the device. Each reason is logged
/// once.
std::unique_ptr<Engine> make_failover_engine(std::unique_ptr<Engine> device);

}  // namespace polymorph
