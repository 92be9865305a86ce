#include "cell_outlines.h"

#include <map>
#include <tuple>

namespace lumihull::calib {

std::vector<std::vector<Eigen::Vector2i>> dark_outlines(const std::vector<Cell>& cells, int grid) {
  const auto dark = [&](int x, int y) {
    return x >= 0 && y >= 0 && x < grid && y < grid && cells[std::size_t(y * grid + x)] == Cell::dark;
  };
  // Unit edges with the dark cell on their right hand, by where they start: (x, y, direction), 0 = right, clockwise on.
  static constexpr int kStep[4][2] = {{1, 0}, {0, 1}, {-1, 0}, {0, -1}};
  std::map<std::tuple<int, int, int>, bool> edges;  // -> walked
  for (int y = 0; y <= grid; ++y)
    for (int x = 0; x <= grid; ++x) {
      if (dark(x, y) != dark(x, y - 1)) dark(x, y) ? edges[{x, y, 0}] : edges[{x + 1, y, 2}];
      if (dark(x, y) != dark(x - 1, y)) dark(x, y) ? edges[{x, y + 1, 3}] : edges[{x, y, 1}];
    }
  std::vector<std::vector<Eigen::Vector2i>> outlines;
  for (auto& [start, walked] : edges) {
    if (walked) continue;
    auto [x, y, direction] = start;
    std::vector<Eigen::Vector2i> outline;
    while (!edges.at({x, y, direction})) {
      edges.at({x, y, direction}) = true;
      x += kStep[direction][0];
      y += kStep[direction][1];
      // To the right first: where dark cells meet at a corner alone, each keeps its own outline.
      for (const int turn : {1, 0, 3}) {
        const int next = (direction + turn) % 4;
        if (!edges.contains({x, y, next})) continue;
        if (next != direction) outline.emplace_back(x, y);
        direction = next;
        break;
      }
    }
    outlines.push_back(std::move(outline));
  }
  return outlines;
}

}  // namespace lumihull::calib
