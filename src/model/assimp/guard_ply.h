// Guard of binary PLY files. Where the first byte of the data is that of a line feed, as in about
// one of 256 files, Assimp 5.2 takes it for a part of the header, and reads all that follows from
// the wrong place.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

/// Finds where the data of a PLY file begins, if its first byte is a line feed. `bytes`: the file,
/// or enough of it to have its header.
std::optional<std::size_t> find_mistaken_data(std::string_view bytes);

/// Adds a property of one byte before the others of the first element of a binary PLY file whose
/// data begins with a line feed; other files stay as they are.
std::string guard_ply(std::string file);
