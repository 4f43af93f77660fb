#pragma once

#include <png.h>

#include <string>

namespace polymorph {

/// libpng's error handler: the message is kept in the std::string that is the error pointer, and
/// the call that set the jump point returns.
inline void keep_png_error(png_structp png, png_const_charp text) {
  *static_cast<std::string*>(png_get_error_ptr(png)) = text;
  png_longjmp(png, 1);
}

inline void ignore_png_warning(png_structp, png_const_charp) {}

}  // namespace polymorph
