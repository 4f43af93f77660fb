// Stopwatch on the monotonic clock.
#pragma once

#include <chrono>

namespace polymorph {

class Stopwatch {
 public:
  /// Returns the time since construction.
  double seconds() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace polymorph
