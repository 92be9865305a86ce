// Structure of the normal equations, and their sums.
#include "normal_equations.h"

#include <lumihull/base/error.h>
#include <lumihull/base/parallel.h>

#include <algorithm>
#include <atomic>
#include <limits>
#include <map>
#include <numeric>

namespace lumihull::calib::bundle {
namespace {

constexpr std::size_t kMaxParts = 64;
constexpr std::size_t kPartialValues = 16 << 20;  ///< of all parts together
constexpr Eigen::Index kPanelRows = 256, kTileColumns = 192;

/// dst (d_a x d_b, row-major) += aᵀ b over `rows` rows that are `stride` apart.
template <int kColumns>
void add_product(double* dst, const double* a, int size_a, const double* b, int size_b, int rows, int stride) {
  const int n = kColumns > 0 ? kColumns : size_b;
  for (int r = 0; r < rows; ++r, a += stride, b += stride) {
    double* out = dst;
    for (int i = 0; i < size_a; ++i, out += n)
      for (int j = 0; j < n; ++j) out[j] += a[i] * b[j];
  }
}

void add_block(double* dst, const double* a, int size_a, const double* b, int size_b, int rows, int stride) {
  switch (size_b) {
    case 3:
      return add_product<3>(dst, a, size_a, b, size_b, rows, stride);
    case 6:
      return add_product<6>(dst, a, size_a, b, size_b, rows, stride);
    case 8:
      return add_product<8>(dst, a, size_a, b, size_b, rows, stride);
    default:
      return add_product<0>(dst, a, size_a, b, size_b, rows, stride);
  }
}

/// The same with itself: the upper triangle.
void add_square(double* dst, const double* a, int size, int rows, int stride) {
  for (int r = 0; r < rows; ++r, a += stride) {
    double* out = dst;
    for (int i = 0; i < size; ++i, out += size)
      for (int j = i; j < size; ++j) out[j] += a[i] * a[j];
  }
}

}  // namespace

NormalEquations::NormalEquations(const LeastSquares& problem) {
  lay_out(problem);
  find_pairs(problem);
  lay_out_tiles();
  gradient_.setZero(unknowns_);
  diagonal_.setOnes(unknowns_);
}

/// Blocks, which kept ones each eliminated one meets, the terms' order and parts.
void NormalEquations::lay_out(const LeastSquares& problem) {
  sizes_ = problem.sizes;
  const std::size_t count = sizes_.size();
  eliminated_index_.assign(count, -1);
  offset_.resize(count), kept_column_.assign(count, -1), kept_diagonal_.assign(count, 0);
  std::size_t kept_values = 0;
  for (std::size_t b = 0; b < count; ++b) {
    offset_[b] = unknowns_;
    unknowns_ += sizes_[b];
    if (problem.eliminated[b]) continue;
    kept_column_[b] = kept_size_;
    kept_size_ += sizes_[b];
    kept_blocks_.push_back(b);
    kept_diagonal_[b] = kept_values;
    kept_values += std::size_t(sizes_[b]) * std::size_t(sizes_[b]);
  }
  kept_values_.resize(kept_values);

  // Neighbours of each eliminated block, sorted; blocks that meet the same early ones come next to each other.
  const auto eliminated_of = [&](const Term& term) {
    for (int i = 0; i < term.blocks; ++i)
      if (problem.eliminated[std::size_t(term.block[std::size_t(i)])]) return term.block[std::size_t(i)];
    return std::int32_t(-1);
  };
  std::vector<std::vector<std::int32_t>> met(count);
  for (const Term& term : problem.terms) {
    const std::int32_t e = eliminated_of(term);
    if (e < 0) continue;
    auto& list = met[std::size_t(e)];
    for (int i = 0; i < term.blocks; ++i) {
      const std::int32_t b = term.block[std::size_t(i)];
      if (b != e && (list.empty() || std::find(list.end() - std::min<std::ptrdiff_t>(4, std::ptrdiff_t(list.size())),
                                               list.end(), b) == list.end()))
        list.push_back(b);
    }
  }
  std::vector<std::size_t> sequence;
  for (std::size_t b = 0; b < count; ++b) {
    auto& list = met[b];
    std::sort(list.begin(), list.end());
    list.erase(std::unique(list.begin(), list.end()), list.end());
    if (problem.eliminated[b]) sequence.push_back(b);
  }
  std::stable_sort(sequence.begin(), sequence.end(), [&](std::size_t a, std::size_t b) {
    const std::int32_t first_a = met[a].empty() ? -1 : met[a].front(), first_b = met[b].empty() ? -1 : met[b].front();
    return first_a < first_b;
  });
  std::size_t u = 0, w = 0;
  for (const std::size_t b : sequence) {
    Eliminated e;
    e.block = b, e.size = sizes_[b], e.row = eliminated_size_, e.u = u, e.w = w, e.first = met_.size();
    std::int32_t column = 0;
    for (const std::int32_t k : met[b]) {
      met_.push_back({k, column});
      column += sizes_[std::size_t(k)];
    }
    e.last = met_.size();
    eliminated_size_ += e.size;
    u += std::size_t(e.size) * std::size_t(e.size);
    w += std::size_t(e.size) * std::size_t(column);
    eliminated_index_[b] = std::int32_t(eliminated_.size());
    eliminated_.push_back(e);
  }
  if (w > std::numeric_limits<std::uint32_t>::max())
    throw Error(ErrorCode::out_of_memory, "too many pairs of unknowns for one adjustment");
  u_.resize(u), w_.resize(w), factors_.resize(u);

  // Terms by eliminated block; those without one at the end.
  std::vector<std::size_t> begin(eliminated_.size() + 2, 0);
  const auto bucket = [&](const Term& term) {
    const std::int32_t e = eliminated_of(term);
    return e < 0 ? eliminated_.size() : std::size_t(eliminated_index_[std::size_t(e)]);
  };
  for (const Term& term : problem.terms) ++begin[bucket(term) + 1];
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  order_.resize(problem.terms.size());
  std::vector<std::size_t> next = begin;
  for (std::size_t t = 0; t < problem.terms.size(); ++t) order_[next[bucket(problem.terms[t])]++] = std::uint32_t(t);

  const std::size_t per_part = problem.terms.size() / kMaxParts + 1;
  Part part;
  for (std::size_t e = 0; e < eliminated_.size(); ++e) {
    part.last = begin[e + 1], part.last_eliminated = e + 1;
    if (part.last - part.first < per_part && e + 1 < eliminated_.size()) continue;
    parts_.push_back(part);
    part.first = part.last, part.first_eliminated = part.last_eliminated;
  }
  for (part.first_eliminated = part.last_eliminated; part.first < order_.size(); part.first = part.last) {
    part.last = std::min(part.first + per_part, order_.size());
    parts_.push_back(part);
  }
}

/// Where each term's pairs of blocks are summed.
void NormalEquations::find_pairs(const LeastSquares& problem) {
  std::map<std::pair<std::int32_t, std::int32_t>, std::size_t> kept;
  slots_begin_.resize(problem.terms.size());
  for (std::size_t t = 0; t < problem.terms.size(); ++t) {
    const Term& term = problem.terms[t];
    slots_begin_[t] = slots_.size();
    for (int i = 0; i < term.blocks; ++i)
      for (int j = i + 1; j < term.blocks; ++j) {
        std::int32_t a = term.block[std::size_t(i)], b = term.block[std::size_t(j)];
        if (eliminated_index_[std::size_t(b)] >= 0) std::swap(a, b);
        const std::int32_t index = eliminated_index_[std::size_t(a)];
        if (index >= 0) {
          const Eliminated& e = eliminated_[std::size_t(index)];
          const auto met =
              std::lower_bound(met_.begin() + std::ptrdiff_t(e.first), met_.begin() + std::ptrdiff_t(e.last), b,
                               [](const Met& m, std::int32_t block) { return m.block < block; });
          slots_.push_back(std::uint32_t(e.w + std::size_t(met->column) * std::size_t(e.size)));
          continue;
        }
        if (a > b) std::swap(a, b);
        const auto [place, fresh] = kept.try_emplace({a, b}, kept_values_.size());
        if (fresh) {
          kept_pairs_.push_back({a, b, kept_values_.size()});
          kept_values_.resize(kept_values_.size() +
                              std::size_t(sizes_[std::size_t(a)]) * std::size_t(sizes_[std::size_t(b)]));
        }
        slots_.push_back(std::uint32_t(place->second));
      }
  }
  // Few large parts where what all of them share is large.
  const std::size_t shared = kept_values_.size() + std::size_t(kept_size_);
  const std::size_t most = std::max<std::size_t>(1, kPartialValues / std::max<std::size_t>(1, shared));
  while (parts_.size() > most) {
    std::vector<Part> joined;
    for (std::size_t i = 0; i < parts_.size(); i += 2) {
      joined.push_back(parts_[i]);
      if (i + 1 < parts_.size())
        joined.back().last = parts_[i + 1].last, joined.back().last_eliminated = parts_[i + 1].last_eliminated;
    }
    parts_ = std::move(joined);
  }
  partial_.resize(parts_.size() * shared);
}

void NormalEquations::lay_out_tiles() {
  tiles_ = {0};
  tile_of_kept_.assign(sizes_.size(), 0);
  for (const std::size_t b : kept_blocks_) {
    if (kept_column_[b] > tiles_.back() && kept_column_[b] + sizes_[b] > tiles_.back() + kTileColumns)
      tiles_.push_back(kept_column_[b]);
    tile_of_kept_[b] = tiles_.size() - 1;
  }
  if (kept_size_ > 0) tiles_.push_back(kept_size_);
  const std::size_t columns = tiles_.size() - 1;

  std::size_t values = 0;
  for (std::size_t e = 0; e < eliminated_.size();) {
    Panel panel;
    panel.first = e, panel.row = eliminated_[e].row;
    panel.tile.assign(columns, -1);
    for (; e < eliminated_.size() && (e == panel.first || panel.rows + eliminated_[e].size <= kPanelRows); ++e) {
      panel.rows += eliminated_[e].size;
      eliminated_[e].panel = panels_.size();
      for (std::size_t m = eliminated_[e].first; m < eliminated_[e].last; ++m)
        panel.tile[tile_of_kept_[std::size_t(met_[m].block)]] = 0;
    }
    panel.last = e;
    for (std::size_t c = 0; c < columns; ++c)
      if (panel.tile[c] == 0) {
        panel.tile[c] = std::ptrdiff_t(values);
        values += std::size_t(panel.rows * (tiles_[c + 1] - tiles_[c]));
      }
    panels_.push_back(std::move(panel));
  }
  y_.assign(values, 0.0);
}

std::optional<double> NormalEquations::cost(const LeastSquares& problem, Job& job) const {
  std::vector<double> costs(parts_.size(), 0);
  std::atomic<bool> lost{false};
  parallel_for(job, parts_.size(), [&](std::size_t p) {
    double residual[kTermRows];
    for (std::size_t i = parts_[p].first; i < parts_[p].last && !lost.load(std::memory_order_relaxed); ++i) {
      const double c = problem.evaluate(order_[i], residual, nullptr);
      if (!(c >= 0)) lost = true;
      costs[p] += c;
    }
  });
  if (lost) return std::nullopt;
  const double sum = std::accumulate(costs.begin(), costs.end(), 0.0);
  return std::isfinite(sum) ? std::optional(sum) : std::nullopt;
}

void NormalEquations::add_term(const LeastSquares& problem, std::size_t t, const double* residual,
                               const double* jacobian, double* kept_values, double* kept_gradient) {
  const Term& term = problem.terms[t];
  const int rows = term.rows;
  std::array<int, kTermBlocks + 1> column{};
  for (int i = 0; i < term.blocks; ++i)
    column[std::size_t(i) + 1] = column[std::size_t(i)] + sizes_[std::size_t(term.block[std::size_t(i)])];
  const int stride = column[term.blocks];
  const std::uint32_t* slot = slots_.data() + slots_begin_[t];
  for (int i = 0; i < term.blocks; ++i) {
    const auto a = std::size_t(term.block[std::size_t(i)]);
    const double* ja = jacobian + column[std::size_t(i)];
    const std::int32_t index_a = eliminated_index_[a];
    double* square;
    double* right;
    if (index_a >= 0) {
      square = u_.data() + eliminated_[std::size_t(index_a)].u;
      right = gradient_.data() + offset_[a];
    } else {
      square = kept_values + kept_diagonal_[a];
      right = kept_gradient + kept_column_[a];
    }
    add_square(square, ja, sizes_[a], rows, stride);
    for (int r = 0; r < rows; ++r)
      for (int k = 0; k < sizes_[a]; ++k) right[k] += ja[r * stride + k] * residual[r];
    for (int j = i + 1; j < term.blocks; ++j, ++slot) {
      const auto b = std::size_t(term.block[std::size_t(j)]);
      const double* jb = jacobian + column[std::size_t(j)];
      if (index_a >= 0)
        add_block(w_.data() + *slot, jb, sizes_[b], ja, sizes_[a], rows, stride);
      else if (eliminated_index_[b] >= 0)
        add_block(w_.data() + *slot, ja, sizes_[a], jb, sizes_[b], rows, stride);
      else if (a < b)
        add_block(kept_values + *slot, ja, sizes_[a], jb, sizes_[b], rows, stride);
      else
        add_block(kept_values + *slot, jb, sizes_[b], ja, sizes_[a], rows, stride);
    }
  }
}

std::optional<double> NormalEquations::linearize(const LeastSquares& problem, Job& job) {
  const std::size_t values = kept_values_.size(), shared = values + std::size_t(kept_size_);
  std::vector<double> costs(parts_.size(), 0);
  std::atomic<bool> lost{false};
  parallel_for(job, parts_.size(), [&](std::size_t p) {
    const Part& part = parts_[p];
    double* const own = partial_.data() + p * shared;
    std::fill_n(own, shared, 0.0);
    if (part.first_eliminated < part.last_eliminated) {
      const Eliminated& first = eliminated_[part.first_eliminated];
      const bool end = part.last_eliminated == eliminated_.size();
      const std::size_t u_end = end ? u_.size() : eliminated_[part.last_eliminated].u;
      const std::size_t w_end = end ? w_.size() : eliminated_[part.last_eliminated].w;
      std::fill(u_.data() + first.u, u_.data() + u_end, 0.0);
      std::fill(w_.data() + first.w, w_.data() + w_end, 0.0);
      for (std::size_t e = part.first_eliminated; e < part.last_eliminated; ++e)
        gradient_.segment(offset_[eliminated_[e].block], eliminated_[e].size).setZero();
    }
    double residual[kTermRows], jacobian[kTermRows * kTermColumns];
    for (std::size_t i = part.first; i < part.last && !lost.load(std::memory_order_relaxed); ++i) {
      const double c = problem.evaluate(order_[i], residual, jacobian);
      if (!(c >= 0)) lost = true;
      costs[p] += c;
      add_term(problem, order_[i], residual, jacobian, own, own + values);
    }
  });
  if (lost) return std::nullopt;

  Eigen::VectorXd kept_gradient(kept_size_);
  parallel_chunks(job, shared, 4096, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) {
      double sum = 0;
      for (std::size_t p = 0; p < parts_.size(); ++p) sum += partial_[p * shared + i];
      if (i < values)
        kept_values_[i] = sum;
      else
        kept_gradient[Eigen::Index(i - values)] = sum;
    }
  });
  for (const std::size_t b : kept_blocks_)
    gradient_.segment(offset_[b], sizes_[b]) = kept_gradient.segment(kept_column_[b], sizes_[b]);
  for (std::size_t b = 0; b < sizes_.size(); ++b) {
    const std::int32_t e = eliminated_index_[b];
    const double* square = e >= 0 ? u_.data() + eliminated_[std::size_t(e)].u : kept_values_.data() + kept_diagonal_[b];
    for (int i = 0; i < sizes_[b]; ++i) {
      const double d = square[i * (sizes_[b] + 1)];
      diagonal_[offset_[b] + i] = d > 0 ? d : 1;
    }
  }
  const double sum = std::accumulate(costs.begin(), costs.end(), 0.0);
  return std::isfinite(sum) && gradient_.allFinite() ? std::optional(sum) : std::nullopt;
}

Eigen::MatrixXd NormalEquations::diagonal_block(std::size_t block) const {
  const std::int32_t e = eliminated_index_[block];
  const double* square =
      e >= 0 ? u_.data() + eliminated_[std::size_t(e)].u : kept_values_.data() + kept_diagonal_[block];
  // Its upper triangle row by row is a lower triangle column by column.
  return Eigen::Map<const Eigen::MatrixXd>(square, sizes_[block], sizes_[block]).selfadjointView<Eigen::Lower>();
}

}  // namespace lumihull::calib::bundle
