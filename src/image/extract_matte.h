// Mattes of Cryptomatte images: the coverage of one name as a grey picture.
#pragma once

#include <string>

#include "base/result.h"
#include "image/image.h"

namespace polymorph {

/// Coverage of what is called `name` in a Cryptomatte with a manifest (specification 1.2.0, of this
/// or another program), in R, G and B. `name` is a name of one of its layers, or LAYER.NAME where
/// layers that have it differ, as in "crypto_object.teapot". `file` is used in messages. Errors:
/// kInput without a manifest or with a damaged one, kUsage for a name that no layer has (the
/// message lists them) or that is ambiguous.
Result<Image> extract_matte(const Image& image, const std::string& name, const std::string& file);

}  // namespace polymorph
