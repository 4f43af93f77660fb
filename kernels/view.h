// Span of backend memory (pointer and size), held by value in kernel functors.
#pragma once

#include <cstdint>
#include <type_traits>

#include "host_device.h"

namespace polymorph {

template <class T>
struct View {
  T* data = nullptr;
  std::int64_t size = 0;

  View() = default;
  PM_HD View(T* first, std::int64_t count) : data(first), size(count) {}
  /// Converts a view of mutable elements to one of const elements.
  template <class U, class = std::enable_if_t<std::is_same<const U, T>::value>>
  PM_HD View(View<U> other) : data(other.data), size(other.size) {}

  PM_HD T& operator[](std::int64_t i) const { return data[i]; }
};

/// State of a mesh of which a part may be downloaded: its triangles are written, or all of it is.
enum class Written : std::uint8_t { kTriangles, kMesh };

}  // namespace polymorph
