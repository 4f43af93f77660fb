// Vertex clustering of models made of many long triangles, for what asks for their shape alone.
#pragma once

#include <optional>

#include "model/model.h"

namespace polymorph {

/// Where more than 16384 of the triangles are longer than a 64th of the box's diagonal (a fan of
/// 200 000; usual models have some thousands at most), every question about a place concerns nearly
/// all of them, and n questions take n^2 steps. This is such a model with its points gathered in
/// cells of a 2048th of the diagonal: triangles that lose their extent go, and those that come to
/// lie on their reverse. No point moves further than across its cell, so the winding number of
/// closed parts stays what it is at all points further away from them than that. Points and
/// triangles only. Nothing for all other models.
std::optional<Model> gathered_if_long(const Model& model);

}  // namespace polymorph
