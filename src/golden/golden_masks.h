// Masks of golden suites: pixels of a frame that are not compared.
#pragma once

#include "base/result.h"
#include "compare/golden.h"
#include "image/image.h"

namespace polymorph {

/// Gives the masked pixels of `actual` the reference's values and returns their share, %. A pixel
/// of `actual` that no limit allows (NaN, infinite, negative alpha) keeps its values, so that it
/// fails under a mask as well. Images of different sizes or channels stay as they are. Errors:
/// kInput (a mask that cannot be read or has another size, a mask by ids without a layer `id`).
Result<double> hide_masked(const GoldenSuite& suite, const Image& reference, Image& actual);

}  // namespace polymorph
