#include "analyze/frame_measures.h"

#include "analyze/measure.h"
#include "base/box.h"
#include "spheres/convex_hull.h"

namespace polymorph {

const std::vector<MeasureColumn>& measure_columns() {
  // Each of these makes a function that returns one member of a frame's measures as a number.
  const auto measure = [](auto member) {
    return [member](const FrameMeasures& row) {
      return std::optional<double>(static_cast<double>(row.*member));
    };
  };
  const auto surface = [](auto member) {
    return [member](const FrameMeasures& row) {
      return std::optional<double>(static_cast<double>(row.surface.*member));
    };
  };
  const auto roughness = [](auto member) {
    return [member](const FrameMeasures& row) {
      return std::optional<double>(static_cast<double>(row.roughness.*member));
    };
  };
  static const std::vector<MeasureColumn> table{
      {"volume", "volume", surface(&MeshReport::volume)},
      {"area", "area", surface(&MeshReport::area)},
      {"components", "parts", surface(&MeshReport::components)},
      {"genus", "genus", surface(&MeshReport::genus)},
      {"euler", "Euler characteristic", surface(&MeshReport::euler)},
      {"speed", "RMS step of the balls to the next frame", measure(&FrameMeasures::speed)},
      {"step", "chamfer distance to the next frame", measure(&FrameMeasures::step)},
      {"rate", "step over the change of eased time", measure(&FrameMeasures::rate)},
      {"farthest", "Hausdorff distance to the next frame", measure(&FrameMeasures::farthest)},
      {"bending", "bending energy (a sphere: 12.57)", measure(&FrameMeasures::bending)},
      {"tac", "total absolute curvature (a sphere: 1)", roughness(&Roughness::tac)},
      {"bumps", "domes with radii below 6 % of L, the diagonal of both objects' box",
       roughness(&Roughness::bumps)},
      {"groove", "% of the area in grooves with radii below 6 % of L",
       roughness(&Roughness::groove)},
      {"rho", "RMS distance from the solid smoothed by 2 % of L, in % of L",
       roughness(&Roughness::rho)},
      {"strain", "RMS of ln(distance of neighbouring balls / the interpolated one)",
       measure(&FrameMeasures::strain)},
      {"leakage", "volume outside the objects' hull", measure(&FrameMeasures::leakage)},
      {"hull", "volume of the convex hull", measure(&FrameMeasures::hull)},
      {"lowest", "height of the lowest point", measure(&FrameMeasures::lowest)},
      {"height", "height of the surface", measure(&FrameMeasures::height)},
      {"distortion", "mean ratio of the principal stretches since the first frame",
       [](const FrameMeasures& row) { return row.distortion; }},
      {"off_similarity", "Hausdorff distance from the moved source, over L",
       [](const FrameMeasures& row) { return row.off_similarity; }},
      {"vertices", "vertices", surface(&MeshReport::vertices)},
      {"triangles", "triangles", surface(&MeshReport::triangles)},
      {"open_edges", "open edges", surface(&MeshReport::open_edges)},
      {"flipped_edges", "flipped edges", surface(&MeshReport::flipped_edges)},
      {"pinched_vertices", "pinched vertices", surface(&MeshReport::pinched_vertices)},
  };
  return table;
}

FrameMeasures measure_frame(const MorphFrame& frame) {
  const Box box = bounding_box(frame.surface.positions);
  FrameMeasures row;
  row.time = frame.time;
  row.u = frame.u;
  row.surface = check_mesh(frame.surface);
  row.bending = bending_energy(frame.surface);
  row.hull = hull_volume(frame.surface.positions);
  row.lowest = box.empty() ? 0 : static_cast<double>(box.low.y);
  row.height = static_cast<double>(box.size().y);
  return row;
}

}  // namespace polymorph
