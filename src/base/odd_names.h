// Names with line breaks or tabs, remembered so that messages can show '?' for these characters.
#pragma once

#include <string>
#include <string_view>

namespace polymorph {

/// Remembers a name from the command line, a scene or a directory listing, for instance a path, if
/// it contains line breaks or tabs: stores the components between separators such as '/' and ','
/// that contain them. Ignores components that consist only of line breaks and tabs, because they
/// would match the end of every line.
void remember_name(std::string_view name);

/// Replaces the line breaks and tabs of remembered names in `text` by '?'. Other line breaks stay,
/// since a message may have several lines.
std::string replace_breaks_of_names(std::string_view text);

}  // namespace polymorph
