// The ten inertial numbers of the last link of ETS-VII from 100 s of noisy rates: their errors over
// many seeds are distributed as the covariance says, and no iterate is unphysical.
#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <cmath>
#include <cstdlib>

#include "tests/identification/support.h"
#include "tests/places.h"

namespace porthos::scene::identification_test {
namespace {

constexpr int numbers = 10;

Scene ets_vii() { return read_scene(PORTHOS_SOURCE_DIR "/examples/ets_vii/scene.toml"); }

/// Encoders' rates and gyros.
LogNoise noise_of_ets_vii() {
  LogNoise n;
  for (int i = 1; i <= 6; ++i) n.by_name["joint_" + std::to_string(i) + ".velocity"] = 1e-5;
  for (const char* axis : {"x", "y", "z"})
    n.by_name[std::string("base.angular_velocity.") + axis] = 1e-7;
  return n;
}

NamedColumns rates_of_ets_vii() {
  std::vector<std::string> names;
  for (const auto& [name, sigma] : noise_of_ets_vii().by_name) names.push_back(name);
  return run_of(ets_vii(), names, 100);
}

/// A last link that is wrong by tens of percents.
Scene wrong_scene() {
  Scene s = ets_vii();
  s.urdf.link_inertia["link_6"] = {12, {0.05, -0.03, 0.1}, {0.3, 0.02, -0.01, 0.25, 0.03, 0.2}};
  s.urdf.replaced_inertia.insert("link_6");
  return s;
}

/// The smallest semi-axis of the mass distribution, ½ tr(I) - I: positive of a physical body.
double smallest_axis(const std::vector<double>& ten) {
  Eigen::Matrix3d I;
  I << ten[4], ten[5], ten[6], ten[5], ten[7], ten[8], ten[6], ten[8], ten[9];
  const Eigen::Vector3d moments = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(I).eigenvalues();
  return moments.sum() / 2 - moments[2];
}

/// The numbers of a link in the scene.
std::vector<double> ten_of(const std::string& link) {
  const Scene s = ets_vii();
  const Assembly a = assemble(s);
  std::vector<std::string> names;
  for (const char* end : {"mass", "com.x", "com.y", "com.z", "inertia.xx", "inertia.xy",
                          "inertia.xz", "inertia.yy", "inertia.yz", "inertia.zz"})
    names.push_back(link + "." + end);
  const Unknowns unknowns(s, a, names);
  std::vector<double> ten;
  for (const auto& u : unknowns.list()) ten.push_back(u.start);
  return ten;
}

struct Sum {
  double of_all = 0, halved = 0;
  int unphysical = 0, not_converged = 0;
};

/// Σ eᵀC⁻¹e over seeds, e the errors of the ten numbers.
Sum errors_over(int seeds) {
  const Scene scene = wrong_scene();
  // Control: the published second link is none.
  EXPECT_LT(smallest_axis(ten_of("link_2")), 0);
  const NamedColumns clean = rates_of_ets_vii();
  const LogNoise noise = noise_of_ets_vii();
  const std::vector<double> truth = ten_of("link_6");
  Sum sum;
  for (int seed = 1; seed <= seeds; ++seed) {
    const auto r = identify(scene, noisy(clean, noise, std::uint64_t(seed)),
                            {.parameters = {"link_6"}, .noise = noise});
    if (seed == 1) std::printf("%s", identification_text(r).c_str());
    if (!r.converged) ++sum.not_converged;
    for (const auto& ten : r.iterates) sum.unphysical += !(ten[0] > 0 && smallest_axis(ten) > 0);
    const Eigen::Map<const Eigen::Matrix<double, numbers, numbers>> C(r.covariance.data());
    Eigen::Matrix<double, numbers, 1> e;
    for (int i = 0; i < numbers; ++i) e[i] = r.found[size_t(i)].value - truth[size_t(i)];
    const double size = e.dot(C.ldlt().solve(e));
    sum.of_all += size;
    sum.halved += 2 * size;
  }
  return sum;
}

/// How far χ² of n freedoms is from n, in its standard deviations √(2n).
double off(double chi_square, int n) { return (chi_square - n) / std::sqrt(2.0 * n); }

void check(const Sum& s, int seeds) {
  const int n = numbers * seeds;
  std::printf("  chi^2 of the errors %.1f for %d degrees of freedom: %+.2f sigma   bound 4\n",
              s.of_all, n, off(s.of_all, n));
  std::printf("  with half the covariance %+.1f sigma, beyond 4\n", off(s.halved, n));
  EXPECT_LT(std::fabs(off(s.of_all, n)), 4);
  EXPECT_GT(off(s.halved, n), 4);
  EXPECT_EQ(s.unphysical, 0);
  EXPECT_EQ(s.not_converged, 0);
}

TEST(IdentificationOfEtsVii, ErrorsAreThoseOfTheCovariance) { check(errors_over(6), 6); }

TEST(IdentificationOfEtsVii, HundredSeedsLONG) {
  if (!std::getenv("PORTHOS_LONG")) GTEST_SKIP() << "100 fits: set PORTHOS_LONG=1";
  check(errors_over(100), 100);
}

}  // namespace
}  // namespace porthos::scene::identification_test
