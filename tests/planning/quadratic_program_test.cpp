// The dual active-set method against closed forms and the conditions of an optimum in long double.
#include "planning/quadratic_program.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <random>

#include "phs/error.h"

namespace porthos::planning::quadratic_program_test {
namespace {

using Status = QpSolution::Status;

/// Largest violation of the conditions of an optimum: stationarity and complementarity relative to
/// the terms that cancel in them, the rows relative to their own.
double kkt(const QuadraticProgram& p, const QpSolution& s) {
  const auto n = size_t(p.n);
  long double worst = 0;
  for (size_t i = 0; i < n; ++i) {
    long double sum = p.a[i], size = std::fabs(p.a[i]) + 1;
    const auto count = [&](long double term) {
      sum += term;
      size += std::fabs(term);
    };
    for (size_t j = 0; j < n; ++j) count((long double)p.G[i + n * j] * s.x[j]);
    for (size_t r = 0; r < p.c.size(); ++r) count(-(long double)p.C[r * n + i] * s.multipliers[r]);
    worst = std::max(worst, std::fabs(sum) / size);
  }
  for (size_t r = 0; r < p.c.size(); ++r) {
    long double sum = -p.c[r], size = std::fabs(p.c[r]) + 1;
    for (size_t j = 0; j < n; ++j) {
      sum += (long double)p.C[r * n + j] * s.x[j];
      size += std::fabs((long double)p.C[r * n + j] * s.x[j]);
    }
    const bool equality = int(r) < p.equalities;
    worst = std::max(worst, (equality ? std::fabs(sum) : std::max(-sum, 0.0L)) / size);
    if (equality) continue;
    const long double u = s.multipliers[r];
    worst = std::max(worst, std::max(-u, 0.0L) / (1 + std::fabs(u)));
    worst = std::max(worst, std::fabs(u * sum) / (size * (1 + std::fabs(u))));
  }
  return double(worst);
}

/// A convex program with `equalities` and `rows - equalities` inequalities that some x meets.
QuadraticProgram random_program(std::mt19937& gen, int n, int equalities, int rows) {
  std::normal_distribution<double> normal;
  QuadraticProgram p;
  p.n = n;
  p.equalities = equalities;
  std::vector<double> B(size_t(n * n)), meets(size_t(n), 0.0);
  for (auto& b : B) b = normal(gen);
  for (auto& x : meets) x = normal(gen);
  p.G.assign(size_t(n * n), 0.0);
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      for (int k = 0; k < n; ++k)
        p.G[size_t(i + n * j)] += B[size_t(k + n * i)] * B[size_t(k + n * j)];
      if (i == j) p.G[size_t(i + n * j)] += 0.1 * n;
    }
  for (int i = 0; i < n; ++i) p.a.push_back(10 * normal(gen));
  for (int r = 0; r < rows; ++r) {
    double at = 0;
    for (int j = 0; j < n; ++j) {
      p.C.push_back(normal(gen));
      at += p.C.back() * meets[size_t(j)];
    }
    p.c.push_back(r < equalities ? at : at - (r % 3 ? std::fabs(normal(gen)) : 0.0));
  }
  return p;
}

QuadraticProgram known() {  // 4x1 + 3x2 ≤ 8, 2x1 + x2 ≥ 2, x3 ≥ 2x2
  return {3,         0, {1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, -5, 0}, {-4, -3, 0, 2, 1, 0, 0, -2, 1},
          {-8, 2, 0}};
}

TEST(QuadraticProgram, KnownAnswer) {
  const auto p = known();
  QpSolver solver;
  QpSolution s = solver.solve(p);
  ASSERT_EQ(s.status, Status::optimal);
  const double x[] = {10. / 21, 22. / 21, 44. / 21};
  for (size_t i = 0; i < 3; ++i) EXPECT_NEAR(s.x[i], x[i], 1e-15 * 4);
  EXPECT_NEAR(s.value, -50. / 21, 1e-14);
  EXPECT_EQ(s.active.size(), 2u);
  std::printf("  KKT %.1e (bound 1e-15)\n", kkt(p, s));
  EXPECT_LE(kkt(p, s), 1e-15);
  for (auto& u : s.multipliers) u = -u;  // control: multipliers of the wrong sign
  EXPECT_GE(kkt(p, s), 0.1);
}

TEST(QuadraticProgram, RandomPrograms) {
  std::mt19937 gen(1);
  QpSolver solver, warm;
  double worst = 0, apart = 0;
  int steps = 0, warm_steps = 0, active = 0;
  for (int k = 0; k < 400; ++k) {
    const int n = 2 + k % 40, equalities = (k / 3) % (n / 2 + 1);
    auto p = random_program(gen, n, equalities, equalities + 1 + 3 * (k % 37));
    const QpSolution s = solver.solve(p);
    ASSERT_EQ(s.status, Status::optimal) << k;
    worst = std::max(worst, kkt(p, s));
    active += int(s.active.size()) - equalities;
    (void)warm.solve(p);
    for (auto& a : p.a) a *= 1.01;  // a near program: warm and cold
    const QpSolution cold = solver.solve(p);
    const QpSolution again = warm.solve(p, QpSolver::Start::warm);
    ASSERT_EQ(again.status, Status::optimal) << k;
    worst = std::max({worst, kkt(p, cold), kkt(p, again)});
    for (size_t i = 0; i < size_t(n); ++i)
      apart = std::max(apart, std::fabs(again.x[i] - cold.x[i]) / (1 + std::fabs(cold.x[i])));
    steps += cold.steps;
    warm_steps += again.steps;
  }
  std::printf(
      "  KKT %.1e (bound 1e-12), warm and cold %.1e apart (1e-12), %d rows active, steps %d cold "
      "%d warm\n",
      worst, apart, active, steps, warm_steps);
  EXPECT_LE(worst, 1e-12);
  EXPECT_LE(apart, 1e-12);
  EXPECT_GE(active, 1000);
  EXPECT_LT(10 * warm_steps, 3 * steps);
}

/// Rows more than once, rows that follow from others, a vertex where twice as many rows meet as
/// there are unknowns, equalities that repeat.
TEST(QuadraticProgram, Degenerate) {
  std::mt19937 gen(2);
  QpSolver solver;
  double worst = 0;
  for (int k = 0; k < 200; ++k) {
    const int n = 2 + k % 15;
    auto p = random_program(gen, n, k % 2, 6 * n);
    const auto copy_row = [&](int r, double scale, bool front) {
      const auto begin = p.C.begin() + long(r) * n;
      std::vector<double> row(begin, begin + n);
      for (auto& e : row) e *= scale;
      const double c = p.c[size_t(r)] * scale;
      p.C.insert(front ? p.C.begin() : p.C.end(), row.begin(), row.end());
      p.c.insert(front ? p.c.begin() : p.c.end(), c);
    };
    for (int r = p.equalities; r < 3 * n; ++r) copy_row(r, r % 2 ? 1 : 3.7, false);
    if (p.equalities) {
      copy_row(0, -2.3, true);
      ++p.equalities;
    }
    const auto& s = solver.solve(p);
    ASSERT_EQ(s.status, Status::optimal) << k;
    worst = std::max(worst, kkt(p, s));
  }
  std::printf("  KKT %.1e (bound 1e-12)\n", worst);
  EXPECT_LE(worst, 1e-12);
}

/// The rows of a conflict, weighted, add up to 0 ≥ (something positive): a proof.
/// Control: without the contradicting rows the program has an optimum.
TEST(QuadraticProgram, NamesWhatContradicts) {
  std::mt19937 gen(3);
  QpSolver solver;
  for (int k = 0; k < 100; ++k) {
    const int n = 3 + k % 12;
    auto p = random_program(gen, n, k % 3, k % 3 + 2 * n);
    const auto meets = p;
    std::vector<double> row(size_t(n),
                            0.0);  // minus the sum of three rows must exceed that of their c
    double c = 0.1;
    for (int r = 0; r < 3; ++r) {
      for (int j = 0; j < n; ++j) row[size_t(j)] -= p.C[size_t(r * n + j)];
      c -= p.c[size_t(r)];
    }
    p.C.insert(p.C.end(), row.begin(), row.end());
    p.c.push_back(c);
    const auto& s = solver.solve(p);
    ASSERT_EQ(s.status, Status::infeasible) << k;
    ASSERT_EQ(s.conflict.size(), s.conflict_weights.size());
    double right = 0;
    std::vector<double> left(size_t(n), 0.0);
    for (size_t i = 0; i < s.conflict.size(); ++i) {
      const int r = s.conflict[i];
      EXPECT_TRUE(r < p.equalities || s.conflict_weights[i] >= 0) << k;
      right += s.conflict_weights[i] * p.c[size_t(r)];
      for (int j = 0; j < n; ++j) left[size_t(j)] += s.conflict_weights[i] * p.C[size_t(r * n + j)];
    }
    EXPECT_GT(right, 1e-3) << k;
    for (const double e : left) EXPECT_NEAR(e, 0, 1e-11) << k;
    EXPECT_EQ(solver.solve(meets).status, Status::optimal) << k;
  }
}

TEST(QuadraticProgram, RefusesWrongInput) {
  QpSolver solver;
  auto p = known();
  p.G[4] = -1;
  EXPECT_THROW((void)solver.solve(p), InvalidArgument);
  p = known();
  p.a[1] = NAN;
  EXPECT_THROW((void)solver.solve(p), InvalidArgument);
  p = known();
  p.C.pop_back();
  EXPECT_THROW((void)solver.solve(p), InvalidArgument);
  p = known();
  p.equalities = 4;
  EXPECT_THROW((void)solver.solve(p), InvalidArgument);
}

/// Prints times; asserts none.
TEST(QuadraticProgram, Time) {
  std::mt19937 gen(4);
  for (const int n : {30, 45, 60}) {
    auto p = random_program(gen, n, n / 4, n / 4 + 3 * n);
    QpSolver solver;
    double cold = HUGE_VAL, warm = HUGE_VAL;
    int steps = 0;
    for (int k = 0; k < 200; ++k) {
      const auto start = k % 2 ? QpSolver::Start::warm : QpSolver::Start::cold;
      const auto t = std::chrono::steady_clock::now();
      const auto& s = solver.solve(p, start);
      const double us =
          std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - t).count();
      (k % 2 ? warm : cold) = std::min(k % 2 ? warm : cold, us);
      ASSERT_EQ(s.status, Status::optimal);
      if (k == 0) steps = s.steps;
    }
    std::printf("  n = %d, %d equalities, %d inequalities: %.0f us cold (%d steps), %.0f us warm\n",
                n, n / 4, 3 * n, cold, steps, warm);
  }
}

}  // namespace
}  // namespace porthos::planning::quadratic_program_test
