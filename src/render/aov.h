// Arbitrary output variables (AOVs): the image layers written beside the colour. CONTRIBUTING.md
// lists what a new one needs.
#pragma once

#include <string>
#include <vector>

#include "kernels/types.h"

namespace polymorph {

/// The first intersection of the ray through the pixel's centre; by default there is none. Values
/// are those of one surface, never averages over an edge.
struct FirstHit {
  float depth = 1e10f;  ///< distance along the view axis; 1e10 = no hit
  Vec3 normal;          ///< shading normal, world space
  float id = 0;         ///< RenderMesh::id; 1 = the floor, 0 = no hit
  Vec3 position;        ///< world space
  Vec3 next;            ///< position of the same surface point in the next frame
  Vec3 albedo;          ///< base colour with its texture
  Vec2 uv;              ///< texture coordinates
  Vec2 motion;          ///< pixels to the next frame, x to the right, y down; 0 in the last frame
  float progress = 0;   ///< progress of the morph (RenderMesh), [0, 1]; 0 on the floor
  float t = 0;          ///< time within the sequence, [0, 1]; 0 unless a mesh is hit
  float label = 0;      ///< label of the nearest vertex, from 1; 0 = none
};

/// A channel of an AOV.
struct Aov {
  const char* layer;  ///< name in image.aovs (scene.h lists them)
  const char* channel;
  float (*value)(const FirstHit&);  ///< reads the channel's value
};

inline constexpr Aov kAovs[] = {
    {"Z", "Z", [](const FirstHit& hit) { return hit.depth; }},
    {"N", "N.X", [](const FirstHit& hit) { return hit.normal.x; }},
    {"N", "N.Y", [](const FirstHit& hit) { return hit.normal.y; }},
    {"N", "N.Z", [](const FirstHit& hit) { return hit.normal.z; }},
    {"P", "P.X", [](const FirstHit& hit) { return hit.position.x; }},
    {"P", "P.Y", [](const FirstHit& hit) { return hit.position.y; }},
    {"P", "P.Z", [](const FirstHit& hit) { return hit.position.z; }},
    {"albedo", "albedo.R", [](const FirstHit& hit) { return hit.albedo.x; }},
    {"albedo", "albedo.G", [](const FirstHit& hit) { return hit.albedo.y; }},
    {"albedo", "albedo.B", [](const FirstHit& hit) { return hit.albedo.z; }},
    {"id", "id", [](const FirstHit& hit) { return hit.id; }},
    {"label", "label", [](const FirstHit& hit) { return hit.label; }},
    {"morph", "morph.blend", [](const FirstHit& hit) { return hit.progress; }},
    {"morph", "morph.t", [](const FirstHit& hit) { return hit.t; }},
    {"motion", "motion.X", [](const FirstHit& hit) { return hit.motion.x; }},
    {"motion", "motion.Y", [](const FirstHit& hit) { return hit.motion.y; }},
    {"uv", "uv.U", [](const FirstHit& hit) { return hit.uv.x; }},
    {"uv", "uv.V", [](const FirstHit& hit) { return hit.uv.y; }},
};

/// Selects the rows of kAovs whose layers the text `layers` lists ("Z,N,id", "all", "none"), in the
/// table's order.
std::vector<const Aov*> choose_aovs(const std::string& layers);

}  // namespace polymorph
