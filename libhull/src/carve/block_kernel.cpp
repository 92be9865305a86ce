#include "block_kernel.h"

#include <algorithm>
#include <cmath>
#include <limits>

#ifdef __AVX2__
#include <immintrin.h>
#endif

namespace lumihull::hull {

BlockView::BlockView(const ProjectedView& v, double voxel) : view(&v), scale(float(v.field->quantum)) {
  const auto fill = [&](int row, std::array<float, 8>& lanes, std::array<float, 8>& rows) {
    const double x = v.m(row, 0) * voxel, y = v.m(row, 1) * voxel, z = v.m(row, 2) * voxel;
    for (int i = 0; i < 8; ++i) {
      lanes[std::size_t(i)] = float((i % 4) * x + (i / 4) * y);
      rows[std::size_t(i)] = float((i % 2) * 2 * y + (i / 2) * z);
    }
  };
  fill(0, lane_u, row_u);
  fill(1, lane_v, row_v);
  fill(2, lane_z, row_z);
  // u = U · (1 / Z): U and Z are each rounded three times (first sample, lane, row), then the reciprocal and the
  // product: less than 9 · 2^-24 of u, which is at most the field's width. The field changes by at most one cell a cell
  // along each axis.
  const double cells = std::max(v.field->cells_x(), v.field->cells_y());
  error = (2 * 6e-7 * cells + 2e-5) * v.field->cell;
  beyond = before = 0;
  for (int axis = 0; axis < 3; ++axis) {
    beyond += std::max(0.0, 3 * v.m(2, axis) * voxel);
    before += std::max(0.0, -3 * v.m(2, axis) * voxel);
  }
}

std::uint8_t bound(const ProjectedView& view, const Eigen::Vector3d& center, const Eigen::Vector3d& half) {
  const Eigen::Vector3d c = view.m.leftCols<3>() * center + view.m.col(3);
  float u0, u1, v0, v1;
#ifdef __AVX2__
  const __m256 sx = _mm256_setr_ps(-1, 1, -1, 1, -1, 1, -1, 1), sy = _mm256_setr_ps(-1, -1, 1, 1, -1, -1, 1, 1),
               sz = _mm256_setr_ps(-1, -1, -1, -1, 1, 1, 1, 1);
  const auto corners = [&](int row) {
    __m256 r = _mm256_set1_ps(float(c[row]));
    r = _mm256_add_ps(r, _mm256_mul_ps(sx, _mm256_set1_ps(float(view.m(row, 0) * half[0]))));
    r = _mm256_add_ps(r, _mm256_mul_ps(sy, _mm256_set1_ps(float(view.m(row, 1) * half[1]))));
    return _mm256_add_ps(r, _mm256_mul_ps(sz, _mm256_set1_ps(float(view.m(row, 2) * half[2]))));
  };
  const auto least = [](__m256 a) {
    __m128 b = _mm_min_ps(_mm256_castps256_ps128(a), _mm256_extractf128_ps(a, 1));
    b = _mm_min_ps(b, _mm_movehl_ps(b, b));
    return _mm_cvtss_f32(_mm_min_ss(b, _mm_movehdup_ps(b)));
  };
  const __m256 minus = _mm256_set1_ps(-0.0f);
  const auto most = [&](__m256 a) { return -least(_mm256_xor_ps(a, minus)); };
  const __m256 z = corners(2);
  const float z0 = least(z), z1 = most(z);
#else
  float corner[3][8];
  for (int row = 0; row < 3; ++row)
    for (int i = 0; i < 8; ++i) {
      float r = float(c[row]);
      for (int axis = 0; axis < 3; ++axis) r += (i >> axis & 1 ? 1 : -1) * float(view.m(row, axis) * half[axis]);
      corner[row][i] = r;
    }
  const float z0 = *std::min_element(corner[2], corner[2] + 8), z1 = *std::max_element(corner[2], corner[2] + 8);
#endif
  if (z1 < -1e-5f * std::abs(z0)) return kNotSeen;  // rounding of z, generously
  // Rounding of u and v grows with the ratio of the depths; a box so near to the camera is not bounded.
  if (!(z0 > 0.25f * z1)) return 0;
#ifdef __AVX2__
  const __m256 u = _mm256_div_ps(corners(0), z), v = _mm256_div_ps(corners(1), z);
  u0 = least(u), u1 = most(u), v0 = least(v), v1 = most(v);
#else
  u0 = v0 = std::numeric_limits<float>::infinity(), u1 = v1 = -u0;
  for (int i = 0; i < 8; ++i) {
    const float u = corner[0][i] / corner[2][i], v = corner[1][i] / corner[2][i];
    u0 = std::min(u0, u), u1 = std::max(u1, u), v0 = std::min(v0, v), v1 = std::max(v1, v);
  }
#endif
  const auto low = [](float a) { return int(std::floor(std::clamp(a - 0.02f - 1e-6f * std::abs(a), -1e8f, 1e8f))); };
  const auto high = [](float a) { return int(std::floor(std::clamp(a + 0.02f + 1e-6f * std::abs(a), -1e8f, 1e8f))); };
  return view.field->query(low(u0), low(v0), high(u1), high(v1));
}

double merge(const BlockView& block_view, const Eigen::Vector3d& first, Top& top) {
  const ProjectedView& view = *block_view.view;
  const Silhouette::Data& field = *view.field;
  const Eigen::Vector3d base = view.m.leftCols<3>() * first + view.m.col(3);
  const float bu = float(base[0]), bv = float(base[1]), bz = float(base[2]);
  const std::size_t m = top.size();
  const std::int16_t* const samples = field.tiles[0].samples.data();
#ifdef __AVX2__
  const __m256 base_u = _mm256_add_ps(_mm256_set1_ps(bu), _mm256_load_ps(block_view.lane_u.data()));
  const __m256 base_v = _mm256_add_ps(_mm256_set1_ps(bv), _mm256_load_ps(block_view.lane_v.data()));
  const __m256 base_z = _mm256_add_ps(_mm256_set1_ps(bz), _mm256_load_ps(block_view.lane_z.data()));
  const __m256i tiles_x = _mm256_set1_epi32(field.tiles_x);
  const __m256 scale = _mm256_set1_ps(block_view.scale);
  for (std::size_t r = 0; r < 8; ++r) {
    const __m256 z = _mm256_add_ps(base_z, _mm256_set1_ps(block_view.row_z[r]));
    const __m256 inverse = _mm256_div_ps(_mm256_set1_ps(1), z);
    const __m256 u = _mm256_mul_ps(_mm256_add_ps(base_u, _mm256_set1_ps(block_view.row_u[r])), inverse);
    const __m256 v = _mm256_mul_ps(_mm256_add_ps(base_v, _mm256_set1_ps(block_view.row_v[r])), inverse);
    const __m256i iu = _mm256_cvttps_epi32(u), iv = _mm256_cvttps_epi32(v);
    const __m256 fu = _mm256_sub_ps(u, _mm256_cvtepi32_ps(iu)), fv = _mm256_sub_ps(v, _mm256_cvtepi32_ps(iv));
    const __m256i entry =
        _mm256_add_epi32(_mm256_mullo_epi32(_mm256_srli_epi32(iv, 3), tiles_x), _mm256_srli_epi32(iu, 3));
    const __m256i tile = _mm256_i32gather_epi32(field.directory.data(), entry, 4);
    const __m256i seven = _mm256_set1_epi32(7);
    const __m256i x = _mm256_and_si256(iu, seven), y = _mm256_and_si256(iv, seven);
    const __m256i at = _mm256_add_epi32(_mm256_mullo_epi32(tile, _mm256_set1_epi32(kTileStride)),
                                        _mm256_add_epi32(_mm256_add_epi32(_mm256_slli_epi32(y, 3), y), x));
    const __m256i upper = _mm256_i32gather_epi32(reinterpret_cast<const int*>(samples), at, 2);
    const __m256i lower = _mm256_i32gather_epi32(reinterpret_cast<const int*>(samples + kTileSamples), at, 2);
    const auto left = [](__m256i pair) {
      return _mm256_cvtepi32_ps(_mm256_srai_epi32(_mm256_slli_epi32(pair, 16), 16));
    };
    const auto right = [](__m256i pair) { return _mm256_cvtepi32_ps(_mm256_srai_epi32(pair, 16)); };
    const __m256 a = left(upper), c = left(lower);
    const __m256 p = _mm256_add_ps(a, _mm256_mul_ps(fu, _mm256_sub_ps(right(upper), a)));
    const __m256 q = _mm256_add_ps(c, _mm256_mul_ps(fu, _mm256_sub_ps(right(lower), c)));
    const __m256 s = _mm256_add_ps(p, _mm256_mul_ps(fv, _mm256_sub_ps(q, p)));
    __m256 phi = _mm256_mul_ps(_mm256_mul_ps(s, scale), z);
    if (m > 1 && _mm256_movemask_ps(_mm256_cmp_ps(phi, _mm256_loadu_ps(&top[m - 1][8 * r]), _CMP_GT_OQ)) == 0) continue;
    for (std::size_t rank = 0; rank < m; ++rank) {
      float* const best = &top[rank][8 * r];
      const __m256 old = _mm256_loadu_ps(best);
      _mm256_storeu_ps(best, _mm256_max_ps(old, phi));
      phi = _mm256_min_ps(old, phi);
    }
  }
#else
  for (std::size_t r = 0; r < 8; ++r)
    for (std::size_t lane = 0; lane < 8; ++lane) {
      const float z = (bz + block_view.lane_z[lane]) + block_view.row_z[r];
      const float inverse = 1 / z;
      const float u = ((bu + block_view.lane_u[lane]) + block_view.row_u[r]) * inverse;
      const float v = ((bv + block_view.lane_v[lane]) + block_view.row_v[r]) * inverse;
      const int iu = int(u), iv = int(v);
      const float fu = u - float(iu), fv = v - float(iv);
      const std::int32_t tile =
          field.directory[std::size_t(iv / kTile) * std::size_t(field.tiles_x) + std::size_t(iu / kTile)];
      const std::int16_t* t =
          samples + std::size_t(tile) * kTileStride + std::size_t(iv % kTile) * kTileSamples + iu % kTile;
      const float a = t[0], c = t[kTileSamples];
      const float p = a + fu * (float(t[1]) - a), q = c + fu * (float(t[kTileSamples + 1]) - c);
      float phi = ((p + fv * (q - p)) * block_view.scale) * z;
      for (std::size_t rank = 0; rank < m; ++rank) {
        float& best = top[rank][8 * r + lane];
        const float old = best;
        best = std::max(old, phi);
        phi = std::min(old, phi);
      }
    }
#endif
  // U and Z are rounded as the leaf's farthest sample has them, and divided by the nearest one's Z.
  const double far = base[2] + block_view.beyond, near = base[2] - block_view.before;
  return near > 0 ? block_view.error * far * (far / near) : std::numeric_limits<double>::infinity();
}

}  // namespace lumihull::hull
