// Protocol between polymorph and polymorph_assimp, the only program that links Assimp:
// kImportHello, then records, each "KIND NAME_SIZE SIZE\n", its name and its bytes; the last is
// "end". Kinds: obj, mtl (once each); texture (embedded, named as in map_Kd); input (a file that
// was read); warning, error (the name is the message).
#pragma once

#include <string>

namespace polymorph {

/// Protocol version; incremented with every change of the protocol.
inline constexpr const char* kImportHello = "polymorph import 1\n";

/// Name of an embedded texture in the MTL.
inline std::string embedded_name(unsigned index) { return "embedded-" + std::to_string(index); }

}  // namespace polymorph
