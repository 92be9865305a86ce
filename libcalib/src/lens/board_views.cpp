#include <lumihull/calib/board_views.h>

namespace lumihull::calib {
namespace {

void add_target(const TargetDesign& design, const Detection& found, const Pose& board_from_target, BoardView& view) {
  for (const Feature& feature : found.features) {
    BoardMatch match;
    match.pixel = feature.pixel;
    match.covariance = feature.covariance;
    const Eigen::Vector2d place = design.feature(feature.index);
    match.board = board_from_target * Eigen::Vector3d(place.x(), place.y(), 0);
    if (design.family.kind() == TargetKind::circles) {
      match.radius = design.circle_radius_m();
      match.normal = board_from_target.rotation * Eigen::Vector3d::UnitZ();
    }
    view.matches.push_back(match);
  }
}

}  // namespace

std::vector<BoardView> board_views(const TargetSet& set, const Detections& found, const std::string& photo) {
  std::vector<BoardView> views;
  for (const Board& board : set.boards) {
    BoardView view;
    view.name = board.name;
    for (const Detection& target : found.targets)
      for (const BoardTarget& known : board.targets)
        if (known.design == target.design && known.id == target.id)
          add_target(set.designs.at(std::size_t(target.design)), target, known.board_from_target, view);
    if (!view.matches.empty()) views.push_back(std::move(view));
  }
  if (set.boards.empty())
    for (const Detection& target : found.targets) {
      if (target.id < 0) continue;
      const TargetDesign& design = set.designs.at(std::size_t(target.design));
      BoardView& view = views.emplace_back();
      view.name = design.family.name() + " " + std::to_string(target.id);
      add_target(design, target, Pose{}, view);
    }
  for (BoardView& view : views) view.name = set.boards.size() == 1 ? photo : photo + ": " + view.name;
  return views;
}

BoardView grid_view(const PointGrid& grid, const Detection& found, const std::string& photo) {
  BoardView view;
  view.name = photo;
  for (const Feature& feature : found.features) {
    BoardMatch match;
    match.pixel = feature.pixel;
    match.covariance = feature.covariance;
    const Eigen::Vector2d place = grid.point(feature.index);
    match.board = {place.x(), place.y(), 0};
    if (grid.kind == PointGrid::Kind::circles) match.radius = grid.circle_radius_m();
    view.matches.push_back(match);
  }
  return view;
}

}  // namespace lumihull::calib
