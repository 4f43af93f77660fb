// C interface of polymorph_ocio.so, the only file that links OpenColorIO. It is plain C, so that
// neither side sees the other's C++ types.
#pragma once

#include <cstddef>

/// Version of this interface, incremented with every change; a module with another version is not
/// used.
#define PM_OCIO_INTERFACE 1

extern "C" {

/// A view of a display, ready to be applied; owned by the module until polymorph_ocio_close.
struct PmOcioView {
  const char* error;  ///< null, or the reason why there is no view
};

/// Types of the symbols, for dlsym.
using PmOcioInterfaceFunction = int();
/// Opens a view. `config` is the config's file. An empty `display` or `view` stands for the
/// config's default. Never returns null.
using PmOcioOpenFunction = PmOcioView*(const char* config, const char* display, const char* view);
/// Replaces `count` pixels (R, G, B in linear Rec. 709) by the display's codes, which are in [0, 1]
/// for colours that it can show. Returns null, or the reason of a failure, which is valid as long
/// as the view. Several threads may call it at once.
using PmOcioApplyFunction = const char*(PmOcioView* view, float* pixels, std::size_t count);
using PmOcioCloseFunction = void(PmOcioView*);

PmOcioInterfaceFunction polymorph_ocio_interface;
PmOcioOpenFunction polymorph_ocio_open;
PmOcioApplyFunction polymorph_ocio_apply;
PmOcioCloseFunction polymorph_ocio_close;

}  // extern "C"
