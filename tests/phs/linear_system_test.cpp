// Linear port-Hamiltonian descriptor systems: known transfer functions, the sign of N, what is
// refused, the model.
#include "phs/linear/linear_system.h"

#include "phs/system/check.h"
#include "tests/support/bounds.h"
#include "tests/support/linear_benchmarks.h"

namespace porthos::phs::linear_system_test {
namespace {

using namespace std::complex_literals;
using test::breaks, test::keeps, test::refusal;

template <class T>
double difference(const BasicMatrix<T>& a, const BasicMatrix<T>& b) {
  double worst = 0;
  for (size_t i = 0; i < a.a.size(); ++i) worst = std::max(worst, std::abs(a.a[i] - b.a[i]));
  return worst;
}

// --- transfer functions --------------------------------------------------------------------------

TEST(LinearBenchmarks, MassSpringDamperChain) {
  const auto system = test::mass_spring_damper_chain();
  const ComplexMatrix low{{0.12571198 + 0.073217211i, 0.12262443 + 0.050627838i},
                          {0.12262443 + 0.050627838i, 0.12013249 + 0.05318717i}};
  const ComplexMatrix high{{0.21075037 - 0.090110818i, 0.022527704 - 0.19731241i},
                           {0.022527704 - 0.19731241i, 0.049328102 + 0.0056319261i}};
  // Half a unit of the last digit printed.
  keeps("chain of 50, T(0.1i)", difference(system.transfer(0.1i), low), 5e-9);
  keeps("chain of 50, T(i)", difference(system.transfer(1i), high), 5e-9);
  const auto heavier = test::mass_spring_damper_chain(50, 4.0001);
  breaks("a mass off by 25 ppm, T(i)", difference(heavier.transfer(1i), high), 5e-9);
}

TEST(LinearBenchmarks, RclLadder) {
  const auto system = test::rcl_ladder();
  keeps("ladder of 50, dc gain", std::fabs(system.dc_gain()(0, 0) - (50 * 0.2 + 0.4)), 1e-12);
  const ComplexMatrix low{{1.17211646936 - 0.831377691299i}},
      high{{0.773648565844 - 0.557233642498i}};
  keeps("ladder of 50, T(0.1i)", difference(system.transfer(0.1i), low), 5e-12);
  keeps("ladder of 50, T(i)", difference(system.transfer(1i), high), 7.1e-13);
  breaks("ladder of 49, T(0.1i)", difference(test::rcl_ladder(49).transfer(0.1i), low), 5e-12);
}

TEST(LinearBenchmarks, DcMotor) {
  const test::DcMotor motor;
  const auto system = motor.system();
  double worst = 0;
  for (const auto s : {0.0 + 0i, 0.1i, 10i, 300i, 3.0 + 40i, -7.0 + 2i})
    worst = std::max(worst, std::abs(system.transfer(s)(0, 0) / motor.transfer(s) - 1.0));
  keeps("motor, T(s) against its formula", worst, 1e-14);
  const double gain = motor.b / (motor.Ra * motor.b + motor.k * motor.k);
  keeps("motor, dc gain", std::fabs(system.dc_gain()(0, 0) / gain - 1), 1e-15);
}

TEST(LinearSystem,
     TwoCapacitorsAcrossOneNodeAreOne) {  // index 2: the voltages are tied by a multiplier
  const double C1 = 2, C2 = 3;
  const LinearSystem pair({.E = {{1, 0, 0}, {0, 1, 0}, {0, 0, 0}},
                           .J = {{0, 0, 1}, {0, 0, -1}, {-1, 1, 0}},
                           .Q = {{1 / C1, 0, 0}, {0, 1 / C2, 0}, {0, 0, 1}},
                           .G = {{1}, {0}, {0}}},
                          "capacitor pair");
  const auto s = 0.3 + 0.7i;
  keeps("T(s) = 1/(s(C1 + C2))", std::abs(pair.transfer(s)(0, 0) * s * (C1 + C2) - 1.0), 1e-15);
  EXPECT_TRUE(pair.positive_real().holds());
  EXPECT_EQ(refusal([&] { pair.dc_gain(); }),
            "transfer function: s = 0 + 0i is a pole, sE - A is singular there");
  EXPECT_EQ(refusal([&] { pair.to_model(); }),
            "capacitor pair: has no model x' = ..., because E has rank 2 of 3: some equations are "
            "algebraic");
}

TEST(LinearSystem, RefusesASingularPencil) {
  const LinearSystem idle({.E = {{1, 0}, {0, 0}}, .J = {{0, 0}, {0, 0}}, .G = {{1}, {0}}});
  const std::string sentence =
      "transfer function: the pencil sE - A is singular for every s, so that u does not determine "
      "x";
  EXPECT_EQ(refusal([&] { idle.transfer(1i); }), sentence);
  EXPECT_EQ(refusal([&] { idle.positive_real(); }), sentence) << "no T to be positive real";
}

TEST(LinearSystem, ScalesFarApartAreNotSingular) {  // a microhenry and a picofarad at a gigahertz
  const auto line = test::rcl_ladder(1, 1e3, 0, 1e-12, 1e-6);
  const auto s = 6e9i, expected = 1.0 / (s * 1e-12 + 1.0 / (1e3 + s * 1e-6));
  keeps("RCL at a gigahertz", std::abs(line.transfer(s)(0, 0) / expected - 1.0), 1e-14);
}

// --- the sign of N -------------------------------------------------------------------------------

/// Eliminates the last two, algebraic, states of (E x'; -y) = (J - R, G; -Gᵀ, 0) (z; u). What is
/// left is M11 - M12 M22⁻¹ M21, its skew part (J G; -Gᵀ N), its symmetric one -W.
LinearMatrices eliminated(const LinearMatrices& full) {
  const int n = full.J.rows - 2, m = full.G.cols, kept = n + m;
  const auto at = [&](int i) { return i < n ? i : i + 2; };  // in (z; u)
  const auto M = [&](int i, int j) -> double {
    const int k = n + 2;
    if (i < k && j < k) return full.J(i, j) - full.R(i, j);
    if (i < k) return full.G(i, j - k);
    return j < k ? -full.G(j, i - k) : 0;
  };
  const double a = M(n, n), b = M(n, n + 1), c = M(n + 1, n), d = M(n + 1, n + 1);
  const double det = a * d - b * c, inverse[2][2] = {{d / det, -b / det}, {-c / det, a / det}};
  Matrix reduced(kept, kept);
  for (int i = 0; i < kept; ++i)
    for (int j = 0; j < kept; ++j) {
      reduced(i, j) = M(at(i), at(j));
      for (int k = 0; k < 2; ++k)
        for (int l = 0; l < 2; ++l)
          reduced(i, j) -= M(at(i), n + k) * inverse[k][l] * M(n + l, at(j));
    }
  LinearMatrices out{.J = {n, n}, .R = {n, n}, .G = {n, m}, .P = {n, m}, .S = {m, m}, .N = {m, m}};
  for (int i = 0; i < kept; ++i)
    for (int j = 0; j < kept; ++j) {
      const double skew = (reduced(i, j) - reduced(j, i)) / 2;
      const double W = -(reduced(i, j) + reduced(j, i)) / 2;
      if (i < n && j < n) {
        out.J(i, j) = skew;
        out.R(i, j) = W;
      }
      if (i < n && j >= n) {
        out.G(i, j - n) = skew;
        out.P(i, j - n) = W;
      }
      if (i >= n && j >= n) {
        out.N(i - n, j - n) = skew;
        out.S(i - n, j - n) = W;
      }
    }
  return out;
}

TEST(LinearSystem, TheSignOfNIsThatOfEliminatedEquations) {
  // Two storages, two algebraic equations with friction and a gyrator, two ports; N = P = S = 0.
  const LinearMatrices full{
      .E = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 0, 0}, {0, 0, 0, 0}},
      .J = {{0, -1, 0.5, 0.2}, {1, 0, -0.3, 0.7}, {-0.5, 0.3, 0, 2}, {-0.2, -0.7, -2, 0}},
      .R = {{0.1, 0, 0, 0}, {0, 0.2, 0, 0}, {0, 0, 0.6, 0.1}, {0, 0, 0.1, 0.4}},
      .G = {{1, 0}, {0, 0.5}, {0.8, 0.1}, {-0.3, 1.1}}};
  const auto reduced = eliminated(full);
  std::printf("  the eliminated equations leave N(0,1) = %.3f, S(0,0) = %.3f, P(0,0) = %.3f\n",
              reduced.N(0, 1), reduced.S(0, 0), reduced.P(0, 0));
  EXPECT_GT(std::fabs(reduced.N(0, 1)), 0.1) << "nothing to tell signs apart by";
  auto turned = reduced;
  std::swap(turned.N(0, 1), turned.N(1, 0));
  const LinearSystem a(full), b(reduced), c(turned);
  for (const auto s : {0.0 + 0i, 0.4i, 2.0 + 3i}) {
    keeps("T(s) before and after", difference(a.transfer(s), b.transfer(s)), 1e-15);
    breaks("with N the other way round", difference(a.transfer(s), c.transfer(s)), 0.1);
  }
}

/// H' - yᵀu + [z; u]ᵀW[z; u] for random (x, u), over the sizes of the terms.
double balance_defect(const LinearSystem& system, std::mt19937_64& rng, double P_sign = 1) {
  const auto& m = system.matrices();
  const auto g = system.state_space();
  const int n = system.states(), k = system.ports();
  std::normal_distribution<double> number;
  std::vector<double> x(static_cast<size_t>(n)), u(static_cast<size_t>(k));
  for (double& v : x) v = number(rng);
  for (double& v : u) v = number(rng);
  const auto product = [](const Matrix& M, const std::vector<double>& v) {
    std::vector<double> out(static_cast<size_t>(M.rows));
    for (int i = 0; i < M.rows; ++i)
      for (int j = 0; j < M.cols; ++j) out[size_t(i)] += M(i, j) * v[size_t(j)];
    return out;
  };
  const auto z = product(m.Q, x), Ax = product(g.A, x), Bu = product(g.B, u);
  const auto Cx = product(g.C, x), Du = product(g.D, u);
  const auto Rz = product(m.R, z), Pu = product(m.P, u), Su = product(m.S, u);
  double defect = 0, size = 0;
  const auto add = [&](double term) {
    defect += term;
    size += std::fabs(term);
  };
  for (size_t i = 0; i < z.size(); ++i)  // H' = zᵀE x'
  {
    add(z[i] * (Ax[i] + Bu[i]));
    add(z[i] * Rz[i]);
    add(2 * P_sign * z[i] * Pu[i]);
  }
  for (size_t i = 0; i < u.size(); ++i) {
    add(-u[i] * (Cx[i] + Du[i]));
    add(u[i] * Su[i]);
  }
  return std::fabs(defect) / size;
}

TEST(LinearSystem, PowerBalance) {
  std::mt19937_64 rng(3);
  double worst = 0, wrong = 0;
  for (int i = 0; i < 200; ++i) {
    const LinearSystem system(test::random_matrices(rng, 1 + i % 7, 1 + i % 3));
    worst = std::max(worst, balance_defect(system, rng));
    wrong = std::max(wrong, balance_defect(system, rng, -1));
  }
  keeps("H' = yᵀu - [z;u]ᵀW[z;u], 200 random systems", worst, 1e-13);
  breaks("with -P in W", wrong, 1e-2);
}

// --- refusals ------------------------------------------------------------------------------------

TEST(LinearSystem, NamesWhatIsNotPortHamiltonian) {
  const LinearMatrices good{.E = {{2, 0}, {0, 1}},
                            .J = {{0, 1}, {-1, 0}},
                            .R = {{0, 0}, {0, 1}},
                            .Q = {{1, 0}, {0, 3}},
                            .G = {{1, 0}, {0, 1}},
                            .P = {{0, 0}, {0, 0.5}},
                            .S = {{0, 0}, {0, 1}},
                            .N = {{0, 2}, {-2, 0}}};
  const auto made = [&](auto change) {
    return refusal([&] {
      auto m = good;
      change(m);
      LinearSystem(m, "it");
    });
  };
  EXPECT_EQ(made([](auto&) {}), "");
  EXPECT_EQ(made([](auto& m) { m.J(1, 0) *= 1 + 1e-13; }), "") << "rounding passes";
  EXPECT_EQ(made([](auto& m) { m.J(1, 0) = -0.75; }), "it: J is not skew: J(1,0) + J(0,1) = 0.25");
  EXPECT_EQ(made([](auto& m) { m.J(1, 1) = 1e-9; }), "it: J is not skew: J(1,1) + J(1,1) = 2e-09");
  EXPECT_EQ(made([](auto& m) { m.N(0, 1) = -2; }), "it: N is not skew: N(1,0) + N(0,1) = -4");
  EXPECT_EQ(made([](auto& m) { m.R(0, 1) = 0.1; }),
            "it: R is not symmetric: R(1,0) - R(0,1) = -0.1");
  EXPECT_EQ(made([](auto& m) { m.S(1, 0) = 0.1; }),
            "it: S is not symmetric: S(1,0) - S(0,1) = 0.1");
  EXPECT_EQ(made([](auto& m) { m.Q(0, 1) = 1; }),
            "it: EᵀQ is not symmetric: EᵀQ(1,0) - EᵀQ(0,1) = -2");
  EXPECT_EQ(made([](auto& m) { m.Q(1, 1) = -3; }),
            "it: EᵀQ is not >= 0: its eigenvalue -3 belongs to a vector largest at EᵀQ(1,1)");
  EXPECT_EQ(made([](auto& m) { m.R(0, 0) = -0.01; }),
            "it: W = [R P; Pᵀ S] is not >= 0: its eigenvalue -0.01 belongs to a vector largest at "
            "R(0,0)");
  EXPECT_EQ(made([](auto& m) {
              m.S(1, 1) = 0.25;
              m.P(1, 1) = 1;
            }).substr(0, 60),
            "it: W = [R P; Pᵀ S] is not >= 0: its eigenvalue -0.443 b"
            "el")
      << "R and S >= 0, W not";
  EXPECT_EQ(made([](auto& m) { m.P = Matrix(2, 1); }), "it: P is 2 x 1, expected 2 x 2");
  EXPECT_EQ(made([](auto& m) { m.Q = Matrix(3, 2); }), "it: Q is 3 x 2, expected 2 x 2");
  EXPECT_EQ(made([](auto& m) { m.G(1, 0) = NAN; }), "it: G(1,0) is nan");
  EXPECT_EQ(made([](auto& m) { m.J = {}; }),
            "it: J and G must be given, with one state and one port or more");
  EXPECT_EQ(refusal([] { Matrix{{1, 2}, {3}}; }), "matrix row has 1 entries, expected 2");
}

// --- the model -----------------------------------------------------------------------------------

TEST(LinearSystem, ModelIsTheSystem) {
  std::mt19937_64 rng(5);
  auto m = test::random_matrices(rng, 5, 2);
  m.P = m.S = m.N = {};
  const LinearSystem system(m, "five states");
  const auto model = system.to_model();
  const auto report = check(*model);
  EXPECT_TRUE(report.holds()) << report.text();
  EXPECT_EQ(model->description().name, "five states");
  EXPECT_FALSE(model->description().traits.lossless);

  const auto f = model->instantiate<double>();
  const auto g = system.state_space();
  const std::vector<double> x{0.3, -1, 0.5, 2, -0.7}, u{0.4, -0.9};
  std::vector<double> dx(5), e(5), y(2);
  f->field(0, x, u, dx);
  f->gradient(x, e);
  f->output(x, e, y);
  double state = 0, output = 0, size = 0;  // E x' = Ax + Bu and y = Cx
  for (int i = 0; i < 5; ++i) {
    double defect = 0;
    for (int j = 0; j < 5; ++j) {
      defect += g.E(i, j) * dx[size_t(j)] - g.A(i, j) * x[size_t(j)];
      size = std::max(size, std::fabs(g.E(i, j) * dx[size_t(j)]));
    }
    for (int j = 0; j < 2; ++j) defect -= g.B(i, j) * u[size_t(j)];
    state = std::max(state, std::fabs(defect));
  }
  for (int i = 0; i < 2; ++i) {
    double defect = y[size_t(i)];
    for (int j = 0; j < 5; ++j) defect -= g.C(i, j) * x[size_t(j)];
    output = std::max(output, std::fabs(defect));
  }
  keeps("E x' = Ax + Bu", state, 1e-13 * size);
  keeps("y = Cx", output, 1e-13 * size);
  keeps("H", std::fabs(f->hamiltonian(x) / system.hamiltonian(x) - 1), 1e-15);

  auto lossless = m;
  lossless.R = {};
  EXPECT_TRUE(LinearSystem(lossless).to_model()->description().traits.lossless);
}

TEST(LinearSystem, RefusesAModelWithFeedthrough) {
  const auto reason = [](LinearMatrices m) {
    return refusal([&] { LinearSystem(m, "it").to_model(); });
  };
  LinearMatrices m{.J = {{0, 1}, {-1, 0}}, .R = Matrix::identity(2), .G = Matrix::identity(2)};
  EXPECT_EQ(reason(m), "");
  m.S = {{0, 0}, {0, 2}};
  EXPECT_EQ(reason(m), "it: has no model with y = Gᵀe, because S(1,1) = 2 feeds u through to y");
  m.P = {{0, 0}, {0, 1}};
  EXPECT_EQ(reason(m), "it: has no model with y = Gᵀe, because P(1,1) = 1 feeds u through to y");
  m.S = m.P = {};
  m.N = {{0, 3}, {-3, 0}};
  EXPECT_EQ(reason(m), "it: has no model with y = Gᵀe, because N(0,1) = 3 feeds u through to y");
}

}  // namespace
}  // namespace porthos::phs::linear_system_test
