// What is thrown where a thread cannot be started.
#pragma once

#include <exception>

namespace polymorph {

/// True of what the standard library or TBB throws where a thread cannot be started; an Error is
/// made of it by make_thread_error() (base/parallel.h).
bool is_thread_failure(const std::exception& thrown);

}  // namespace polymorph
