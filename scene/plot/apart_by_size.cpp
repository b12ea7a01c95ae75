#include "scene/plot/apart_by_size.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace porthos::scene {
namespace {

constexpr double seen_beside = 0.01, is_rounding = 1e-9;  // of the size of the largest

double swing_of(const TraceLine& l) {
  double most = 0;
  for (const double v : l.value)
    if (std::isfinite(v)) most = std::max(most, std::fabs(v));
  return most;
}

bool has_sizes(const TracePanel& p) {
  constexpr std::array begins{"outputs [", "torques of ", "powers of ", "efforts of ",
                              "stiffness of "};
  return p.lines.size() > 1 &&
         std::ranges::any_of(begins, [&](const char* with) { return p.what.starts_with(with); });
}

/// Of each line its panel: 0 with the largest, then smaller ones.
std::vector<size_t> ranks_of(const TracePanel& p) {
  std::vector<std::pair<double, size_t>> order;
  for (size_t k = 0; k < p.lines.size(); ++k) order.emplace_back(-swing_of(p.lines[k]), k);
  std::ranges::sort(order);
  const double largest = -order.front().first;
  std::vector<size_t> ranks(p.lines.size(), 0);
  double beside = largest;
  size_t rank = 0;
  for (const auto& [size, k] : order) {
    if (-size <= is_rounding * largest) break;
    if (-size < seen_beside * beside) {
      beside = -size;
      ++rank;
    }
    ranks[k] = rank;
  }
  return ranks;
}

/// "outputs, smaller [N]"
std::string name_of_rank(const std::string& what, size_t rank) {
  std::string name = what;
  if (rank > 0)
    name.insert(what.find(" ["), rank == 1 ? ", smaller" : fmt::format(", smaller {}", rank));
  return name;
}

}  // namespace

std::vector<TracePanel> apart_by_size(std::vector<TracePanel> panels) {
  std::vector<TracePanel> all;
  for (TracePanel& p : panels) {
    const auto ranks = has_sizes(p) ? ranks_of(p) : std::vector<size_t>(p.lines.size(), 0);
    const size_t last = ranks.empty() ? 0 : *std::ranges::max_element(ranks);
    std::vector<TraceLine> lines = std::move(p.lines);
    for (size_t rank = 0; rank <= last; ++rank) {
      TracePanel one = p;
      one.what = name_of_rank(p.what, rank);
      one.lines.clear();
      for (size_t k = 0; k < lines.size(); ++k)
        if (ranks[k] == rank) one.lines.push_back(std::move(lines[k]));
      if (const size_t others = lines.size() - one.lines.size(); rank == 0 && others > 0) {
        const std::string smaller = name_of_rank(p.what, 1);
        one.others = fmt::format("{} {} in '{}'", others, others == 1 ? "other is" : "others are",
                                 smaller.substr(0, smaller.find(" [")));
      }
      all.push_back(std::move(one));
    }
  }
  return all;
}

}  // namespace porthos::scene
