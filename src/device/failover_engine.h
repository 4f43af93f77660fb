// Failover from a GPU to the CPU, which gives the same bits.
#pragma once

#include <memory>

#include "kernels/engine.h"

namespace polymorph {

/// Makes an engine that falls back to the CPU, so that a film goes on: for each call for which
/// `device` has too little memory, and for all calls after an error of the device. Each reason is
/// logged once.
std::unique_ptr<Engine> make_failover_engine(std::unique_ptr<Engine> device);

}  // namespace polymorph
