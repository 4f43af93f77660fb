// Removal of private parts of paths: folders that reveal whose machine a file comes from. They must
// not get into files that users pass on, such as frames.
#pragma once

#include <string>
#include <string_view>

namespace polymorph {

/// Tests whether this is the name of the user (USER, LOGNAME) or of the user's home folder (HOME).
bool is_private_folder(std::string_view name);

/// Removes the folders from the absolute paths in a text: "--set look=\"/home/ada/a.hdr\"" becomes
/// "--set look=\"a.hdr\"". The home folder itself becomes "~". Relative paths stay.
std::string remove_folders(std::string_view text);

}  // namespace polymorph
