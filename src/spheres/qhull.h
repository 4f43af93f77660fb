// Run of the Qhull library, with its state and messages.
#pragma once

#include <cstdio>
#include <cstdlib>
#include <span>
#include <string>
#include <vector>

#include "kernels/linear.h"

extern "C" {
#include <libqhull_r/qhull_ra.h>
}

namespace polymorph {

/// A run of Qhull over a copy of points.
class Qhull {
 public:
  /// Runs Qhull with the given options, as in "qhull d Qt".
  Qhull(std::span<const Vec3d> points, const char* options) : options_(options) {
    coordinates_.reserve(3 * points.size());
    for (const Vec3d p : points) coordinates_.insert(coordinates_.end(), {p.x, p.y, p.z});
    qh_zero(&state, messages_);
    failed = qh_new_qhull(&state, 3, static_cast<int>(points.size()), coordinates_.data(),
                          /*ismalloc=*/False, options_.data(), nullptr, messages_) != 0;
  }
  ~Qhull() {
    qh_freeqhull(&state, !qh_ALL);
    int long_blocks = 0, bytes = 0;  // outputs: memory that is still in use
    qh_memfreeshort(&state, &long_blocks, &bytes);
    if (messages_) std::fclose(messages_);
    std::free(text_);
  }
  Qhull(const Qhull&) = delete;
  Qhull& operator=(const Qhull&) = delete;

  /// Returns the first line of Qhull's message, e.g. "QH6214 qhull input error: ...".
  std::string first_message() {
    if (!messages_) return "no message";
    std::fflush(messages_);
    const std::string text(text_, text_size_);
    return text.substr(0, text.find('\n'));
  }

  qhT state{};          ///< result, to be read by Qhull's macros
  bool failed = false;  ///< first_message() tells why

 private:
  std::string options_;
  std::vector<double> coordinates_;
  char* text_ = nullptr;
  std::size_t text_size_ = 0;
  std::FILE* messages_ = open_memstream(&text_, &text_size_);
};

}  // namespace polymorph
