// Strict priorities against nested least squares, and against solutions by other means with limits.
#include "planning/task_hierarchy.h"

#include <gtest/gtest.h>

#include <Eigen/QR>
#include <cmath>
#include <random>

#include "phs/error.h"

namespace porthos::planning::task_hierarchy_test {
namespace {

using Matrix = Eigen::Matrix<double, -1, -1, Eigen::RowMajor>;
using Vector = Eigen::VectorXd;

std::mt19937& random() {
  static std::mt19937 gen(7);
  return gen;
}

Matrix normal(long rows, long cols) {
  std::normal_distribution<double> d;
  Matrix m(rows, cols);
  for (long i = 0; i < m.size(); ++i) m.data()[i] = d(random());
  return m;
}

TaskLevel level(const std::string& name, const Matrix& A, const Matrix& b, const Matrix& C = {},
                const Matrix& c = {}) {
  const auto list = [](const Matrix& m) {
    return std::vector<double>(m.data(), m.data() + m.size());
  };
  return {name, list(A), list(b), list(C), list(c)};
}

Vector at(const HierarchySolution& s) {
  return Eigen::Map<const Vector>(s.x.data(), long(s.x.size()));
}

/// x_k = x_{k-1} + (A_k N)⁺ (b_k - A_k x_{k-1}), N = 1 - A⁺A of all rows above; the rank of some
/// levels is less than their rows, and the last ones have no freedom left.
TEST(TaskHierarchy, NestedLeastSquares) {
  double worst = 0;
  for (int k = 0; k < 100; ++k) {
    const long n = 4 + k % 20;
    TaskHierarchy hierarchy{int(n)};
    std::vector<TaskLevel> levels;
    Vector x = Vector::Zero(n);
    Matrix above(0, n);
    for (int l = 0; l < 5; ++l) {
      const long rows = 1 + (k + 2 * l) % 5;
      Matrix A = normal(rows, n);
      if (rows > 2 && k % 2) A.row(2) = A.row(0) - 2 * A.row(1);
      if (above.rows() && k % 3 == 0) A.row(0) = above.colwise().sum();  // fixed above
      const Matrix b = normal(rows, 1);
      levels.push_back(level("level " + std::to_string(l), A, b));
      Matrix N = Matrix::Identity(n, n);
      if (above.rows()) {
        Eigen::CompleteOrthogonalDecomposition<Matrix> all;
        all.setThreshold(1e-10);
        all.compute(above);
        N -= all.pseudoInverse() * above;
      }
      const Matrix AN = A * N;
      if (AN.norm() > 1e-10 * A.norm()) {
        Eigen::CompleteOrthogonalDecomposition<Matrix> own;
        own.setThreshold(1e-10);
        own.compute(AN);
        x += own.solve(Vector(b - A * x));
      }
      Matrix more(above.rows() + rows, n);
      more << above, A;
      above = more;
    }
    const auto& s = hierarchy.solve(levels);
    worst = std::max(worst, (at(s) - x).norm() / (1 + x.norm()));
    EXPECT_EQ(s.quadratic_programs, 0);
  }
  std::printf("  %.1e from nested pseudo-inverses (bound 1e-11)\n", worst);
  EXPECT_LE(worst, 1e-11);
}

/// What the levels above reached is the same with and without the last level, with active limits.
/// Control: the same rows as one weighted least-squares problem disturb each other.
TEST(TaskHierarchy, LowerLevelsDisturbNone) {
  double worst = 0, beyond = 0, weighted = HUGE_VAL;
  int programs = 0, freedoms = 0;
  for (int k = 0; k < 100; ++k) {
    const long n = 6 + k % 15;
    std::vector<TaskLevel> levels;
    Matrix box(2 * n, n);
    box << Matrix::Identity(n, n), -Matrix::Identity(n, n);
    levels.push_back(level("limits", {}, {}, box, Matrix::Constant(2 * n, 1, -0.3)));
    for (int l = 0; l < 4; ++l) {
      const long rows = 1 + n / 4;
      levels.push_back(level("task " + std::to_string(l), normal(rows, n), normal(rows, 1)));
    }
    TaskHierarchy hierarchy{int(n)};
    for (size_t last = 2; last < 5; ++last) {
      const HierarchySolution few = hierarchy.solve({levels.data(), last});
      const HierarchySolution more = hierarchy.solve({levels.data(), last + 1});
      programs += more.quadratic_programs;
      freedoms += more.levels[last].freedoms;
      for (size_t l = 0; l < last; ++l) {
        EXPECT_TRUE(few.levels[l].solved && more.levels[l].solved) << k;
        for (size_t i = 0; i < few.levels[l].error.size(); ++i)
          worst = std::max(worst, std::fabs(few.levels[l].error[i] - more.levels[l].error[i]));
      }
      for (const double x : more.x) beyond = std::max(beyond, std::fabs(x) - 0.3);
    }
    const long rows = 1 + n / 4;
    Matrix A(2 * rows, n), b(2 * rows, 1);
    for (long i = 0; i < 2 * rows; ++i) {
      const auto& l = levels[size_t(1 + i / rows)];
      for (long j = 0; j < n; ++j) A(i, j) = l.A[size_t((i % rows) * n + j)];
      b(i, 0) = l.b[size_t(i % rows)];
    }
    const auto one = level("both", A, b);
    const std::vector<TaskLevel> mixed{levels[0], one};
    const HierarchySolution m = hierarchy.solve(mixed);
    const HierarchySolution strict = hierarchy.solve({levels.data(), 2});
    double apart = 0;
    for (long i = 0; i < rows; ++i)
      apart = std::max(apart,
                       std::fabs(m.levels[1].error[size_t(i)] - strict.levels[1].error[size_t(i)]));
    if (strict.levels[1].distance() > 0.01) weighted = std::min(weighted, apart);
  }
  std::printf(
      "  disturbed by %.1e (bound 1e-12), beyond limits %.1e (1e-12), %d programs, %d "
      "degrees of freedom below; as one level at least %.1e\n",
      worst, beyond, programs, freedoms, weighted);
  EXPECT_LE(worst, 1e-12);
  EXPECT_LE(beyond, 1e-12);
  EXPECT_GE(programs, 300);
  EXPECT_GE(freedoms, 100);
  EXPECT_GE(weighted, 1e-5);
}

/// A level's task within a box is the least possible: the gradient of |A x - b|² vanishes in free
/// directions and points outwards at the limits. Control: 0.99 of the solution.
TEST(TaskHierarchy, EachTaskIsAsNearAsPossible) {
  double worst = 0, control = HUGE_VAL;
  int touched = 0;
  for (int k = 0; k < 100; ++k) {
    const long n = 4 + k % 12, rows = 2 + n / 2;  // fewer rows than unknowns: many solutions
    const Matrix A = normal(rows, n), b = 3 * normal(rows, 1);
    Matrix box(2 * n, n);
    box << Matrix::Identity(n, n), -Matrix::Identity(n, n);
    const std::vector<TaskLevel> levels{level("task", A, b, box, Matrix::Constant(2 * n, 1, -0.5))};
    TaskHierarchy hierarchy{int(n)};
    const auto& s = hierarchy.solve(levels);
    const auto residual = [&](const Vector& x) {
      const Vector g = A.transpose() * (A * x - Vector(b));
      double off = 0;
      for (long i = 0; i < n; ++i)
        off = std::max(off, std::fabs(x[i] - std::clamp(x[i] - g[i], -0.5, 0.5)));
      return off;
    };
    worst = std::max(worst, residual(at(s)));
    control = std::min(control, residual(at(s) * 0.99));
    touched += s.quadratic_programs > 0;
  }
  std::printf("  projected gradient %.1e (bound 1e-11), at 0.99 x at least %.1e; %d of 100 touch\n",
              worst, control, touched);
  EXPECT_LE(worst, 1e-11);
  EXPECT_GE(control, 1e-4);
  EXPECT_GE(touched, 80);
}

/// x ≥ 1 above x ≤ 0.4 and x + y = 3: the lower limit is short of 0.6; y is free to meet the task.
/// Two limits of one level that contradict each other share.
TEST(TaskHierarchy, TellsByHowMuch) {
  TaskHierarchy hierarchy(2);
  Matrix one(1, 2), minus(1, 2), sum(1, 2), two(2, 2);
  one << 1, 0;
  minus << -1, 0;
  sum << 1, 1;
  two << 1, 0, -1, 0;
  const auto number = [](double x) { return Matrix::Constant(1, 1, x); };
  std::vector<TaskLevel> levels{level("above", {}, {}, one, number(1)),
                                level("below", sum, number(3), minus, number(-0.4)),
                                level("last", one, number(5))};
  const auto& s = hierarchy.solve(levels);
  EXPECT_TRUE(s.levels[0].met);
  EXPECT_FALSE(s.levels[1].met);
  EXPECT_FALSE(s.met());
  EXPECT_NEAR(s.levels[1].short_of[0], 0.6, 1e-12);
  EXPECT_NEAR(s.levels[1].error[0], 0, 1e-12);
  EXPECT_NEAR(s.x[0], 1, 1e-12);
  EXPECT_NEAR(s.x[1], 2, 1e-12);
  EXPECT_NEAR(s.levels[2].error[0], -4, 1e-12);
  Matrix c(2, 1);
  c << 1, 0;  // x ≥ 1 and x ≤ 0
  levels = {level("both", {}, {}, two, c)};
  const auto& both = hierarchy.solve(levels);
  EXPECT_NEAR(both.levels[0].short_of[0], 0.5, 1e-9);
  EXPECT_NEAR(both.levels[0].short_of[1], 0.5, 1e-9);
  EXPECT_TRUE(both.levels[0].solved);
}

TEST(TaskHierarchy, RefusesWrongInput) {
  TaskHierarchy hierarchy(2);
  std::vector<TaskLevel> levels{level("hand", normal(1, 3), normal(1, 1))};
  try {
    (void)hierarchy.solve(levels);
    FAIL();
  } catch (const InvalidArgument& e) {
    EXPECT_NE(std::string(e.what()).find("'hand'"), std::string::npos) << e.what();
  }
  EXPECT_THROW(TaskHierarchy(0), InvalidArgument);
}

}  // namespace
}  // namespace porthos::planning::task_hierarchy_test
