// The sparse Cholesky factors against dense algebra: rank, solutions, shortest ones, uniqueness.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "phs/linear_algebra/block_cholesky.h"
#include "phs/linear_algebra/linear_algebra.h"

namespace porthos::phs::block_cholesky_test {
namespace {

using Vec = std::vector<double>;
using Pairs = std::vector<std::pair<int, int>>;

/// A = F Fᵀ, where the rows of a block are zero but for the columns that belong to its nodes.
struct Problem {
  std::vector<int> sizes, at;
  Pairs neighbours;
  Matrix A;
};

/// Blocks that meet at nodes, without their elements.
Problem blocks(const std::vector<std::vector<int>>& touch) {
  Problem p;
  int m = 0;
  for (size_t b = 0; b < touch.size(); ++b) {
    p.at.push_back(m);
    p.sizes.push_back(1 + int(b * 5 % 6));
    m += p.sizes.back();
    for (size_t a = 0; a < b; ++a)
      for (const int x : touch[a])
        for (const int y : touch[b])
          if (x == y) p.neighbours.emplace_back(a, b);
  }
  return p;
}
/// touch: nodes of each block, four columns a node. In every fifth block one row is a combination
/// of others of its block, in every seventh one is zero.
Problem problem(const std::vector<std::vector<int>>& touch, int nodes, unsigned seed) {
  Problem p = blocks(touch);
  std::mt19937_64 rng(seed);
  std::normal_distribution<double> normal;
  const int m = p.at.back() + p.sizes.back();
  Matrix F(m, 4 * nodes);
  for (size_t b = 0; b < touch.size(); ++b)
    for (int i = 0; i < p.sizes[b]; ++i)
      for (const int node : touch[b])
        for (int k = 4 * node; k < 4 * node + 4; ++k)
          F(p.at[b] + i, k) = b % 7 == 0 && i == 1   ? 0
                              : b % 5 == 0 && i == 3 ? F(p.at[b], k) - 2 * F(p.at[b] + 2, k)
                                                     : normal(rng);
  p.A = Matrix(m, m);
  for (int i = 0; i < m; ++i)
    for (int j = 0; j < m; ++j)
      for (int k = 0; k < F.cols; ++k) p.A(i, j) += F(i, k) * F(j, k);
  return p;
}

/// The factors of a problem, and its rows by place.
struct Factored {
  BlockPattern pattern;
  BlockCholesky<double> factors;
  std::vector<int> place;
  int rank;

  Factored(const Problem& p, BlockPattern by) : pattern(std::move(by)), factors(pattern) {
    const auto set = [&](int a, int b) {
      if (pattern.place(a) < pattern.place(b)) std::swap(a, b);
      const auto to = pattern.locate(a, b);
      for (int i = 0; i < p.sizes[size_t(a)]; ++i)
        for (int j = 0; j < (a == b ? i + 1 : p.sizes[size_t(b)]); ++j)
          factors.elements()[to.offset + size_t(i) * to.stride + size_t(j)] =
              p.A(p.at[size_t(a)] + i, p.at[size_t(b)] + j);
    };
    for (int b = 0; b < int(p.sizes.size()); ++b) set(b, b);
    for (const auto& [a, b] : p.neighbours) set(a, b);
    Vec bound(size_t(p.A.rows));
    for (size_t b = 0; b < p.sizes.size(); ++b)
      for (int i = 0; i < p.sizes[b]; ++i) {
        place.push_back(pattern.place(int(b)) + i);
        bound[size_t(place.back())] = 1 + 2 * p.A(int(place.size()) - 1, int(place.size()) - 1);
      }
    rank = factors.factor(bound);
  }
  Vec by_place(const Vec& x) const {
    Vec y(x.size());
    for (size_t i = 0; i < x.size(); ++i) y[size_t(place[i])] = x[i];
    return y;
  }
  Vec by_row(const Vec& y) const {
    Vec x(y.size());
    for (size_t i = 0; i < x.size(); ++i) x[i] = y[size_t(place[i])];
    return x;
  }
  Vec solution(const Vec& r) const {
    Vec x = by_place(r);
    factors.solve(std::span(x));
    return by_row(x);
  }
};

Vec times(const Matrix& A, const Vec& x) {
  Vec y(x.size(), 0.0);
  for (int i = 0; i < A.rows; ++i)
    for (int j = 0; j < A.cols; ++j) y[size_t(i)] += A(i, j) * x[size_t(j)];
  return y;
}
double distance(const Vec& a, const Vec& b) {
  double most = 0;
  for (size_t i = 0; i < a.size(); ++i) most = std::max(most, std::fabs(a[i] - b[i]));
  return most;
}
Vec numbers(size_t n, unsigned seed) {
  std::mt19937_64 rng(seed);
  std::normal_distribution<double> normal;
  Vec x(n);
  for (double& c : x) c = normal(rng);
  return x;
}

/// A chain, a tree and a grid of blocks: each block joins two nodes.
std::vector<std::vector<int>> chain(int n) {
  std::vector<std::vector<int>> all;
  for (int i = 0; i < n; ++i) all.push_back({i, i + 1});
  return all;
}
std::vector<std::vector<int>> tree(int n) {
  std::vector<std::vector<int>> all;
  for (int i = 1; i <= n; ++i) all.push_back({(i - 1) / 2, i});
  return all;
}
std::vector<std::vector<int>> grid(int n) {
  std::vector<std::vector<int>> all;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j + 1 < n; ++j) {
      all.push_back({n * i + j, n * i + j + 1});
      all.push_back({n * j + i, n * (j + 1) + i});
    }
  return all;
}

/// Against the same matrix as one dense block, and against the pseudo-inverse.
TEST(BlockCholesky, SparseFactorsAgreeWithDenseOnes) {
  const struct {
    const char* name;
    std::vector<std::vector<int>> touch;
    int nodes;
  } cases[] = {{"chain", chain(30), 31}, {"tree", tree(40), 41}, {"grid", grid(4), 16}};
  for (const auto& c : cases) {
    const Problem p = problem(c.touch, c.nodes, 5);
    const size_t m = size_t(p.A.rows);
    const Factored sparse(p, BlockPattern(p.sizes, p.neighbours));
    Pairs all;
    for (int a = 0; a < int(p.sizes.size()); ++a)
      for (int b = 0; b < a; ++b) all.emplace_back(a, b);
    const Factored dense(p, BlockPattern(p.sizes, all));
    ASSERT_EQ(dense.pattern.fronts().size(), 1u);
    EXPECT_GT(sparse.pattern.fronts().size(), 3u) << c.name;
    EXPECT_LT(2 * sparse.pattern.elements(), m * m) << c.name;
    const auto pseudo = pseudo_inverse(p.A);
    EXPECT_EQ(sparse.rank, pseudo.rank) << c.name;
    EXPECT_EQ(dense.rank, pseudo.rank) << c.name;
    EXPECT_LT(sparse.rank, int(m)) << c.name;

    const Vec r = times(p.A, numbers(m, 9));
    Vec x = sparse.solution(r);
    const double residual = distance(times(p.A, x), r);
    for (size_t i = 0; i < m; ++i)
      EXPECT_TRUE(sparse.factors.uses(sparse.place[i]) || x[i] == 0) << i;
    Vec shortest = sparse.by_place(x);
    sparse.factors.shorten(shortest);
    const double off = distance(sparse.by_row(shortest), times(pseudo.inverse, r));
    std::printf("  %-5s %3zu rows, rank %3d: %.2f of the elements, residual %.1e, shortest %.1e\n",
                c.name, m, sparse.rank, double(sparse.pattern.elements()) / double(m * m), residual,
                off);
    EXPECT_LT(residual, 1e-10) << c.name;
    EXPECT_LT(off, 1e-8) << c.name;  // the condition number is 1e5
    for (size_t i = 0; i < m; ++i) {
      double own = 0;  // of the projection onto the kernel, 1 - A⁺A
      for (size_t k = 0; k < m; ++k) own += pseudo.inverse(int(i), int(k)) * p.A(int(k), int(i));
      EXPECT_EQ(sparse.factors.unique(sparse.place[i]), 1 - own < 1e-9) << c.name << " " << i;
    }
    // Control: a pair of neighbours that is forgotten.
    Pairs fewer = p.neighbours;
    fewer.pop_back();
    Problem forgotten = p;
    forgotten.neighbours = fewer;
    const Factored wrong(forgotten, BlockPattern(p.sizes, fewer));
    EXPECT_GT(distance(times(p.A, wrong.solution(r)), r), 1e-3) << c.name;
  }
}

/// Right-hand sides together have the bits that they have alone.
TEST(BlockCholesky, ColumnsHaveTheBitsThatTheyHaveAlone) {
  const Problem p = problem(chain(30), 31, 6);
  const Factored f(p, BlockPattern(p.sizes, p.neighbours));
  const size_t m = size_t(p.A.rows);
  std::vector<Pack8> all(m);
  std::vector<Vec> each;
  for (int c = 0; c < 8; ++c) {
    each.push_back(f.by_place(times(p.A, numbers(m, unsigned(c)))));
    for (size_t i = 0; i < m; ++i) all[i].set(c, each[size_t(c)][i]);
  }
  f.factors.solve(std::span(all));
  for (int c = 0; c < 8; ++c) {
    auto& own = each[size_t(c)];
    f.factors.solve(std::span(own));
    for (size_t i = 0; i < m; ++i) EXPECT_EQ(all[i][c], own[i]);
  }
}

/// Rows of very different units, dependent on each other: rank and shortest solution of one block.
TEST(BlockCholesky, UnitsOfRowsDoNotMatter) {
  for (const int rank : {1, 3, 6, 9}) {
    constexpr int n = 9;
    const Vec F = numbers(size_t(n * rank), unsigned(rank));
    Problem p{{n}, {0}, {}, Matrix(n, n)};
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j)
        for (int k = 0; k < rank; ++k)
          p.A(i, j) += F[size_t(i * rank + k)] * F[size_t(j * rank + k)] * (i == 2 ? 1001 : 1) *
                       (j == 2 ? 1001 : 1);
    const Factored f(p, BlockPattern(p.sizes, p.neighbours));
    EXPECT_EQ(f.rank, rank);
    const Vec r = times(p.A, numbers(n, 3));
    Vec x = f.solution(r);
    f.factors.shorten(x);
    EXPECT_LT(distance(x, times(pseudo_inverse(p.A).inverse, r)), 1e-6) << rank;
  }
}

/// The elements of a chain grow with its length; those of loops that all meet are one block.
TEST(BlockCholesky, PatternsFillLittle) {
  const auto elements = [](const std::vector<std::vector<int>>& touch) {
    const Problem p = blocks(touch);
    return double(BlockPattern(p.sizes, p.neighbours).elements());
  };
  const double ten = elements(chain(60)), more = elements(chain(240));
  std::printf("  elements per block: %.1f of 60, %.1f of 240\n", ten / 60, more / 240);
  EXPECT_NEAR(more / ten, 4, 0.2);
  const std::vector<int> sizes(50, 2);
  Pairs star;
  for (int a = 0; a < 50; ++a)
    for (int b = 0; b < a; ++b) star.emplace_back(a, b);
  const BlockPattern dense(sizes, star);
  ASSERT_EQ(dense.fronts().size(), 1u);
  for (int b = 0; b < 50; ++b) EXPECT_EQ(dense.place(b), 2 * b);  // rows keep their order
}

}  // namespace
}  // namespace porthos::phs::block_cholesky_test
