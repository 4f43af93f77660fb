// Names from outside that hold line breaks or tabs, so that messages are not torn by them.
#pragma once

#include <string>
#include <string_view>

namespace polymorph {

/// Remembers a name from the command line, a scene or a folder's listing, a path for instance.
/// Most hold no line breaks, and are forgotten at once, as are parts of paths that are nothing but
/// breaks: every line would end in one.
void remember_name(std::string_view name);

/// `text` with a '?' for each line break and tab of remembered names. Its own stay: a message may
/// have several lines.
std::string without_breaks_of_names(std::string_view text);

}  // namespace polymorph
