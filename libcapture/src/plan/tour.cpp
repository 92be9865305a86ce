// Local search for the shortest path: 2-opt and Or-opt on neighbour lists with a queue of places to look at (Bentley
// 1992), perturbed by double bridges (Martin, Otto & Felten 1991).
#include "tour.h"

#include <algorithm>
#include <deque>
#include <limits>
#include <random>

namespace lumihull::capture::internal {
namespace {

constexpr std::size_t kNeighbours = 10;
constexpr double kGain = 1e-9;  // less is rounding
constexpr int kKickSpan = 50;   // places that a kick touches

/// The path as it stands. Positions 0 and n + 1 are the ends.
class Search {
 public:
  Search(const PathProblem& problem, const std::vector<int>& order) : problem_(problem), n_(int(order.size())) {
    // Places as 0 … n - 1 inside, in the order that `problem` lists them, so that lists are arrays.
    places_ = problem.places;
    std::vector<std::pair<int, int>> index;
    for (int i = 0; i < n_; ++i) index.emplace_back(places_[std::size_t(i)], i);
    std::sort(index.begin(), index.end());
    at_.resize(std::size_t(n_));
    for (std::size_t k = 0; k < order.size(); ++k)
      at_[k] = std::lower_bound(index.begin(), index.end(), std::make_pair(order[k], -1))->second;
    position_.resize(std::size_t(n_));
    renumber(0, n_ - 1);
    list_neighbours();
    queued_.assign(std::size_t(n_), false);
    for (int k = 0; k + 1 < n_; ++k) verified(at(k), at(k + 1));
    verified(-1, at(0)), verified(at(n_ - 1), n_);
    total_ = sum();
  }

  double total() const { return total_; }
  std::vector<int> order() const {
    std::vector<int> out;
    for (const int i : at_) out.push_back(places_[std::size_t(i)]);
    return out;
  }

  void improve_everywhere() {
    for (const int i : at_) push(i);
    improve();
  }

  /// Swaps two neighbouring stretches, searches on from there, and goes back if that was no gain.
  void kick(std::mt19937_64& random) {
    if (n_ < 4) return;
    const int span = std::min(n_, kKickSpan);
    const int first = int(random() % std::uint64_t(n_ - span + 1));
    int cut[3];
    for (int& c : cut) c = first + int(random() % std::uint64_t(span + 1));
    std::sort(cut, cut + 3);
    if (cut[0] == cut[1] || cut[1] == cut[2]) return;
    const std::vector<int> kept = at_;
    const double before = total_;
    std::rotate(at_.begin() + cut[0], at_.begin() + cut[1], at_.begin() + cut[2]);
    renumber(cut[0], cut[2] - 1);
    const int middle = cut[0] + cut[2] - cut[1];
    for (const int k : {cut[0] - 1, middle - 1, cut[2] - 1}) {
      verified(end_or(k), end_or(k + 1));
      if (k >= 0) push(at(k));
      if (k + 1 < n_) push(at(k + 1));
    }
    total_ = sum();
    improve();
    if (total_ < before - kGain) return;
    at_ = kept;
    renumber(0, n_ - 1);
    total_ = before;
  }

 private:
  int at(int k) const { return at_[std::size_t(k)]; }
  int end_or(int k) const { return k < 0 ? -1 : k >= n_ ? n_ : at(k); }  // -1 and n_ stand for the ends
  int position(int i) const { return position_[std::size_t(i)]; }

  double cost(int i, int j) const { return ask(problem_.cost, i, j); }
  double verified(int i, int j) { return ask(problem_.true_cost, i, j); }
  double ask(const std::function<double(int, int)>& f, int i, int j) const {
    if (i > j) std::swap(i, j);
    const int a = i < 0 ? problem_.before : places_[std::size_t(i)];
    const int b = j >= n_ ? problem_.after : places_[std::size_t(j)];
    return a < 0 || b < 0 ? 0 : f(a, b);
  }
  double sum() const {
    double total = 0;
    for (int k = -1; k < n_; ++k) total += cost(end_or(k), end_or(k + 1));
    return total;
  }
  void renumber(int first, int last) {
    for (int k = first; k <= last; ++k) position_[std::size_t(at(k))] = k;
  }
  void push(int i) {
    if (i < 0 || i >= n_ || queued_[std::size_t(i)]) return;
    queued_[std::size_t(i)] = true;
    queue_.push_back(i);
  }

  void list_neighbours() {
    neighbours_.resize(std::size_t(n_));
    std::vector<std::pair<double, int>> all;
    const std::size_t count = std::min(kNeighbours, std::size_t(std::max(0, n_ - 1)));
    for (int i = 0; i < n_; ++i) {
      all.clear();
      for (int j = 0; j < n_; ++j)
        if (j != i) all.emplace_back(problem_.distance(places_[std::size_t(i)], places_[std::size_t(j)]), j);
      std::partial_sort(all.begin(), all.begin() + std::ptrdiff_t(count), all.end());
      for (std::size_t k = 0; k < count; ++k) neighbours_[std::size_t(i)].push_back(all[k].second);
    }
  }

  void improve() {
    while (!queue_.empty()) {
      const int i = queue_.front();
      queue_.pop_front();
      queued_[std::size_t(i)] = false;
      while (improve_at(i)) {
      }
    }
  }

  bool improve_at(int i) {
    for (const int j : neighbours_[std::size_t(i)]) {
      const int p = position(i), q = position(j), low = std::min(p, q), high = std::max(p, q);
      // i and j become neighbours by turning round what lies between: their followers, or their predecessors, too.
      if (reversed(low + 1, high) || reversed(low, high - 1)) return true;
      for (int length = 1; length <= 3; ++length)
        for (const int first : {p, p - length + 1}) {
          const int last = first + length - 1;
          if (first < 0 || last >= n_ || (q >= first && q <= last)) continue;
          for (const int gap : {q, q + 1})  // before or behind j
            for (const bool turn : {false, true})
              if (moved(first, last, gap, turn)) return true;
          if (length == 1) break;
        }
    }
    return false;
  }

  /// Are the new edges true gains? Then total_ is the new one.
  template <std::size_t N>
  bool gains(const std::pair<int, int> (&added)[N], const std::pair<int, int> (&removed)[N]) {
    double old = 0, now = 0;
    for (const auto& [i, j] : removed) old += cost(i, j);
    for (const auto& [i, j] : added) now += cost(i, j);
    if (!(now < old - kGain)) return false;
    now = 0;
    for (const auto& [i, j] : added) {
      now += verified(i, j);
      if (!(now < old - kGain)) return false;
    }
    total_ += now - old;
    for (const auto& [i, j] : added) push(i), push(j);
    for (const auto& [i, j] : removed) push(i), push(j);
    return true;
  }

  bool reversed(int first, int last) {
    if (first >= last || first < 0 || last >= n_) return false;
    const int a = end_or(first - 1), b = at(first), c = at(last), d = end_or(last + 1);
    const std::pair<int, int> added[] = {{a, c}, {b, d}}, removed[] = {{a, b}, {c, d}};
    if (!gains(added, removed)) return false;
    std::reverse(at_.begin() + first, at_.begin() + last + 1);
    renumber(first, last);
    return true;
  }

  /// The stretch first … last goes into the gap before position `gap`, turned round or not.
  bool moved(int first, int last, int gap, bool turn) {
    if (gap >= first && gap <= last + 1) return false;
    int head = at(first), tail = at(last);
    const int a = end_or(first - 1), b = end_or(last + 1), c = end_or(gap - 1), d = end_or(gap);
    if (turn) std::swap(head, tail);
    const std::pair<int, int> added[] = {{a, b}, {c, head}, {tail, d}},
                              removed[] = {{a, at(first)}, {at(last), b}, {c, d}};
    if (!gains(added, removed)) return false;
    if (turn) std::reverse(at_.begin() + first, at_.begin() + last + 1);
    if (gap < first) {
      std::rotate(at_.begin() + gap, at_.begin() + first, at_.begin() + last + 1);
      renumber(gap, last);
    } else {
      std::rotate(at_.begin() + first, at_.begin() + last + 1, at_.begin() + gap);
      renumber(first, gap - 1);
    }
    return true;
  }

  const PathProblem& problem_;
  int n_;
  std::vector<int> places_, at_, position_;
  std::vector<std::vector<int>> neighbours_;
  std::vector<bool> queued_;
  std::deque<int> queue_;
  double total_ = 0;
};

std::vector<int> nearest_neighbour(const PathProblem& problem) {
  std::vector<int> left = problem.places, order;
  int here = problem.before >= 0 ? problem.before : left.front();
  while (!left.empty()) {
    std::size_t best = 0;
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < left.size(); ++i)
      if (const double d = problem.distance(here, left[i]); d < least) least = d, best = i;
    here = left[best];
    order.push_back(here);
    left.erase(left.begin() + std::ptrdiff_t(best));
  }
  return order;
}

}  // namespace

double path_cost(const PathProblem& problem, const std::vector<int>& order) {
  if (order.empty()) return 0;
  double total = problem.before >= 0 ? problem.cost(problem.before, order.front()) : 0;
  for (std::size_t i = 1; i < order.size(); ++i) total += problem.cost(order[i - 1], order[i]);
  return total + (problem.after >= 0 ? problem.cost(order.back(), problem.after) : 0);
}

std::vector<int> short_path(const PathProblem& problem, int kicks, std::uint64_t seed, Job& job) {
  if (problem.places.size() < 2) return problem.places;
  std::vector<std::vector<int>> starts = problem.starts;
  starts.push_back(nearest_neighbour(problem));
  const auto best = std::min_element(starts.begin(), starts.end(), [&](const auto& a, const auto& b) {
    return path_cost(problem, a) < path_cost(problem, b);
  });
  Search search(problem, *best);
  search.improve_everywhere();
  std::mt19937_64 random(seed);
  for (int k = 0; k < kicks; ++k) {
    if (k % 64 == 0) job.check();
    search.kick(random);
  }
  return search.order();
}

}  // namespace lumihull::capture::internal
