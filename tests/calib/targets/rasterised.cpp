#include "rasterised.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>

namespace lumihull::test {

int Page::at(double x_mm, double y_mm) const {
  const int column = int(std::floor(px(x_mm))), row = int(std::floor(px(y_mm)));
  if (column < 0 || row < 0 || column >= width || row >= height) return -1;
  return static_cast<unsigned char>(pixels[std::size_t(row) * std::size_t(width) + std::size_t(column)]);
}

double Page::ink(int column, int row, int paper_grey, int ink_grey) const {
  const int grey = static_cast<unsigned char>(pixels[std::size_t(row) * std::size_t(width) + std::size_t(column)]);
  return double(paper_grey - grey) / (paper_grey - ink_grey);
}

bool has_pdftoppm() { return std::system("pdftoppm -v >/dev/null 2>&1") == 0; }

std::vector<Page> rasterised(const std::filesystem::path& pdf, int dpi) {
  const std::string command = "pdftoppm -gray -r " + std::to_string(dpi) + " '" + pdf.string() + "'";
  std::FILE* pipe = popen(command.c_str(), "r");
  std::string bytes(1 << 16, '\0'), all;
  while (const std::size_t n = std::fread(bytes.data(), 1, bytes.size(), pipe)) all.append(bytes, 0, n);
  EXPECT_EQ(pclose(pipe), 0) << command;
  std::vector<Page> pages;
  for (std::size_t at = 0; at < all.size();) {
    Page page;
    page.dpi = dpi;
    int most = 0, header = 0;
    if (std::sscanf(all.c_str() + at, "P5 %d %d %d%n", &page.width, &page.height, &most, &header) != 3) break;
    at += std::size_t(header) + 1;
    page.pixels = all.substr(at, std::size_t(page.width) * std::size_t(page.height));
    at += page.pixels.size();
    pages.push_back(std::move(page));
  }
  return pages;
}

}  // namespace lumihull::test
