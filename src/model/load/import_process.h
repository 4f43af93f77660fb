// Protocol between polymorph and polymorph_assimp, the only program that links Assimp. The
// arguments of polymorph_assimp are the model, the bytes of memory that both programs may take for
// it, and, for a pose of an animated model, the time in seconds and the indices of the active
// animations. Its output is kImportHello, followed by records. Each record is a line "KIND
// NAME_SIZE SIZE\n", a name and SIZE bytes; the last record is "end". Kinds: obj, mtl (once each);
// texture (embedded, named as in map_Kd); input (a file that was read); warning, error (the name is
// the message); large (an error: the model needs too much memory).
#pragma once

#include <string>

namespace polymorph {

/// Protocol version; incremented with every change of the protocol.
inline constexpr const char* kImportHello = "polymorph import 3\n";

/// Peak memory in bytes of OBJ text and the model made of it, per byte of text. Measured: 6.4 for
/// twelve million faces read by Assimp.
inline constexpr double kModelBytesPerTextByte = 7;

/// Name of an embedded texture in the MTL.
inline std::string embedded_name(unsigned index) { return "embedded-" + std::to_string(index); }

}  // namespace polymorph
