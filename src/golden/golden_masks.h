// Masks of golden suites: pixels of a frame that are not compared.
#pragma once

#include "base/result.h"
#include "compare/golden.h"
#include "image/image.h"

namespace polymorph {

/// Replaces the masked pixels of `actual` by those of `reference`, so that a comparison finds them
/// equal. Returns the percentage of masked pixels. Masked pixels with invalid values (NaN,
/// infinite, negative alpha) stay, so that they fail. Does nothing, and returns 0, if the images
/// differ in size or channels. Errors: kInput (a mask that cannot be read or has another size, a
/// mask by ids without a layer `id`).
Result<double> replace_masked_pixels(const GoldenSuite& suite, const Image& reference,
                                     Image& actual);

}  // namespace polymorph
