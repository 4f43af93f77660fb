// Error and warning handlers for libpng.
#pragma once

#include <png.h>

#include <string>

namespace polymorph {

/// Stores libpng's message in the std::string that the error pointer points to, and jumps back to
/// the setjmp() of the caller.
inline void store_png_error(png_structp png, png_const_charp text) {
  *static_cast<std::string*>(png_get_error_ptr(png)) = text;
  png_longjmp(png, 1);
}

inline void ignore_png_warning(png_structp, png_const_charp) {}

}  // namespace polymorph
