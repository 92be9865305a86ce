#include "square_quads.h"

#include <apriltag/apriltag.h>
#include <lumihull/base/error.h>

#include <algorithm>
#include <cmath>
#include <new>

namespace lumihull::calib {
namespace {

/// The cells of a family's id between the borders in libapriltag's order: a quarter of them row by row, then the quarters
/// that it becomes when turned, then the middle one. Turning a code is then a rotation of its bits.
std::vector<std::array<std::uint32_t, 2>> bit_places(int cells) {
  std::vector<std::array<std::uint32_t, 2>> places;
  for (int turn = 0; turn < 4; ++turn)
    for (int y = 0; y < cells / 2; ++y)
      for (int x = 0; x < (cells + 1) / 2; ++x) {
        int u = x, v = y;
        for (int i = 0; i < turn; ++i) {
          const int turned = cells - 1 - v;
          v = u, u = turned;
        }
        places.push_back({std::uint32_t(u + 1), std::uint32_t(v + 1)});
      }
  if (cells % 2 == 1) places.push_back({std::uint32_t(cells / 2 + 1), std::uint32_t(cells / 2 + 1)});
  return places;
}

/// A family as libapriltag's table, and its index for fast reading, which is made once.
struct Table {
  std::vector<std::uint64_t> codes;
  std::vector<int> ids;
  std::vector<std::uint32_t> x, y;
  std::string name;
  apriltag_family_t family{};

  explicit Table(const TargetFamily& source) : name(source.name()) {
    const int grid = source.grid(), cells = grid - 2;
    const auto places = bit_places(cells);
    for (const auto& place : places) x.push_back(place[0]), y.push_back(place[1]);
    for (const int id : source.ids()) {
      const std::vector<Cell> target = source.cells(id);
      std::uint64_t code = 0;
      for (const auto& place : places)
        code = code << 1 | (target[place[1] * std::size_t(grid) + place[0]] == Cell::light ? 1u : 0u);
      codes.push_back(code);
      ids.push_back(id);
    }
    family.ncodes = std::uint32_t(codes.size());
    family.codes = codes.data();
    family.width_at_border = grid;
    family.total_width = grid + 2;
    family.nbits = std::uint32_t(places.size());
    family.bit_x = x.data(), family.bit_y = y.data();
    family.h = std::uint32_t(std::max(1, source.minimum_distance()));
    family.name = name.data();
  }
  Table(const Table&) = delete;
  Table& operator=(const Table&) = delete;
};

struct DetectorDeleter {
  void operator()(apriltag_detector_t* detector) const { apriltag_detector_destroy(detector); }
};
using Detector = std::unique_ptr<apriltag_detector_t, DetectorDeleter>;

Detector make_detector() {
  Detector detector(apriltag_detector_create());
  if (!detector) throw std::bad_alloc();
  detector->nthreads = 1;
  return detector;
}

/// How many wrong bits the index may hold: its size is one entry for each word within reach.
int index_bits(const TargetFamily& family) {
  const double bits = (family.grid() - 2) * (family.grid() - 2), codes = double(family.ids().size());
  const int most = std::min(2, correctable_cells(family));
  return most == 2 && codes * (1 + bits + bits * (bits - 1) / 2) > 5e5 ? 1 : most;
}

}  // namespace

struct SquareFinder::Impl {
  std::vector<std::unique_ptr<Table>> tables;
  Detector owner = make_detector();  // of the tables' indices: goes before them
};

SquareFinder::SquareFinder(const std::vector<TargetFamily>& families) {
  auto impl = std::make_unique<Impl>();
  for (const TargetFamily& family : families) {
    if (family.kind() != TargetKind::square || family.ids().size() > 65535 || (family.grid() - 2) > 8)
      throw Error(ErrorCode::unsupported, "is no family of squares that can be looked for", family.name());
    impl->tables.push_back(std::make_unique<Table>(family));
    apriltag_detector_add_family_bits(impl->owner.get(), &impl->tables.back()->family, index_bits(family));
  }
  impl_ = std::move(impl);
}
SquareFinder::SquareFinder(SquareFinder&&) noexcept = default;
SquareFinder::~SquareFinder() = default;

std::vector<SquareQuad> SquareFinder::find(const Image& grey, double decimate) const {
  std::vector<SquareQuad> quads;
  if (grey.width() / decimate < 8 || grey.height() / decimate < 8 || impl_->tables.empty()) return quads;
  // libapriltag's detector changes while it works, and frees its families' indices: each search has its own detector, and
  // copies of the families that only refer to the indices.
  std::vector<apriltag_family_t> families;
  for (const auto& table : impl_->tables) families.push_back(table->family);
  struct Search {
    Detector detector = make_detector();
    std::vector<apriltag_family_t>& copies;
    ~Search() {
      for (apriltag_family_t& f : copies) f.impl = nullptr;
    }
  } search{make_detector(), families};
  search.detector->quad_decimate = float(decimate);
  for (apriltag_family_t& f : families) apriltag_detector_add_family_bits(search.detector.get(), &f, 0);

  // Not written to: decimation copies, and nothing is blurred.
  image_u8_t picture = {grey.width(), grey.height(), grey.width(),
                        reinterpret_cast<std::uint8_t*>(const_cast<std::byte*>(grey.data()))};
  zarray_t* found = apriltag_detector_detect(search.detector.get(), &picture);
  for (int i = 0; i < zarray_size(found); ++i) {
    const apriltag_detection_t* d = nullptr;
    zarray_get(found, i, &d);
    SquareQuad quad;
    quad.family = int(std::find_if(families.begin(), families.end(), [&](const auto& f) { return &f == d->family; }) -
                      families.begin());
    quad.id = impl_->tables[std::size_t(quad.family)]->ids[std::size_t(d->id)];
    double area = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      quad.corners[k] = {d->p[k][0], d->p[k][1]};
      area += d->p[k][0] * d->p[(k + 1) % 4][1] - d->p[(k + 1) % 4][0] * d->p[k][1];
    }
    if (area < 0) std::reverse(quad.corners.begin(), quad.corners.end());  // y runs down: clockwise has area > 0
    const bool finite = std::all_of(quad.corners.begin(), quad.corners.end(), [](const auto& p) { return p.allFinite(); });
    if (finite) quads.push_back(quad);
  }
  apriltag_detections_destroy(found);
  return quads;
}

int correctable_cells(const TargetFamily& family) {
  const int bits = (family.grid() - 2) * (family.grid() - 2);
  const int most = (family.minimum_distance() - 1) / 2;
  double words = 1, ball = 1;  // words at exactly, and at up to, this distance
  int correct = 0;
  for (int t = 1; t <= most; ++t) {
    words *= double(bits - t + 1) / t;
    ball += words;
    if (4 * double(family.ids().size()) * ball / std::pow(2.0, bits) > 1e-3) break;
    correct = t;
  }
  return std::max(0, correct);
}

}  // namespace lumihull::calib
