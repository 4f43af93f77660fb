#include "render/path/shadow_rays.h"

#include <algorithm>
#include <cstring>

namespace polymorph {

void ShadowRays::add(const RayOf<Pack3>& ray, const Pack3& light, PackBits path, PackMask lanes) {
  const PackMask misses_floor = intersect_floor(world_.floor, ray) == kInfinity;
  std::uint32_t bits = Lanes<Pack>::bits(lanes & misses_floor & !is_black(light));
  if (bits == 0) return;
  if (count_ >= kPacket) {
    trace(0, kPacket);
    std::copy(rows_.begin() + kPacket, rows_.begin() + count_, rows_.begin());
    count_ -= kPacket;
  }
  static_assert(sizeof(Row) == 16 * sizeof(float));
  Pack columns[16] = {ray.origin.x,    ray.origin.y,    ray.origin.z, ray.direction.x,
                      ray.direction.y, ray.direction.z, ray.time,     ray.far,
                      light.x,         light.y,         light.z,      float_from_bits(path)};
  Row rows[kLanes];
  float* starts[kLanes];
  for (int l = 0; l < kLanes; ++l) starts[l] = &rows[l].ray.origin.x;
  store_rows<16>(columns, starts);
  for (; bits != 0; bits &= bits - 1) rows_[count_++] = rows[countr_zero(bits)];
}

void ShadowRays::flush() {
  for (int first = 0; first < count_; first += kPacket)
    trace(first, std::min(kPacket, count_ - first));
  count_ = 0;
}

void ShadowRays::trace(int first, int count) {
  if (world_.has_glass) {
    for (int i = first; i < first + count; ++i) {
      const Row& row = rows_[i];
      direct_[row.path] =
          direct_[row.path] +
          row.light * trace_transmittance(world_, *world_.geometry, row.ray, stats_);
    }
    return;
  }
  RayOf<Pack3> rays[2];
  for (int k = 0; k < count; k += kLanes) {
    const float* starts[kLanes];
    for (int l = 0; l < kLanes; ++l)
      starts[l] = &rows_[first + std::min(k + l, count - 1)].ray.origin.x;
    Pack columns[8];  // the first eight floats of a Row are its ray
    load_rows<8>(starts, columns);
    std::memcpy(&rays[k / kLanes], columns, sizeof columns);
  }
  stats_.rays += static_cast<std::uint64_t>(count);
  const std::uint32_t occluded = world_.geometry->test_occlusion(rays, count);
  for (int i = 0; i < count; ++i) {
    const Row& row = rows_[first + i];
    if (!((occluded >> i) & 1)) direct_[row.path] = direct_[row.path] + row.light;
  }
}

}  // namespace polymorph
