// Environments whose episodes begin as cases: models that differ in numbers.
#include <cmath>
#include <set>

#include "ensemble/environment.h"
#include "phs/system/user_model.h"
#include "tests/support/bounds.h"

namespace porthos::ensemble::environment_cases_test {
namespace {

using test::refusal;

/// A mass on a hard spring with a force.
struct Spring {
  double stiffness = 1;
  const char* port = "force";

  phs::Description description() const {
    phs::Description d;
    d.name = "spring";
    d.nx = 2;
    d.nu = 1;
    d.blocks = {{"q", phs::BlockKind::linear, 0, 1, 1, "m", "kg m/s"}};
    d.ports = {{port, phs::PortKind::effort_in, 1, 0, "N", "m/s"}};
    d.traits = {.canonical = true};
    return d;
  }
  template <class T>
  T hamiltonian(std::span<const T> x) const {
    const T q2 = x[0] * x[0];
    return T(0.5) * (T(stiffness) * q2 * (T(1.0) + q2) + x[1] * x[1]);
  }
  template <class T>
  void gradient(std::span<const T> x, std::span<T> e) const {
    e[0] = T(stiffness) * x[0] * (T(1.0) + T(2.0) * x[0] * x[0]);
    e[1] = x[1];
  }
  template <class T>
  void input(std::span<const T>, std::span<const T> u, std::span<T> Gu) const {
    Gu[0] = T(0.0);
    Gu[1] = u[0];
  }
};

EnvironmentCase spring(double stiffness, double q, const char* port = "force") {
  return {std::make_shared<phs::UserModel<Spring>>(Spring{stiffness, port}), {q, 0.0}};
}
std::vector<EnvironmentCase> springs() {
  std::vector<EnvironmentCase> all = {spring(1, 0.5), spring(2, 0.4), spring(3, 0.3)};
  all.push_back({all[1].model, {-0.7, 0.1}});  // one model, another start
  return all;
}
const EnvironmentOptions many{.count = 37, .step = 0.05, .substeps = 2, .seed = 5};

std::vector<double> actions(const Environment& e, int k) {
  std::vector<double> u;
  for (int i = 0; i < e.count(); ++i) u.push_back(std::sin(k + 0.3 * i));
  return u;
}

TEST(EnvironmentCases, EachMovesAsItsModelAloneDoes) {
  const auto all = springs();
  EnvironmentOptions o = many;
  for (const int threads : {1, 2}) {
    o.threads = threads;
    Environment env(all, o);
    std::vector<std::unique_ptr<Environment>> alone;
    for (const int k : env.cases())
      alone.push_back(std::make_unique<Environment>(
          all[size_t(k)].model, all[size_t(k)].start,
          EnvironmentOptions{.step = many.step, .substeps = many.substeps}));
    for (int k = 0; k < 40; ++k) {
      const auto u = actions(env, k);
      env.step(u);
      for (size_t i = 0; i < alone.size(); ++i) {
        alone[i]->step(std::span(u).subspan(i, 1));
        ASSERT_TRUE(env.state(int(i)) == alone[i]->state(0)) << "copy " << i << ", step " << k;
        ASSERT_EQ(env.energies()[i], alone[i]->energies()[0]);
      }
    }
  }
}

TEST(EnvironmentCases, AnEpisodeDrawsItsCase) {
  EnvironmentOptions o = many;
  o.longest = 3;
  Environment env(springs(), o);
  std::set<int> seen(env.cases().begin(), env.cases().end());
  EXPECT_EQ(seen.size(), 4U);
  const std::vector<int> first(env.cases().begin(), env.cases().end());
  for (int k = 0; k < 3; ++k) {
    EXPECT_TRUE(std::ranges::equal(env.cases(), first)) << "it stays in an episode";
    env.step(actions(env, k));
  }
  EXPECT_TRUE(std::ranges::equal(env.final_cases(), first));
  EXPECT_FALSE(std::ranges::equal(env.cases(), first));
  env.reset(5);
  EXPECT_TRUE(std::ranges::equal(env.cases(), first)) << "the same seed";
  env.reset(6);
  EXPECT_FALSE(std::ranges::equal(env.cases(), first)) << "control";
}

TEST(EnvironmentCases, EachMayEndByItself) {
  auto all = springs();
  all[2].ended = [](std::span<const double>) { return true; };
  Environment env(all, many);
  env.step(actions(env, 0));
  for (size_t i = 0; i < 37; ++i) EXPECT_EQ(env.terminated()[i], env.final_cases()[i] == 2);
}

TEST(EnvironmentCases, OtherSystemsAreRefused) {
  const auto said = [](std::vector<EnvironmentCase> c) {
    return refusal([&] { Environment(std::move(c), many); });
  };
  EXPECT_EQ(said({}), "an environment has no cases, expected 1 or more");
  EXPECT_EQ(said({spring(1, 0), spring(1, 0, "push")}),
            "case 1 of an environment has other state numbers or ports than case 0, expected cases "
            "that differ in numbers alone");
  EXPECT_EQ(said(springs()), "") << "control";
}

/// Resets after the end of episodes leave out no draw. Control: one within an episode begins
/// another.
TEST(EnvironmentCases, AResetAfterAnEndKeepsTheEpisodeThatHasBegun) {
  EnvironmentOptions o{.count = 2, .step = 0.05, .seed = 3, .longest = 1};
  int begun = 0;
  o.begin = [&](Stream& random, std::span<double> x) { x[0] = random.uniform() + 0 * ++begun; };
  Environment env(springs(), o);
  const std::vector<double> push(2, 0.1);
  for (int episode = 0; episode < 4; ++episode) {
    env.reset();
    for (size_t i = 0; i < 2; ++i) {
      Stream random(3, i, std::uint64_t(episode));
      EXPECT_EQ(env.cases()[i], int(4 * random.uniform()));
      EXPECT_EQ(env.state(int(i)).x[0], random.uniform()) << episode;
      EXPECT_EQ(env.final_cases()[i], env.cases()[i]);
      EXPECT_EQ(env.final_energies()[i], env.energies()[i]);
    }
    env.step(push);
    EXPECT_EQ(begun, 2 * (episode + 2)) << "once each";
  }
  env.end(std::vector<std::uint8_t>{1, 1}, false);
  EXPECT_EQ(env.episodes()[1], 4) << "the end has begun";
  env.reset();
  env.reset();
  EXPECT_EQ(env.episodes()[0], 5) << "control: a reset after a reset";
  env.step(push);
  env.set_state(1, env.state(0));
  env.reset();
  EXPECT_EQ(env.episodes()[0], 6);
  EXPECT_EQ(env.episodes()[1], 7) << "control: another state was put in its place";
}

}  // namespace
}  // namespace porthos::ensemble::environment_cases_test
