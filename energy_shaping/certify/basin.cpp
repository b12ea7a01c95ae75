// The basin of the rest point of a shaped potential, over a region.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>
#include <random>

#include "energy_shaping/certify/detail/region.h"
#include "energy_shaping/certify/detail/shaped_potential.h"

namespace porthos::energy_shaping {
namespace {

using Vec = std::vector<double>;

/// The nodes of a grid over a region.
class Grid {
 public:
  Grid(const Region& region, int cells)
      : region_(region), n_(region.lower.size()), N_(cells), stride_(n_, 1) {
    for (size_t a = 1; a < n_; ++a) stride_[a] = stride_[a - 1] * size_t(N_ + 1);
  }
  size_t nodes() const { return stride_[n_ - 1] * size_t(N_ + 1); }
  size_t stride(size_t a) const { return stride_[a]; }
  double width(size_t a) const { return region_.upper[a] - region_.lower[a]; }
  bool at_border(size_t node, size_t a) const {
    return index(node, a) == 0 || index(node, a) == N_;
  }
  bool at_border(size_t node) const {
    for (size_t a = 0; a < n_; ++a)
      if (at_border(node, a)) return true;
    return false;
  }
  Vec point(size_t node) const {
    Vec q(n_);
    for (size_t a = 0; a < n_; ++a) q[a] = region_.lower[a] + width(a) * index(node, a) / N_;
    return q;
  }
  size_t nearest(const Vec& q) const {
    size_t node = 0;
    for (size_t a = 0; a < n_; ++a) node += stride_[a] * size_t(std::lround(cells_to(q, a)));
    return node;
  }
  /// The corners of the cell that holds q.
  std::vector<size_t> corners(const Vec& q) const {
    std::vector<size_t> all{0};
    for (size_t a = 0; a < n_; ++a) {
      const size_t low = std::min(size_t(cells_to(q, a)), size_t(N_ - 1)), count = all.size();
      for (size_t i = 0; i < count; ++i) {
        all[i] += stride_[a] * low;
        all.push_back(all[i] + stride_[a]);
      }
    }
    return all;
  }

 private:
  double cells_to(const Vec& q, size_t a) const {
    return (q[a] - region_.lower[a]) / width(a) * N_;
  }
  int index(size_t node, size_t a) const { return int(node / stride_[a] % size_t(N_ + 1)); }

  const Region& region_;
  size_t n_;
  int N_;
  std::vector<size_t> stride_;
};

/// V_d at the nodes, each computed once.
class GridPotential {
 public:
  GridPotential(const Grid& grid, ShapedPotential& V)
      : grid_(grid), V_(V), value_(grid.nodes(), std::numeric_limits<double>::quiet_NaN()) {}
  double operator()(size_t node) {
    if (std::isnan(value_[node])) value_[node] = V_(grid_.point(node));
    return value_[node];
  }

 private:
  const Grid& grid_;
  ShapedPotential& V_;
  Vec value_;
};

/// The saddle of a flood: its level and the node that determines it, and which nodes it reached.
struct Flood {
  double level = HUGE_VAL;
  size_t summit;
  std::vector<bool> reached;
};

/// Raises the level from the node `start` until the flood reaches the border or one of `others`.
Flood flood(const Grid& grid, GridPotential& at, size_t n, size_t start,
            const std::vector<size_t>& others) {
  // The lowest level at which a path from the start reaches each node, and the node that determines
  // it.
  using Entry = std::pair<double, std::pair<size_t, size_t>>;  // level, node, summit
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> front;
  std::vector<bool> done(grid.nodes(), false);
  front.push({at(start), {start, start}});
  while (!front.empty()) {
    const auto [l, nodes] = front.top();
    front.pop();
    const auto [node, top] = nodes;
    if (done[node]) continue;
    done[node] = true;
    if (grid.at_border(node) || std::find(others.begin(), others.end(), node) != others.end())
      return {l, top, done};
    for (size_t a = 0; a < n; ++a)
      for (const size_t next : {node - grid.stride(a), node + grid.stride(a)})
        if (!done[next]) {
          const double v = at(next);
          if (std::isfinite(v)) front.push({std::max(l, v), {next, v > l ? next : top}});
        }
  }
  return {HUGE_VAL, start, done};
}

/// Which sides of the box end a basin at a node of its border, and whether they may go further.
std::string ended_by(const ClosedLoop& loop, const Region& r, const Grid& grid, size_t node) {
  const auto names = coordinate_names(loop.plant().description());
  std::string ends;
  bool wider = true;
  for (size_t a = 0; a < r.lower.size(); ++a) {
    if (!grid.at_border(node, a)) continue;
    add_to_list(ends, "'" + names[a] + "'");
    const double q = grid.point(node)[a], out = 1e-3 * grid.width(a);
    Vec x = loop.rest();
    x[a] = q + (q > x[a] ? out : -out);
    wider = wider && loop.hindrance(x).empty();
  }
  return "the box of " + ends + " ends it" + (wider ? ", widen it" : "");
}

/// No component of {V_d < c} around the rest point lies above a pass that it reaches, but the paths
/// of a coarse grid may. So c is lowered to the passes known: those in a cell that the flood
/// touches, or with V_d below c all the straight way to the rest point.
void cap_by_passes(Basin& b, const ClosedLoop& loop, const std::vector<CriticalPoint>& points,
                   const Grid& grid, const std::vector<bool>& reached) {
  for (const auto& p : points) {
    if (p.descending == 0 || !(p.value < b.level)) continue;
    const auto corners = grid.corners(p.q);
    if (std::ranges::none_of(corners, [&](size_t node) { return bool(reached[node]); }) &&
        !straight_way_below(loop, p.q, b.level))
      continue;
    // Newton's method may have found the same pass, to rounding.
    if (b.level - p.value > 1e-9 * std::fabs(b.depth)) {
      b.at = p.q;
      b.method += ", c lowered to a pass that the grid misses";
    }
    b.level = p.value;
    return;  // they are ordered by value
  }
}

}  // namespace

std::vector<double> random_coordinates(const Region& r, std::mt19937_64& generator) {
  std::vector<double> q(r.lower.size());
  for (size_t a = 0; a < q.size(); ++a)
    q[a] = std::uniform_real_distribution<double>(r.lower[a], r.upper[a])(generator);
  return q;
}

bool straight_way_below(const ClosedLoop& loop, std::span<const double> q, double level) {
  const auto system = loop.instantiate<double>();
  Vec x = loop.rest(), V;
  for (int i = 0; i <= 200; ++i) {
    for (size_t k = 0; k < x.size() / 2; ++k)
      x[k] = loop.rest()[k] + i / 200.0 * (q[k] - loop.rest()[k]);
    V.push_back(system->hamiltonian(x));
    if (!(V.back() < level)) return false;
  }
  for (size_t i = 1; i + 1 < V.size(); ++i)  // a summit between two points
    if (!(V[i] + std::fabs(V[i + 1] - 2 * V[i] + V[i - 1]) / 4 < level)) return false;
  return true;
}

bool has_quaternions(const ClosedLoop& loop) {
  for (const auto& b : loop.description().blocks)
    if (b.kind == phs::BlockKind::rotation) return true;
  return false;
}

Basin basin(const ClosedLoop& loop, const Region& region, int cells) {
  if (const size_t n = loop.rest().size() / 2; n > 3 || has_quaternions(loop))
    throw InvalidArgument("the basin of '" + loop.description().name +
                          "': the flood takes up to 3 "
                          "plain coordinates, this has " +
                          std::to_string(n));
  return basin(loop, region, critical_points(loop, region), cells);
}

Basin basin(const ClosedLoop& loop, const Region& region, const std::vector<CriticalPoint>& points,
            int cells) {
  ShapedPotential V(loop);
  const size_t n = V.size();
  const int N = cells > 0 ? cells : n == 1 ? 2000 : n == 2 ? 200 : 48;
  const Grid grid(region, N);
  GridPotential at(grid, V);
  const size_t start = grid.nearest(Vec(loop.rest().begin(), loop.rest().begin() + long(n)));
  std::vector<size_t> others;  // other critical points: a state may come to rest there
  for (const auto& p : points)
    if (const size_t node = grid.nearest(p.q); node != start) others.push_back(node);
  const auto [level, summit, reached] = flood(grid, at, n, start, others);
  Basin b;
  b.level = level;
  b.at = grid.point(summit);
  b.method = fmt::format("flood on a grid of {}^{}", N, n);
  const double bottom = V(std::span(loop.rest()).first(n));
  Vec q = b.at;
  if (grid.at_border(summit)) {
    double slack = 0;
    for (size_t a = 0; a < n; ++a)
      if (!grid.at_border(summit, a))
        slack +=
            std::fabs(at(summit + grid.stride(a)) - 2 * at(summit) + at(summit - grid.stride(a))) /
            8;
    b.level -= slack;
    b.method += ", left through the region's boundary: " + ended_by(loop, region, grid, summit);
  } else if (V.refine(q, region)) {
    bool near = true;
    for (size_t a = 0; a < n; ++a) near = near && std::fabs(q[a] - b.at[a]) < 4 * grid.width(a) / N;
    if (near) {
      b.level = std::min(level, V(q));
      b.at = q;
      b.method += ", pass by Newton's method";
    }
  }
  b.depth = b.level - bottom;
  cap_by_passes(b, loop, points, grid, reached);
  b.depth = b.level - bottom;
  return b;
}

}  // namespace porthos::energy_shaping
