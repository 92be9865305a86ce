#pragma once

#include <lumihull/slf/truth.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace lumihull::slf::truth {

/// Of values >= 0; quantiles are values themselves (nearest rank).
inline Spread spread_of(std::vector<double> values) {
  Spread s;
  s.count = values.size();
  if (values.empty()) return s;
  std::sort(values.begin(), values.end());
  double sum = 0, squares = 0;
  for (const double v : values) sum += v, squares += v * v;
  const double n = double(values.size());
  const auto quantile = [&](double q) { return values[std::size_t(std::max(0.0, std::ceil(q * n) - 1))]; };
  s.mean = sum / n;
  s.rms = std::sqrt(squares / n);
  s.median = quantile(0.5);
  s.q95 = quantile(0.95);
  s.max = values.back();
  return s;
}

}  // namespace lumihull::slf::truth
