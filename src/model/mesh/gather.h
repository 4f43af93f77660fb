// Vertex clustering of models made of many long triangles, for what asks for their shape alone.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "model/model.h"

namespace polymorph {

/// A stand-in for a model: points and triangles only, each triangle once. With `times` of each it
/// has the model's winding number; without, its shape.
struct Gathered {
  Model model;
  std::vector<int> times;  ///< per triangle, 1 or more
  bool thinned = false;    ///< most of the long triangles are left out
};

/// How many triangles are longer than a 64th of the box's diagonal. Where they are more than
/// 16384 (usual models have some thousands at most), every question about a place concerns nearly
/// all of them, and n questions take n^2 steps.
std::size_t count_long_triangles(const Model& model);
bool has_many_long_triangles(std::size_t count);

/// A model of so many long triangles with its points gathered in cells of a 2048th of the diagonal,
/// or of up to eight times that until the long ones are few enough: triangles that lose their
/// extent go, and those that come to lie on their reverse; those that come to lie on each other
/// become one of several times. No point moves further than across its cell, so the winding number
/// of closed parts stays what it is at all points further away from them than that. Where that does
/// not help, as with triangles strewn at random, every n-th of the long ones stands for n. Nothing
/// for all other models.
std::optional<Gathered> gathered_if_long(const Model& model);

}  // namespace polymorph
