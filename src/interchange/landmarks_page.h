// A page on which landmarks are clicked: both objects of each leg beside each other, coloured by
// which becomes which (docs/interchange.md).
#pragma once

#include <map>
#include <string>
#include <vector>

#include "kernels/mesh.h"
#include "model/transform.h"

namespace polymorph {

/// A point of two objects, by name.
struct NamedPair {
  std::string name;
  Vec3 from, to;  ///< places in each file's coordinates
};

struct LandmarksObject {
  std::string key;  ///< name in plan.landmarks
  Mesh mesh;        ///< surface in the scene
  Transform to_scene, to_file;
};

struct LandmarksLeg {
  int from = 0, to = 0;                      ///< indices of the page's objects
  std::vector<Vec3> from_colors, to_colors;  ///< [0, 1], one per point of each mesh
  std::vector<NamedPair> landmarks;          ///< the scene's own landmarks
  std::vector<NamedPair> candidates;         ///< tips of limbs that become each other
};

struct LandmarksPage {
  std::string title;
  std::vector<LandmarksObject> objects;
  std::vector<LandmarksLeg> legs;  ///< one or more
};

/// Encodes the whole page; meshes are deflated.
std::string encode_landmarks_page(const LandmarksPage& page);

}  // namespace polymorph
