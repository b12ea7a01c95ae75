// Controllers of a network whose laws have a memory, over several ports.
#include <gtest/gtest.h>

#include "phs/network/network.h"
#include "phs/system/user_model.h"
#include "tests/support/bounds.h"

namespace porthos::phs::sampled_control_test {
namespace {

/// Two masses of 2 kg that do not feel each other: x = (q1, q2, p1, p2).
struct Masses {
  static Description description() {
    Description r;
    r.name = "masses";
    r.nx = 4;
    r.nu = 2;
    r.blocks = {{"a", BlockKind::linear, 0, 1, 2, "m", "N s"},
                {"b", BlockKind::linear, 1, 1, 3, "m", "N s"}};
    r.ports = {{"push_a", PortKind::effort_in, 1, 0, "N", "m/s"},
               {"push_b", PortKind::effort_in, 1, 1, "N", "m/s"}};
    r.traits.canonical = r.traits.separable = true;
    return r;
  }
  template <class T>
  T hamiltonian(std::span<const T> x) const {
    return (x[2] * x[2] + x[3] * x[3]) / T(4.0);
  }
  template <class T>
  void gradient(std::span<const T> x, std::span<T> e) const {
    e[0] = e[1] = T(0.0);
    e[2] = x[2] / T(2.0);
    e[3] = x[3] / T(2.0);
  }
  template <class T>
  void input(std::span<const T>, std::span<const T> u, std::span<T> Gu) const {
    Gu[0] = Gu[1] = T(0.0);
    Gu[2] = u[0];
    Gu[3] = u[1];
  }
};

/// Remembers how often it was asked: u = -y + (calls, 10 t).
struct Counting final : SampledLaw {
  std::vector<double> fresh() const override { return {7}; }
  void operator()(double t, std::span<const double> x, std::span<const double> y,
                  std::span<double> memory, std::span<double> u) const override {
    memory[0] += x[0];
    u[0] = -y[0] + memory[0];
    u[1] = -y[1] + 10 * t;
  }
};

Network masses() {
  Network n("pair");
  n.add("m", std::make_shared<UserModel<Masses>>(Masses{}));
  n.add("other", std::make_shared<UserModel<Masses>>(Masses{}));
  return n;
}
// The ports in an order that is not the member's.
const std::vector<std::string> ports{"m.push_b", "m.push_a"};

}  // namespace

TEST(SampledControl, HoldsWhatItGaveAndItsPowerIsTheHeldOne) {
  Network n = masses();
  n.control("law", ports, std::make_shared<Counting>(), 0.1);
  const auto model = n.build();
  ASSERT_EQ(model->holds().size(), 1u);
  EXPECT_EQ(model->holds()[0]->fresh, (std::vector<double>{0, 0, 7}));
  EXPECT_FALSE(model->description().traits.lossless);
  const auto system = model->instantiate<double>();
  const auto memory = std::make_shared<std::vector<double>>(model->holds()[0]->fresh);
  const std::vector<HeldPtr> held{memory};
  system->use_held(held);
  const std::vector<double> x{3, 4, 10, 20, 0, 0, 0, 0};  // rates 5, 10
  std::vector<double> dx(8), e(8), powers(model->description().powers.size());
  system->field(0, x, {}, dx);
  EXPECT_EQ(dx[2], 0);  // before the first instant
  system->sample(0, 0.5, x, *memory);
  EXPECT_EQ(*memory, (std::vector<double>{-10 + 10, -5 + 5.0, 10}));
  system->sample(0, 0.6, x, *memory);
  EXPECT_EQ(*memory, (std::vector<double>{-10 + 13, -5 + 6.0, 13}));
  for (const auto& own : {system->clone(), model->instantiate<double>()}) {
    own->use_held(held);
    own->field(0, x, {}, dx);
    EXPECT_EQ(dx[3], 3);
    EXPECT_EQ(dx[2], 1);
    own->gradient(x, e);
    own->powers(0, x, e, powers);
    EXPECT_EQ(powers.back(), 3 * 10 + 1 * 5);
  }
  // The same in 113 bits.
  auto again = *memory;
  const std::vector<Quad> wide(x.begin(), x.end());
  model->instantiate<Quad>()->sample(0, Quad(0.7), wide, again);
  EXPECT_EQ(again, (std::vector<double>{-10 + 16, -5 + 7.0, 16}));
}

TEST(SampledControl, EachNetworkHasAHoldOfItsOwn) {
  Network n = masses();
  n.control("law", ports, std::make_shared<Counting>(), 0.1);
  EXPECT_NE(n.build()->holds()[0], n.build()->holds()[0]);
}

TEST(SampledControl, RefusesWhatHasNoSense) {
  const auto law = std::make_shared<Counting>();
  const auto said = [&](const std::vector<std::string>& at, SampledLawPtr own, double period) {
    return test::refusal([&] { masses().control("law", at, std::move(own), period); });
  };
  EXPECT_EQ(said(ports, law, 0.1), "");
  EXPECT_EQ(said(ports, nullptr, 0.1), "network 'pair': the law of the controller 'law' is null");
  EXPECT_EQ(said({}, law, 0.1), "network 'pair': the controller 'law' has no port");
  EXPECT_EQ(
      said(ports, law, 0),
      "network 'pair': the period of the controller 'law' is 0 s, expected a positive number");
  EXPECT_EQ(said({"m.push_a", "other.push_a"}, law, 0.1),
            "network 'pair': the controller 'law' acts on 'm.push_a' and 'other.push_a', expected "
            "ports of one member");
  EXPECT_NE(said({"m.pull"}, law, 0.1).find("unknown port 'm.pull'"), std::string::npos);
  Network n = masses();
  n.control("law", ports, law, 0.1);
  EXPECT_NE(test::refusal([&] { n.control("law", ports, law, 0.1); }).find("two elements"),
            std::string::npos);
}

}  // namespace porthos::phs::sampled_control_test
