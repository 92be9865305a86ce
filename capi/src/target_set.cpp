#include <lumihull/calib/target_set.h>

#include "arguments.h"
#include "context.h"
#include "handles.h"
#include "target_structs.h"

using namespace lumihull;
using namespace lumihull::capi;
using calib::Cell;
using calib::TargetFamily;
using calib::TargetKind;
using calib::TargetSet;

static_assert(int(Cell::dark) == LH_CELL_DARK && int(Cell::light) == LH_CELL_LIGHT &&
                  int(Cell::unknown) == LH_CELL_UNKNOWN && int(TargetKind::circles) == LH_TARGETS_CIRCLES &&
                  int(TargetKind::square) == LH_TARGETS_SQUARES,
              "the same numbers on both sides");

namespace {

TargetFamily family_of(const char* name) { return TargetFamily::by_name(text(name, "family")); }

const TargetSet& value(const lh_target_set* set) { return given(set, "set").value; }

template <class Item>
const Item& item(const std::vector<Item>& items, size_t i, const char* name) {
  return items[index(i, items.size(), name)];
}

}  // namespace

lh_status lh_target_families(lh_context* ctx, char* buffer, size_t size, size_t* needed) {
  return guarded(ctx, [&] {
    std::string names;
    for (const std::string& name : TargetFamily::names()) names += (names.empty() ? "" : "\n") + name;
    give_text(names, buffer, size, needed);
  });
}

lh_status lh_target_family_info(lh_context* ctx, const char* family, lh_target_family* out) {
  return guarded(ctx, [&] {
    checked_struct_size(given(out, "out").struct_size, "out");
    const TargetFamily f = family_of(family);
    write_struct(out,
                 lh_target_family{sizeof(lh_target_family), int32_t(f.kind()), f.grid(), int32_t(f.ids().size()),
                                  f.minimum_distance()},
                 "out");
  });
}

lh_status lh_target_family_ids(lh_context* ctx, const char* family, int32_t* ids, size_t n) {
  return guarded(ctx, [&] {
    const TargetFamily f = family_of(family);
    const auto to = room(ids, n, f.ids().size(), 1, "ids");
    std::copy(f.ids().begin(), f.ids().end(), to.begin());
  });
}

lh_status lh_target_family_cells(lh_context* ctx, const char* family, int32_t id, uint8_t* cells, size_t n) {
  return guarded(ctx, [&] {
    const std::vector<Cell> from = family_of(family).cells(id);
    const auto to = room(cells, n, from.size(), 1, "cells");
    std::transform(from.begin(), from.end(), to.begin(), [](Cell cell) { return uint8_t(cell); });
  });
}

lh_status lh_target_family_decode(lh_context* ctx, const char* family, const uint8_t* cells, size_t n, double strength,
                                  lh_decoded_target* out) {
  return guarded(ctx, [&] {
    checked_struct_size(given(out, "out").struct_size, "out");
    const TargetFamily f = family_of(family);
    const auto from = array(cells, n, 1, "cells");
    std::vector<Cell> read;
    for (const uint8_t cell : from) {
      if (cell > LH_CELL_UNKNOWN) invalid("expected LH_CELL_DARK, LH_CELL_LIGHT or LH_CELL_UNKNOWN", "cells");
      read.push_back(Cell(cell));
    }
    const auto decoded = f.decode(read, strength);
    lh_decoded_target result{sizeof(lh_decoded_target), -1, 0, 0, 0};
    if (decoded) result = {sizeof result, decoded->id, decoded->quarter_turns, decoded->corrected, decoded->erased};
    write_struct(out, result, "out");
  });
}

lh_status lh_target_set_load(lh_context* ctx, const char* file, lh_target_set** out) {
  return guarded(ctx, [&] {
    given(out, "out");
    give(out, TargetSet::load(path(file, "file")));
  });
}

lh_status lh_target_set_from_word(lh_context* ctx, const char* word, lh_target_set** out) {
  return guarded(ctx, [&] {
    given(out, "out");
    give(out, TargetSet::from_word(text(word, "word")));
  });
}

lh_status lh_target_set_from_text(lh_context* ctx, const char* file_or_word, lh_target_set** out) {
  return guarded(ctx, [&] {
    given(out, "out");
    give(out, TargetSet::from_text(text(file_or_word, "text")));
  });
}

lh_status lh_target_set_save(lh_context* ctx, const lh_target_set* set, const char* file) {
  return guarded(ctx, [&] { value(set).save(path(file, "file")); });
}

void lh_target_set_destroy(lh_target_set* set) { delete set; }

size_t lh_target_set_design_count(const lh_target_set* set) { return set ? set->value.designs.size() : 0; }
size_t lh_target_set_board_count(const lh_target_set* set) { return set ? set->value.boards.size() : 0; }
size_t lh_target_set_grid_count(const lh_target_set* set) { return set ? set->value.grids.size() : 0; }
size_t lh_target_set_board_size(const lh_target_set* set, size_t board) {
  return set && board < set->value.boards.size() ? set->value.boards[board].targets.size() : 0;
}

lh_status lh_target_set_design(lh_context* ctx, const lh_target_set* set, size_t design, lh_target_design* out) {
  return guarded(ctx, [&] { write_struct(out, design_to(item(value(set).designs, design, "design")), "out"); });
}

lh_status lh_target_set_family(lh_context* ctx, const lh_target_set* set, size_t design, char* buffer, size_t size,
                               size_t* needed) {
  return guarded(ctx,
                 [&] { give_text(item(value(set).designs, design, "design").family.name(), buffer, size, needed); });
}

lh_status lh_target_set_features(lh_context* ctx, const lh_target_set* set, size_t design, double* xy, size_t n) {
  return guarded(ctx, [&] {
    const calib::TargetDesign& d = item(value(set).designs, design, "design");
    const auto to = room(xy, n, size_t(d.features()), 2, "xy");
    for (int i = 0; i < d.features(); ++i) {
      const Eigen::Vector2d place = d.feature(i);
      to[size_t(2 * i)] = place.x();
      to[size_t(2 * i + 1)] = place.y();
    }
  });
}

lh_status lh_target_set_board_name(lh_context* ctx, const lh_target_set* set, size_t board, char* buffer, size_t size,
                                   size_t* needed) {
  return guarded(ctx, [&] { give_text(item(value(set).boards, board, "board").name, buffer, size, needed); });
}

lh_status lh_target_set_board_target(lh_context* ctx, const lh_target_set* set, size_t board, size_t i, size_t* design,
                                     int32_t* id, double* board_from_target) {
  return guarded(ctx, [&] {
    const calib::BoardTarget& target = item(item(value(set).boards, board, "board").targets, i, "i");
    if (design) *design = size_t(target.design);
    if (id) *id = target.id;
    if (board_from_target) pose_to(target.board_from_target, board_from_target);
  });
}

lh_status lh_target_set_grid(lh_context* ctx, const lh_target_set* set, size_t grid, lh_point_grid* out) {
  return guarded(ctx, [&] { write_struct(out, grid_to(item(value(set).grids, grid, "grid")), "out"); });
}
