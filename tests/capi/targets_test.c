/* Targets: families, sets from words and files, sheets. */
#include "check.h"

static void families(lh_context *ctx) {
  char names[2000];
  size_t needed = 0, i;
  int32_t ids[400];
  uint8_t cells[25], turned[25];
  lh_target_family family;
  lh_decoded_target read;
  MUST(ctx, lh_target_families(ctx, NULL, 0, &needed));
  CHECK(needed > 100 && needed <= sizeof names);
  MUST(ctx, lh_target_families(ctx, names, sizeof names, NULL));
  CHECK(strstr(names, "paper4x4\nmatrix5x5\nmatrix6x6\napriltag:36h11\n") == names);

  family.struct_size = sizeof family;
  MUST(ctx, lh_target_family_info(ctx, "paper4x4", &family));
  CHECK(family.kind == LH_TARGETS_CIRCLES && family.grid == 4 && family.id_count == 400);
  MUST(ctx, lh_target_family_ids(ctx, "paper4x4", ids, 400));
  for (i = 1; i < 400; ++i) CHECK(ids[i] > ids[i - 1]);
  EXPECT(ctx, LH_EINVAL, lh_target_family_ids(ctx, "paper4x4", ids, 399));
  MUST(ctx, lh_target_family_info(ctx, "apriltag:36h11", &family));
  CHECK(family.kind == LH_TARGETS_SQUARES && family.grid == 8 && family.id_count == 587 &&
        family.minimum_distance == 11);
  EXPECT(ctx, LH_EINVAL, lh_target_family_info(ctx, "matrix7x7", &family));
  EXPECT(ctx, LH_EUNSUPPORTED, lh_target_family_info(ctx, "apriltag:Circle21h7", &family));

  /* Turned clockwise by 90 degrees and one cell wrong: three turns bring it upright. */
  MUST(ctx, lh_target_family_cells(ctx, "matrix5x5", 200, cells, 25));
  for (i = 0; i < 25; ++i) turned[i % 5 * 5 + 4 - i / 5] = cells[i];
  turned[7] ^= 1;
  read.struct_size = sizeof read;
  MUST(ctx, lh_target_family_decode(ctx, "matrix5x5", turned, 25, 1, &read));
  CHECK(read.id == 200 && read.quarter_turns == 3 && read.corrected == 1 && read.erased == 0);
  MUST(ctx, lh_target_family_decode(ctx, "matrix5x5", turned, 25, 0, &read));
  CHECK(read.id == -1);
  turned[0] = 3;
  EXPECT(ctx, LH_EINVAL, lh_target_family_decode(ctx, "matrix5x5", turned, 25, 1, &read));
  CHECK_SAYS(ctx, "cells");
  EXPECT(ctx, LH_EINVAL, lh_target_family_cells(ctx, "matrix5x5", 256, cells, 25));
  EXPECT(ctx, LH_EINVAL, lh_target_family_cells(ctx, "matrix5x5", 1, cells, 24));
}

static void sets(lh_context *ctx, const char *scratch) {
  lh_target_set *set = NULL, *again = NULL;
  lh_target_design design;
  lh_point_grid grid;
  double corners[8];
  char text[100], file[1024];
  size_t needed;
  MUST(ctx, lh_target_set_from_word(ctx, "aruco:6x6_250:35mm,chessboard:9x6:25mm", &set));
  CHECK(lh_target_set_design_count(set) == 1 && lh_target_set_grid_count(set) == 1);
  CHECK(lh_target_set_board_count(set) == 0 && lh_target_set_board_size(set, 0) == 0);
  CHECK(lh_target_set_design_count(NULL) == 0);
  snprintf(file, sizeof file, "%s/set.json", scratch);
  MUST(ctx, lh_target_set_save(ctx, set, file));
  MUST(ctx, lh_target_set_from_text(ctx, file, &again));
  design.struct_size = sizeof design;
  MUST(ctx, lh_target_set_design(ctx, again, 0, &design));
  CHECK(design.size_m == 0.035 && design.scale_x == 1 && design.has_colors && design.ink == 0 &&
        design.paper == 0xFFFFFF);
  MUST(ctx, lh_target_set_family(ctx, again, 0, NULL, 0, &needed));
  CHECK(needed == strlen("aruco:6x6_250") + 1);
  MUST(ctx, lh_target_set_family(ctx, again, 0, text, sizeof text, NULL));
  CHECK(strcmp(text, "aruco:6x6_250") == 0);
  MUST(ctx, lh_target_set_features(ctx, again, 0, corners, 4));
  CHECK(fabs(corners[0] + 0.0175) < 1e-15 && fabs(corners[4] - 0.0175) < 1e-15);
  grid.struct_size = sizeof grid;
  MUST(ctx, lh_target_set_grid(ctx, again, 0, &grid));
  CHECK(grid.kind == LH_GRID_CHESSBOARD && grid.columns == 9 && grid.rows == 6 && grid.spacing_m == 0.025);
  EXPECT(ctx, LH_EINVAL, lh_target_set_design(ctx, again, 1, &design));
  EXPECT(ctx, LH_EINVAL, lh_target_set_grid(ctx, NULL, 0, &grid));
  EXPECT(ctx, LH_EINVAL, lh_target_set_board_target(ctx, again, 0, 0, NULL, NULL, NULL));
  lh_target_set_destroy(set);
  lh_target_set_destroy(again);
  lh_target_set_destroy(NULL);

  set = NULL;
  EXPECT(ctx, LH_EINVAL, lh_target_set_from_word(ctx, "matrix5x5", &set));
  EXPECT(ctx, LH_EINVAL, lh_target_set_from_word(ctx, NULL, &set));
  EXPECT(ctx, LH_ENOTFOUND, lh_target_set_load(ctx, "absent.json", &set));
  EXPECT(ctx, LH_EINVAL, lh_target_set_from_word(ctx, "matrix5x5:18mm", NULL));
  CHECK(set == NULL);
}

static void sheets(lh_context *ctx, const char *scratch) {
  const int32_t ids[5] = {46, 0, 7, 255, 31};
  lh_target_set *set = NULL;
  lh_target_design design;
  lh_sheet_options options;
  lh_point_grid grid;
  double pose[12];
  size_t index = 9;
  int32_t id = -1;
  char stem[1000], name[100];
  FILE *pdf;
  char magic[5] = "";
  snprintf(stem, sizeof stem, "%s/sheets", scratch);
  memset(&options, 0, sizeof options);
  options.struct_size = sizeof options;
  options.per_sheet = 4;
  options.paper = LH_PAPER_A4;
  options.formats = LH_SHEET_PDF | LH_SHEET_SVG;
  MUST(ctx, lh_target_sheets_write(ctx, stem, "matrix5x5", NULL, ids, 5, &options, &set));
  CHECK(lh_target_set_board_count(set) == 2 && lh_target_set_board_size(set, 0) == 4 &&
        lh_target_set_board_size(set, 1) == 1);
  MUST(ctx, lh_target_set_board_name(ctx, set, 1, name, sizeof name, NULL));
  CHECK(strcmp(name, "sheet 2") == 0);
  MUST(ctx, lh_target_set_board_target(ctx, set, 0, 3, &index, &id, pose));
  CHECK(index == 0 && id == 255 && pose[0] == 1 && pose[3] > 0.1 && pose[3] < 0.21 && pose[7] > 0.1 && pose[11] == 0);
  design.struct_size = sizeof design;
  MUST(ctx, lh_target_set_design(ctx, set, 0, &design));
  CHECK(design.size_m == 0.018 && design.ink == 0x00461E && design.paper == 0x96CD96);
  lh_target_set_destroy(set);
  snprintf(stem, sizeof stem, "%s/sheets.pdf", scratch);
  pdf = fopen(stem, "rb");
  CHECK(pdf && fread(magic, 1, 4, pdf) == 4 && strcmp(magic, "%PDF") == 0);
  if (pdf) fclose(pdf);

  /* What does not fit, or is not there. */
  snprintf(stem, sizeof stem, "%s/none", scratch);
  memset(&design, 0, sizeof design);
  design.struct_size = sizeof design;
  design.size_m = 0.1;
  set = NULL;
  EXPECT(ctx, LH_EINVAL, lh_target_sheets_write(ctx, stem, "matrix5x5", &design, ids, 5, NULL, &set));
  CHECK_SAYS(ctx, "largest pitch");
  EXPECT(ctx, LH_EINVAL, lh_target_sheets_write(ctx, stem, "matrix5x5", NULL, NULL, 0, NULL, &set));
  EXPECT(ctx, LH_EINVAL, lh_target_sheets_write(ctx, stem, "matrix5x5", NULL, NULL, 5, NULL, &set));
  EXPECT(ctx, LH_EINVAL, lh_target_sheets_write(ctx, stem, NULL, NULL, ids, 5, NULL, &set));
  options.formats = 8;
  EXPECT(ctx, LH_EINVAL, lh_target_sheets_write(ctx, stem, "matrix5x5", NULL, ids, 5, &options, &set));
  CHECK_SAYS(ctx, "formats");
  CHECK(set == NULL);

  memset(&grid, 0, sizeof grid);
  grid.struct_size = sizeof grid;
  grid.kind = LH_GRID_CHESSBOARD;
  grid.columns = 9;
  grid.rows = 6;
  snprintf(stem, sizeof stem, "%s/chessboard", scratch);
  MUST(ctx, lh_grid_sheet_write(ctx, stem, &grid, NULL, &set));
  MUST(ctx, lh_target_set_grid(ctx, set, 0, &grid));
  CHECK(grid.spacing_m == 0.025);
  lh_target_set_destroy(set);
  MUST(ctx, lh_grid_sheet_write(ctx, stem, &grid, NULL, NULL));
  grid.kind = 5;
  EXPECT(ctx, LH_EINVAL, lh_grid_sheet_write(ctx, stem, &grid, NULL, NULL));

  lh_context_cancel(ctx);
  EXPECT(ctx, LH_ECANCELLED, lh_target_sheets_write(ctx, stem, "matrix5x5", NULL, ids, 5, NULL, NULL));
  lh_context_clear_cancel(ctx);
}

int main(int argc, char **argv) {
  const char *scratch = argc > 1 ? argv[1] : ".";
  lh_context *ctx = lh_context_create();
  if (!ctx) return 1;
  families(ctx);
  sets(ctx, scratch);
  sheets(ctx, scratch);
  lh_context_destroy(ctx);
  return check_result();
}
