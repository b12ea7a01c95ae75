// A wrapper drops nothing: every member of System that the base is asked for reaches the system
// inside.
#include "phs/system/forwarding.h"

#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <sstream>

#include "integrators/control/step_control.h"
#include "integrators/core/integrator.h"
#include "phs/system/time_transform.h"
#include "tests/places.h"
#include "tests/support/stiff.h"

namespace porthos::test::forwarding_test {
namespace {

using In = std::span<const double>;
using Out = std::span<double>;

phs::Description probe_description() {
  phs::Description d;
  d.name = "probe";
  d.nx = 2;
  d.nu = 1;
  d.blocks = {{"q", phs::BlockKind::angle, 0, 1, 1, "rad", "N m s"}};
  d.ports = {{"q.torque", phs::PortKind::effort_in, 1, 0, "N m", "rad/s"}};
  d.invariants = {{"lost", 1, 0, 0, ""}, {"kept", 2, 1, 0, ""}};
  d.flows = {{"all"}};
  d.storages = {"a", "b"};
  d.powers = {{"loss", phs::PowerKind::dissipated}};
  return d;
}

/// Counts the calls of each of its members, and answers each with numbers of its own.
class Probe final : public phs::System<double>, public phs::Tunable<double> {
 public:
  explicit Probe(std::map<std::string, int>& calls) : calls_(calls) {}
  const phs::Description& description() const override { return d_; }
  std::unique_ptr<phs::System<double>> clone() const override {
    ++calls_["clone"];
    return std::make_unique<Probe>(calls_);
  }
  double hamiltonian(In x) override {
    ++calls_["hamiltonian"];
    return sum(x);
  }
  void gradient(In x, Out e) override { answer("gradient", 1 + sum(x), e); }
  void field(double t, In x, In u, Out dx) override { answer("field", t + sum(x) + sum(u), dx); }
  void rate(double t, In x, In e, Out dx) override { answer("rate", t + sum(x) - sum(e), dx); }
  void efforts(double t, In x, In dx, Out e) override {
    answer("efforts", t + sum(x) + 3 * sum(dx), e);
  }
  void apply_structure(In x, In e, Out Je) override {
    answer("apply_structure", sum(x) + 4 * sum(e), Je);
  }
  void apply_dissipation(In x, In e, Out Re) override {
    answer("apply_dissipation", sum(x) + 5 * sum(e), Re);
  }
  void apply_input(In x, In u, Out Gu) override { answer("apply_input", sum(x) + 6 * sum(u), Gu); }
  void output(In x, In e, Out y) override { answer("output", sum(x) + 7 * sum(e), y); }
  void stored(In x, Out values) override { answer("stored", 8 * sum(x), values); }
  void powers(double t, In x, In e, Out values) override {
    answer("powers", t + sum(x) + 9 * sum(e), values);
  }
  void invariants(In x, Out values) override { answer("invariants", 10 * sum(x), values); }
  void flow(int k, double t, double h, Out x) override { answer("flow", k + t + h, x); }
  void use_held(std::span<const phs::HeldPtr> memories) override {
    ++calls_["use_held"];
    held = (*memories[0])[0];
  }
  void set_turn_angles(In angles) override {
    ++calls_["set_turn_angles"];
    turn = angles[0];
  }
  void sample(size_t i, double t, In x, Out memory) override {
    answer("sample", double(i) + t + sum(x), memory);
  }
  std::unique_ptr<phs::Constraints<double>> constraints() override {
    ++calls_["constraints"];
    return nullptr;
  }
  std::unique_ptr<phs::Resolvent> resolvent() override {
    ++calls_["resolvent"];
    class Half final : public phs::Resolvent {
      void factor(double, In x, const phs::Complex4&) override { EXPECT_EQ(x.size(), 2u); }
      void solve(std::span<phs::Complex4> r) override {
        for (auto& c : r) c = 0.5 * c;
      }
      bool exact() const override { return true; }
    };
    return std::make_unique<Half>();
  }
  Out parameters() override {
    ++calls_["parameters"];
    return Out(&gain, 1);
  }

  double turn = 0, gain = 3, held = 0;

 private:
  static double sum(In a) {
    double s = 0;
    for (double x : a) s += x;
    return s;
  }
  void answer(const char* name, double first, Out to) {
    ++calls_[name];
    for (size_t i = 0; i < to.size(); ++i) to[i] = first + double(i);
  }
  std::map<std::string, int>& calls_;
  phs::Description d_ = probe_description();
};

/// The base and nothing else.
class Plain final : public phs::Forwarding<double> {
 public:
  Plain(std::map<std::string, int>& calls, const phs::Description& d)
      : phs::Forwarding<double>(std::make_unique<Probe>(calls), d), calls_(calls) {}
  std::unique_ptr<phs::System<double>> clone() const override {
    return alike(std::make_unique<Plain>(calls_, description()));
  }
  Probe& probe() { return static_cast<Probe&>(inner()); }

 private:
  std::map<std::string, int>& calls_;
};

/// What a wrapper was before there was a base: the pure members, and what its writer thought of.
class Forgetful final : public phs::System<double> {
 public:
  explicit Forgetful(std::map<std::string, int>& calls) : inner_(calls) {}
  const phs::Description& description() const override { return inner_.description(); }
  std::unique_ptr<phs::System<double>> clone() const override { return nullptr; }
  double hamiltonian(In x) override { return inner_.hamiltonian(x); }
  void gradient(In x, Out e) override { inner_.gradient(x, e); }
  void field(double t, In x, In u, Out dx) override { inner_.field(t, x, u, dx); }
  void rate(double t, In x, In e, Out dx) override { inner_.rate(t, x, e, dx); }
  void apply_structure(In x, In e, Out Je) override { inner_.apply_structure(x, e, Je); }
  void apply_dissipation(In x, In e, Out Re) override { inner_.apply_dissipation(x, e, Re); }
  void apply_input(In x, In u, Out Gu) override { inner_.apply_input(x, u, Gu); }
  void output(In x, In e, Out y) override { inner_.output(x, e, y); }
  void invariants(In x, Out values) override { inner_.invariants(x, values); }

 private:
  Probe inner_;
};

/// Calls every member of a system of the probe's size once; what each answered, one after another.
std::vector<double> call_all(phs::System<double>& s) {
  std::vector<double> all;
  const std::vector<double> x(size_t(s.description().nx), 0.25), u{0.5};
  std::vector<double> out(x.size()), y(1), stored(s.description().storages.size()),
      powers(s.description().powers.size()), kept(size_t(s.description().invariant_count())),
      memory(2), moved = x;
  const auto keep = [&](In a) { all.insert(all.end(), a.begin(), a.end()); };
  all.push_back(s.hamiltonian(x));
  s.gradient(x, out);
  keep(out);
  s.field(1, x, u, out);
  keep(out);
  s.rate(2, x, x, out);
  keep(out);
  s.efforts(3, x, x, out);
  keep(out);
  s.apply_structure(x, x, out);
  keep(out);
  s.apply_dissipation(x, x, out);
  keep(out);
  s.apply_input(x, u, out);
  keep(out);
  s.output(x, x, y);
  keep(y);
  s.stored(x, stored);
  keep(stored);
  s.powers(4, x, x, powers);
  keep(powers);
  s.invariants(x, kept);
  keep(kept);
  try {
    s.flow(0, 5, 6, moved);
    keep(moved);
  } catch (const InvalidArgument&) {
  }
  s.set_turn_angles(In(u));
  const auto held = std::make_shared<const std::vector<double>>(1, 9);
  s.use_held(std::vector<phs::HeldPtr>{held});
  s.sample(7, 8, x, memory);
  keep(memory);
  all.push_back(s.constraints() ? 1 : 0);
  if (const auto r = s.resolvent()) {
    std::vector<phs::Complex4> c(x.size(), phs::Complex4(1.0));
    r->factor(0, x, phs::Complex4(1.0));
    r->solve(c);
    for (const auto& z : c) all.push_back(z.re[0]);
  }
  for (const double p : phs::parameters_of(s)) all.push_back(p);
  return all;
}

/// The members that phs/system/system.h declares virtual in System, but those that a wrapper
/// answers itself.
std::set<std::string> virtuals_of_system() {
  std::ifstream file(std::string(PORTHOS_SOURCE_DIR) + "/phs/system/system.h");
  std::stringstream text;
  text << file.rdbuf();
  const std::string all = text.str();
  const size_t from = all.find("class System {"), to = all.find("\n};", from);
  EXPECT_NE(from, std::string::npos);
  std::set<std::string> names;
  const std::string body = all.substr(from, to - from);
  static const std::regex member(R"(virtual [^;{]*?(\w+)\()");
  for (std::sregex_iterator i(body.begin(), body.end(), member), end; i != end; ++i)
    names.insert((*i)[1]);
  EXPECT_EQ(names.erase("System") + names.erase("description") + names.erase("clone"), 3u);
  return names;
}

TEST(Forwarding, EveryMemberReachesTheSystemInside) {
  const phs::Description d = probe_description();
  std::map<std::string, int> calls, direct;
  Plain plain(calls, d);
  Probe probe(direct);
  EXPECT_EQ(call_all(plain), call_all(probe)) << "the same arguments, the same answers";
  const auto members = virtuals_of_system();
  EXPECT_EQ(members.size(), 18u);
  for (const auto& name : members) EXPECT_EQ(calls[name], 1) << name;
  EXPECT_GE(calls["parameters"], 1);

  // Negative control: a wrapper by hand.
  std::map<std::string, int> seen;
  Forgetful forgetful(seen);
  call_all(forgetful);
  std::string dropped;
  for (const auto& name : members)
    if (seen[name] == 0) dropped += name + " ";
  EXPECT_EQ(dropped,
            "constraints efforts flow powers resolvent sample set_turn_angles stored use_held ");
}

TEST(Forwarding, StateAndBooksOfItsOwnComeBehindTheInner) {
  phs::Description d = probe_description();
  d.nx = 4;
  d.storages.push_back("own");
  d.powers.push_back({"own", phs::PowerKind::supplied});
  d.invariants = {{"kept", 2, 0, 0, ""}};
  d.flows.clear();
  std::map<std::string, int> calls;
  Plain plain(calls, d);
  const std::vector<double> x{0.25, 0.25, 7, 8};
  std::vector<double> e(4, NAN), values(3, NAN), powers(2, NAN), kept(2, NAN);
  plain.gradient(x, e);
  EXPECT_EQ(e, (std::vector<double>{1.5, 2.5, 0, 0}));
  plain.stored(x, values);
  EXPECT_EQ(values, (std::vector<double>{4, 5, 0}));
  plain.powers(1, x, x, powers);
  EXPECT_EQ(powers, (std::vector<double>{6, 0}));
  plain.invariants(x, kept);
  EXPECT_EQ(kept, (std::vector<double>{6, 7})) << "by name: behind the one that is not kept";
  std::vector<double> moved = x;
  EXPECT_THROW(plain.flow(0, 0, 1, moved), InvalidArgument) << "none is declared";
  const auto r = plain.resolvent();
  EXPECT_FALSE(r->exact()) << "the rest of the state is not in it";
  std::vector<phs::Complex4> c(4, phs::Complex4(1.0));
  r->factor(0, x, phs::Complex4(1.0));
  r->solve(c);
  EXPECT_EQ(c[1].re[0], 0.5);
  EXPECT_EQ(c[2].re[0], 1.0);
}

TEST(Forwarding, ClonesHaveTheTurnsTheHoldsAndParameters) {
  const phs::Description d = probe_description();
  std::map<std::string, int> calls;
  Plain plain(calls, d);
  plain.set_turn_angles(std::vector<double>{6.5});
  plain.probe().gain = 11;
  plain.use_held(std::vector{std::make_shared<const std::vector<double>>(1, 4)});
  const auto copy = plain.clone();
  EXPECT_EQ(static_cast<Plain&>(*copy).probe().turn, 6.5);
  EXPECT_EQ(static_cast<Plain&>(*copy).probe().held, 4);
  EXPECT_EQ(phs::parameters_of(*copy)[0], 11);
}

// A system in fictitious time has another layout of the state, and forwards by hand.
TEST(Forwarding, ASystemInFictitiousTimeClonesItsTurnsAndHasASolver) {
  const auto robot = stiff_chain(8, 1e4, 0);
  const phs::RateTimeScale rates(*robot.model, 0.5);
  const phs::TimeTransformedModel model(*robot.model, rates);
  const auto system = model.instantiate<double>();
  std::vector<double> z(size_t(model.description().nx), 0.1), e(z.size()), of_clone(z.size());
  system->set_turn_angles(std::vector<double>(8, phs::two_pi_hi));
  system->gradient(z, e);
  system->clone()->gradient(z, of_clone);
  EXPECT_EQ(e, of_clone);

  integrators::ControlOptions control;
  control.rate = 0.5;
  const auto method = integrators::make_time_transformed("gauss8", *robot.model, 0.02, control);
  phs::State s = robot.start;
  for (int i = 0; i < 20; ++i) ASSERT_EQ(method->step(s), integrators::Outcome::ok);
  std::printf("  %s\n", method->remark().c_str());
  EXPECT_NE(method->remark().find("Newton, articulated"), std::string::npos);
}

}  // namespace
}  // namespace porthos::test::forwarding_test
