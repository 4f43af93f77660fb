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

/// The symbols' types, for dlsym.
using PmOcioInterfaceFunction = int();
/// `config`: its file. An empty `display` or `view` is the config's default. Never null.
using PmOcioOpenFunction = PmOcioView*(const char* config, const char* display, const char* view);
/// Replaces `count` pixels R, G, B, linear Rec. 709, by the codes that the display is sent, [0, 1]
/// for those that it can show. Null, or the reason why not, which lives as long as the view. Safe
/// from several threads.
using PmOcioApplyFunction = const char*(PmOcioView* view, float* pixels, std::size_t count);
using PmOcioCloseFunction = void(PmOcioView*);

PmOcioInterfaceFunction polymorph_ocio_interface;
PmOcioOpenFunction polymorph_ocio_open;
PmOcioApplyFunction polymorph_ocio_apply;
PmOcioCloseFunction polymorph_ocio_close;

}  // extern "C"
