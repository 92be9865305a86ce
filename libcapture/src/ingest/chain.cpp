#include "chain.h"

#include <algorithm>

namespace lumihull::capture {
namespace {

constexpr std::size_t kNone = std::size_t(-1);

/// Largest value among the first n places (Fenwick 1994, with maxima for sums).
class PrefixMaxima {
 public:
  struct Entry {
    double value = 0;
    std::size_t pair = kNone;
  };
  explicit PrefixMaxima(std::size_t places) : tree_(places + 1) {}
  void raise(std::size_t place, const Entry& entry) {
    for (std::size_t i = place + 1; i < tree_.size(); i += i & (~i + 1))
      if (entry.value > tree_[i].value) tree_[i] = entry;
  }
  Entry before(std::size_t place) const {
    Entry best;
    for (std::size_t i = place; i > 0; i -= i & (~i + 1))
      if (tree_[i].value > best.value) best = tree_[i];
    return best;
  }

 private:
  std::vector<Entry> tree_;
};

/// Weight of the heaviest chain that ends with each pair, from the first picture on or, `backward`, from the last.
std::vector<double> heaviest_ends(std::span<const Pair> pairs, std::size_t shots, std::size_t clocks,
                                  std::span<const double> cost, bool backward, std::vector<std::size_t>* previous) {
  std::vector<PrefixMaxima> best(clocks, PrefixMaxima(shots));
  std::vector<double> weight(pairs.size());
  if (previous) previous->assign(pairs.size(), kNone);
  const auto at = [&](std::size_t i) { return backward ? pairs.size() - 1 - i : i; };
  const auto place = [&](const Pair& p) { return backward ? shots - 1 - p.shot : p.shot; };
  for (std::size_t first = 0; first < pairs.size();) {
    std::size_t end = first;  // one picture's pairs: none of them may follow another
    while (end < pairs.size() && pairs[at(end)].picture == pairs[at(first)].picture) ++end;
    for (std::size_t i = first; i < end; ++i) {
      const Pair& p = pairs[at(i)];
      PrefixMaxima::Entry from;
      for (std::size_t clock = 0; clock < clocks; ++clock) {
        PrefixMaxima::Entry e = best[clock].before(place(p));
        e.value -= backward ? cost[p.clock * clocks + clock] : cost[clock * clocks + p.clock];
        if (e.value > from.value) from = e;
      }
      weight[at(i)] = p.gain + from.value;
      if (previous) (*previous)[at(i)] = from.pair;
    }
    for (std::size_t i = first; i < end; ++i) {
      const Pair& p = pairs[at(i)];
      best[p.clock].raise(place(p), {weight[at(i)], at(i)});
    }
    first = end;
  }
  return weight;
}

}  // namespace

Chains heaviest_chains(std::span<const Pair> pairs, std::size_t shots, std::size_t clocks,
                       std::span<const double> cost) {
  Chains out;
  std::vector<std::size_t> previous;
  const std::vector<double> ahead = heaviest_ends(pairs, shots, clocks, cost, false, &previous);
  const std::vector<double> behind = heaviest_ends(pairs, shots, clocks, cost, true, nullptr);
  std::size_t last = kNone;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    out.through.push_back(ahead[i] + behind[i] - pairs[i].gain);
    if (ahead[i] > out.best) {
      out.best = ahead[i];
      last = i;
    }
  }
  for (; last != kNone; last = previous[last]) out.path.push_back(last);
  std::reverse(out.path.begin(), out.path.end());
  return out;
}

}  // namespace lumihull::capture
