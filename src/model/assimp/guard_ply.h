// Workaround for binary PLY files in Assimp 5.2: where the first byte of the data is a line feed,
// as in about one of 256 files, Assimp takes it for a part of the header and reads all data from
// the wrong offset.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

/// Finds the offset of the data of a PLY file if the first byte of the data is a line feed; else
/// nothing. `bytes`: the file, or enough of it to contain its header.
std::optional<std::size_t> find_line_feed_data(std::string_view bytes);

/// Inserts a property of one byte before the others of the first element of a binary PLY file, so
/// that its data begins with another byte than a line feed. Returns all other files unchanged.
std::string guard_ply(std::string file);
