// Landmarks page: an HTML file on which a user clicks landmarks on the two objects of each leg,
// which are coloured by their correspondence (docs/interchange.md).
#pragma once

#include <string>
#include <vector>

#include "kernels/mesh.h"
#include "model/transform.h"

namespace polymorph {

/// Corresponding points on two objects, with a name.
struct NamedPair {
  std::string name;
  Vec3 from, to;  ///< positions in the coordinates of each object's file
};

/// An object of the scene.
struct LandmarksObject {
  std::string key;              ///< name in the scene's plan.landmarks
  Mesh mesh;                    ///< surface in scene coordinates
  Transform to_scene, to_file;  ///< file coordinates to scene coordinates, and the inverse
};

/// The morph from one object to the next.
struct LandmarksLeg {
  int from = 0, to = 0;                      ///< indices of the page's objects
  std::vector<Vec3> from_colors, to_colors;  ///< shown as they are, [0, 1]; one per point
  std::vector<NamedPair> landmarks;          ///< the scene's own landmarks
  std::vector<NamedPair> candidates;         ///< suggestions: corresponding tips of limbs
};

struct LandmarksPage {
  std::string title;
  std::vector<LandmarksObject> objects;
  std::vector<LandmarksLeg> legs;  ///< one or more
};

/// Encodes the page as HTML; meshes and colours are deflated.
std::string encode_landmarks_page(const LandmarksPage& page);

}  // namespace polymorph
