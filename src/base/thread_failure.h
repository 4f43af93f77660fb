// Exceptions for threads that cannot be started.
#pragma once

#include <exception>

namespace polymorph {

/// Tests whether the standard library or TBB threw this exception because a thread could not be
/// started. make_thread_error() (base/parallel.h) makes an Error from its text.
bool is_thread_failure(const std::exception& thrown);

}  // namespace polymorph
