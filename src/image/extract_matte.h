// Mattes of Cryptomatte images: the coverage of one name as a grey picture.
#pragma once

#include <string>

#include "base/result.h"
#include "image/image.h"

namespace polymorph {

/// Extracts the matte called `name` from a Cryptomatte with a manifest (specification 1.2.0,
/// written by this or another program): its coverage in R, G and B. `name` is a name in one of the
/// manifests, or LAYER.NAME, as in "crypto_object.teapot", if several layers have different mattes
/// of this name. `file` is the name used in messages. Errors: kInput if the manifest is missing or
/// damaged, kUsage if no layer has the name (the message lists all names) or if it is ambiguous.
Result<Image> extract_matte(const Image& image, const std::string& name, const std::string& file);

}  // namespace polymorph
