// Protocol between polymorph and polymorph_assimp, the only program that links Assimp:
// kImportHello, then pieces, each "KIND NAME_SIZE SIZE\n", its name and its bytes, the last one
// "end". Kinds: obj, mtl (once each); texture (embedded, named as map_Kd names it); input (a file
// that was read); warning, error (what it is stands in the name).
#pragma once

#include <string>

namespace polymorph {

/// Another number whenever anything of this changes.
inline constexpr const char* kImportHello = "polymorph import 1\n";

inline std::string embedded_name(unsigned index) { return "embedded-" + std::to_string(index); }

}  // namespace polymorph
