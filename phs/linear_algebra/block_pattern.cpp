#include "phs/linear_algebra/block_pattern.h"

#include <algorithm>
#include <map>
#include <numeric>
#include <set>

namespace porthos::phs {
namespace {

using Lists = std::vector<std::vector<int>>;

Lists neighbours_of(size_t blocks, std::span<const std::pair<int, int>> pairs) {
  Lists all(blocks);
  for (size_t b = 0; b < blocks; ++b) all[b].push_back(int(b));
  for (const auto& [a, b] : pairs) {
    all[size_t(a)].push_back(b);
    all[size_t(b)].push_back(a);
  }
  for (auto& list : all) {
    std::sort(list.begin(), list.end());
    list.erase(std::unique(list.begin(), list.end()), list.end());
  }
  return all;
}

/// Sets of blocks that are eliminated together, in order, and the blocks that each elimination
/// joins.
struct Elimination {
  Lists members, later;
};

/// Blocks with the same neighbours, themselves included.
Lists twins(const Lists& neighbours) {
  std::map<std::vector<int>, size_t> found;
  Lists all;
  for (size_t b = 0; b < neighbours.size(); ++b) {
    const auto [at, fresh] = found.try_emplace(neighbours[b], all.size());
    if (fresh) all.emplace_back();
    all[at->second].push_back(int(b));
  }
  return all;
}

int count_of(const std::vector<int>& blocks, std::span<const int> sizes) {
  int rows = 0;
  for (const int b : blocks) rows += sizes[size_t(b)];
  return rows;
}

/// Minimum degree over sets of twins; of equal ones the first.
Elimination by_minimum_degree(const Lists& neighbours, std::span<const int> sizes) {
  const Lists sets = twins(neighbours);
  std::vector<int> set_of(neighbours.size()), weight(sets.size());
  for (size_t s = 0; s < sets.size(); ++s) {
    weight[s] = count_of(sets[s], sizes);
    for (const int b : sets[s]) set_of[size_t(b)] = int(s);
  }
  std::vector<std::set<int>> joined(sets.size());
  for (size_t s = 0; s < sets.size(); ++s)
    for (const int b : neighbours[size_t(sets[s].front())])
      if (set_of[size_t(b)] != int(s)) joined[s].insert(set_of[size_t(b)]);
  const auto degree = [&](int s) {
    int rows = 0;
    for (const int other : joined[size_t(s)]) rows += weight[size_t(other)];
    return rows;
  };
  std::set<std::pair<int, int>> queue;
  std::vector<int> degrees(sets.size());
  for (int s = 0; s < int(sets.size()); ++s) queue.insert({degrees[size_t(s)] = degree(s), s});
  Elimination e;
  while (!queue.empty()) {
    const int pivot = queue.begin()->second;
    queue.erase(queue.begin());
    const std::set<int> later = joined[size_t(pivot)];
    for (const int s : later) {
      auto& own = joined[size_t(s)];
      own.insert(later.begin(), later.end());
      own.erase(s);
      own.erase(pivot);
    }
    for (const int s : later) {
      queue.erase({degrees[size_t(s)], s});
      queue.insert({degrees[size_t(s)] = degree(s), s});
    }
    e.members.push_back(sets[size_t(pivot)]);
    auto& blocks = e.later.emplace_back();
    for (const int s : later)
      blocks.insert(blocks.end(), sets[size_t(s)].begin(), sets[size_t(s)].end());
  }
  return e;
}

/// The elimination in which each set of blocks lies, and, of each, the next that it joins (-1:
/// none).
struct Parents {
  std::vector<int> of_block, next;

  Parents(const Elimination& e, size_t blocks) : of_block(blocks), next(e.members.size(), -1) {
    for (size_t k = 0; k < e.members.size(); ++k)
      for (const int b : e.members[k]) of_block[size_t(b)] = int(k);
    for (size_t k = 0; k < next.size(); ++k)
      for (const int b : e.later[k])
        if (const int f = of_block[size_t(b)]; next[k] < 0 || f < next[k]) next[k] = f;
  }
};

/// Joins each set with the next one where that makes no more fill.
Elimination without_needless_fronts(Elimination e, std::span<const int> sizes) {
  const Parents parents(e, sizes.size());
  Elimination merged;
  std::vector<char> taken(e.members.size(), 0);
  for (size_t k = 0; k < e.members.size(); ++k) {
    const int next = parents.next[k];
    if (next < 0) continue;
    auto& into = e.members[size_t(next)];
    if (count_of(e.later[k], sizes) !=
        count_of(into, sizes) + count_of(e.later[size_t(next)], sizes))
      continue;
    into.insert(into.end(), e.members[k].begin(), e.members[k].end());
    taken[k] = 1;
  }
  for (size_t k = 0; k < e.members.size(); ++k) {
    if (taken[k]) continue;
    merged.members.push_back(std::move(e.members[k]));
    merged.later.push_back(std::move(e.later[k]));
  }
  return merged;
}

/// Makes one set of those that are connected where that needs at most twice the elements.
Elimination with_dense_parts(Elimination e, std::span<const int> sizes) {
  const Parents parents(e, sizes.size());
  const size_t n = e.members.size();
  struct Part {
    std::vector<int> blocks;
    double elements = 0;
  };
  std::vector<Part> parts(n);
  std::vector<int> root(n);
  for (size_t k = n; k-- > 0;)
    root[k] = parents.next[k] < 0 ? int(k) : root[size_t(parents.next[k])];
  for (size_t k = 0; k < n; ++k) {
    Part& p = parts[size_t(root[k])];
    const double own = count_of(e.members[k], sizes), below = count_of(e.later[k], sizes);
    p.elements += own * (own + 1) / 2 + own * below;
    p.blocks.insert(p.blocks.end(), e.members[k].begin(), e.members[k].end());
  }
  Elimination joined;
  for (size_t k = 0; k < n; ++k) {
    Part& p = parts[size_t(root[k])];
    const double rows = count_of(p.blocks, sizes);
    if (rows * (rows + 1) / 2 > 2 * p.elements) {
      joined.members.push_back(std::move(e.members[k]));
      joined.later.push_back(std::move(e.later[k]));
    } else if (root[k] == int(k)) {
      joined.members.push_back(std::move(p.blocks));
      joined.later.emplace_back();
    }
  }
  return joined;
}

}  // namespace

BlockPattern::BlockPattern(std::span<const int> sizes,
                           std::span<const std::pair<int, int>> neighbours)
    : place_(sizes.size()) {
  Elimination e = by_minimum_degree(neighbours_of(sizes.size(), neighbours), sizes);
  e = with_dense_parts(without_needless_fronts(std::move(e), sizes), sizes);
  for (auto& members : e.members) std::sort(members.begin(), members.end());
  set_fronts(e.members, e.later, sizes);
}

void BlockPattern::set_fronts(const Lists& members, const Lists& later,
                              std::span<const int> sizes) {
  for (size_t f = 0; f < members.size(); ++f) {
    const int at = rows_;
    for (const int b : members[f]) {
      place_[size_t(b)] = rows_;
      rows_ += sizes[size_t(b)];
    }
    fronts_.push_back({at, rows_ - at, {}, 0});
    front_of_.resize(size_t(rows_), int(f));
  }
  for (size_t f = 0; f < members.size(); ++f) {
    Front& front = fronts_[f];
    for (const int b : later[f])
      for (int r = 0; r < sizes[size_t(b)]; ++r) front.below.push_back(place_[size_t(b)] + r);
    std::sort(front.below.begin(), front.below.end());
    front.data = elements_;
    elements_ += (size_t(front.size) + front.below.size()) * size_t(front.size);
  }
}

BlockPattern::Location BlockPattern::locate(int row, int column) const {
  const int p = place(row), q = place(column);
  const Front& f = fronts_[size_t(front_of(q))];
  const auto below = std::lower_bound(f.below.begin(), f.below.end(), p);
  const auto i = p < f.at + f.size ? p - f.at : f.size + int(below - f.below.begin());
  return {f.data + size_t(i) * size_t(f.size) + size_t(q - f.at), size_t(f.size)};
}

}  // namespace porthos::phs
