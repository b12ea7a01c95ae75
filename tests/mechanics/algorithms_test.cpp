// Mass matrix, bias, acceleration and centroidal momentum matrix of a branched tree against
// 40-digit references, to 1e-14 of the largest entry of each. The references: spatial algebra and
// Lagrange equations agree to 1e-60.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "mechanics/aba.h"
#include "mechanics/crba.h"
#include "mechanics/momentum.h"
#include "mechanics/rnea.h"
#include "tests/support/tree_case.h"

namespace porthos::mechanics::algorithms_test {
namespace {

using nlohmann::json;
using Vec = std::vector<double>;
using test::numbers;
using test::tree_mechanism;

constexpr const char* file_name = "reference/p_algorithms_tree7.json";

/// The case lists its bodies as objects; tree_mechanism reads "body0.mass" and so on.
json with_parameters(json file) {
  auto& p = file["generator"]["parameters"];
  p["gravity"] = file["gravity"];
  p["nb"] = file["bodies"].size();
  for (size_t i = 0; i < file["bodies"].size(); ++i)
    for (const auto& [key, value] : file["bodies"][i].items())
      p["body" + std::to_string(i) + "." + key] = value;
  return file;
}

/// Largest |a - b| over the largest |b|.
double relative(const Vec& a, const Vec& b) {
  EXPECT_EQ(a.size(), b.size());
  double diff = 0, size = 0;
  for (size_t i = 0; i < std::min(a.size(), b.size()); ++i) {
    diff = std::max(diff, std::fabs(a[i] - b[i]));
    size = std::max(size, std::fabs(b[i]));
  }
  return diff / size;
}
/// Largest |a - b| / |b| of the entries that are not structural zeros.
double entrywise(const Vec& a, const Vec& b) {
  double worst = 0;
  for (size_t i = 0; i < std::min(a.size(), b.size()); ++i)
    if (b[i] != 0) worst = std::max(worst, std::fabs(a[i] / b[i] - 1));
  return worst;
}
void expect_agrees(const char* what, const Vec& got, const Vec& reference) {
  std::printf("  %-28s %.1e of the largest  bound 1e-14   (entry by entry %.1e)\n", what,
              relative(got, reference), entrywise(got, reference));
  EXPECT_LE(relative(got, reference), 1e-14) << what;
}
/// Row-major of `columns` columns from column-major, rows swapped from [angular; linear] where
/// asked.
Vec rows(const Vec& m, size_t columns, bool linear_first = false) {
  const size_t n = m.size() / columns;
  Vec r(m.size());
  for (size_t i = 0; i < n; ++i)
    for (size_t j = 0; j < columns; ++j)
      r[i * columns + j] = m[(linear_first ? (i + 3) % 6 : i) + n * j];
  return r;
}

class Tree7 : public testing::Test {
 protected:
  void SetUp() override {
    file_ = with_parameters(test::read_json(test::data_file(file_name)));
    m_ = tree_mechanism(file_);
    q_ = numbers(file_["q"]);
    v_ = numbers(file_["qd"]);
    tau_ = numbers(file_["tau"]);
    out_ = file_["outputs"][0];
    ASSERT_EQ(m_->nv(), 7);
  }
  /// Generalised forces for the rates and accelerations given.
  Vec forces(const Vec& v, const Vec& vdot) {
    Workspace<double> w(*m_);
    Vec t(7);
    rnea<double>(*m_, w, q_, v, vdot, {}, t);
    return t;
  }
  json file_, out_;
  std::shared_ptr<const Mechanism> m_;
  Vec q_, v_, tau_;
};

TEST_F(Tree7, MassMatrix) {
  Workspace<double> w(*m_);
  Vec M(49);
  crba<double>(*m_, w, q_, M);
  const Vec reference = numbers(out_["H_row_major"]);
  expect_agrees("crba", rows(M, 7), reference);
  int zeros = 0;
  for (size_t i = 0; i < 7; ++i)
    for (size_t j = 0; j < 7; ++j) {
      EXPECT_EQ(M[i + 7 * j], M[j + 7 * i]) << "symmetric in every bit";
      if (reference[i * 7 + j] != 0) continue;
      ++zeros;
      EXPECT_LE(std::fabs(M[i + 7 * j]), 1e-16) << i << ", " << j;
    }
  EXPECT_EQ(zeros, 20) << "9 pairs of joints on different branches, and joints 5 and 6";
}

TEST_F(Tree7, Bias) {
  expect_agrees("rnea, no acceleration", forces(v_, {}), numbers(out_["bias"]));
  expect_agrees("rnea, acceleration = rates", forces(v_, v_),
                numbers(out_["rnea_tau_for_qdd_equal_qd"]));
}

TEST_F(Tree7, ForwardDynamics) {
  Workspace<double> w(*m_);
  Vec a(7);
  aba<double>(*m_, w, q_, v_, {tau_, {}}, a);
  expect_agrees("aba", a, numbers(out_["qdd"]));
  expect_agrees("rnea(aba) = tau", forces(v_, a), tau_);
}

TEST_F(Tree7, CentroidalMomentumMatrix) {
  Workspace<double> w(*m_);
  Vec A(42);
  centroidal_momentum_matrix<double>(*m_, w, q_, A);
  expect_agrees("centroidal momentum matrix", rows(A, 7, true), numbers(out_["A_G_row_major"]));
  const auto c = centre_of_mass<double>(*m_, w, q_);
  expect_agrees("centre of mass", {c.x, c.y, c.z}, numbers(out_["com"]));
}

// In 113 bits what is left is the case's own: two axes that are unit only to 1e-16 in double.
TEST_F(Tree7, InQuadOnlyTheRoundedAxesAreLeft) {
  using phs::Quad;
  Workspace<Quad> w(*m_);
  const std::vector<Quad> q(q_.begin(), q_.end()), v(v_.begin(), v_.end()),
      tau(tau_.begin(), tau_.end());
  std::vector<Quad> a(7), t(7);
  aba<Quad>(*m_, w, q, v, {tau, {}}, a);
  rnea<Quad>(*m_, w, q, v, a, {}, t);
  double worst = 0, round_trip = 0;
  for (size_t i = 0; i < 7; ++i) {
    const Quad reference = phs::strtoflt128(out_["qdd"][i].get<std::string>().c_str(), nullptr);
    worst = std::max(worst, double(phs::abs(a[i] - reference)) / 15.8);
    round_trip = std::max(round_trip, double(phs::abs(t[i] - tau[i])));
  }
  std::printf(
      "  aba in 113 bits: %.1e of the largest  bound 1e-15   rnea(aba) = tau to %.1e  bound "
      "1e-31\n",
      worst, round_trip);
  EXPECT_LE(worst, 1e-15);
  EXPECT_LE(round_trip, 1e-31);
}

// Negative control: without the velocity terms, or with gravity turned, the bound is missed by far.
TEST_F(Tree7, BoundsSeeWrongPhysics) {
  const Vec bias = numbers(out_["bias"]);
  EXPECT_GT(relative(forces({}, {}), bias), 1e-3);
  file_["generator"]["parameters"]["gravity"] = {"0", "0", "-9.8124"};
  m_ = tree_mechanism(file_);
  EXPECT_GT(relative(forces(v_, {}), bias), 1e-6);
}

/// In builds with assertions; in the others a number more changes nothing.
TEST_F(Tree7, ASizeThatIsWrongIsAsserted) {
  Workspace<double> w(*m_);
  const Vec right = forces(v_, {});
  auto longer = v_;
  longer.push_back(0);
  Vec t(7);
  const auto with = [&](const Vec& rates) { rnea<double>(*m_, w, q_, rates, {}, {}, t); };
  EXPECT_DEBUG_DEATH(with(longer), "sized_or_none.v, nv.");
  with(v_);
  EXPECT_EQ(t, right);
}

}  // namespace
}  // namespace porthos::mechanics::algorithms_test
