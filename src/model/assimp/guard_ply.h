// Guard of binary PLY files. Assimp 5.2 takes the first byte of the data for an empty line of the
// header where it is that of a line's end, as in one of 256 files, and reads all that follows from
// the wrong place.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

/// Finds the data of a PLY file that begins as a line's end. `bytes`: the file, or enough of it to
/// have its header.
std::optional<std::size_t> find_mistaken_data(std::string_view bytes);

/// Adds a property of one byte before the others of the first element of a binary PLY file whose
/// data begins as a line's end; other files stay as they are.
std::string guard_ply(std::string file);
