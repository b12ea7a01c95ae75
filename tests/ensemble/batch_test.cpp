// Batches over lanes and threads: each run has the bits it has alone.
#include "ensemble/batch.h"

#include <atomic>
#include <cmath>
#include <cstring>
#include <random>

#include "integrators/core/lane_integrator.h"
#include "phs/system/tunable.h"
#include "phs/system/user_model.h"
#include "tests/support/bounds.h"
#include "tests/support/driven_pendulum.h"
#include "tests/support/robots.h"
#include "tests/support/stiff.h"

namespace porthos::ensemble::batch_test {
namespace {

using integrators::Outcome;
using test::keeps, test::breaks, test::refusal;

bool same_bits(const phs::State& a, const phs::State& b) {
  return a.x.size() == b.x.size() &&
         std::memcmp(a.x.data(), b.x.data(), a.x.size() * sizeof(double)) == 0 &&
         std::memcmp(a.lo.data(), b.lo.data(), a.lo.size() * sizeof(double)) == 0 &&
         a.turns == b.turns && a.step == b.step;
}

std::vector<BatchResult> one_by_one(const phs::Model& model, const std::string& method, double h,
                                    std::int64_t steps,
                                    const std::vector<std::vector<double>>& starts) {
  std::vector<BatchResult> results;
  for (const auto& x : starts) {
    const auto one = integrators::make_integrator(method, model, h, {.port_work = false});
    BatchResult r{phs::State(model.description(), x)};
    while (r.state.step < steps && (r.outcome = one->step(r.state)) == Outcome::ok) {
    }
    results.push_back(r);
  }
  return results;
}

/// Random states of a mechanism: rates up to `spread`.
std::vector<std::vector<double>> starts_of(const mechanics::MechanicalModel& model, int count,
                                           double spread) {
  std::mt19937_64 rng(7);
  std::normal_distribution<double> normal(0, spread);
  std::vector<std::vector<double>> starts;
  for (int i = 0; i < count; ++i) {
    std::vector<double> q = model.mechanism().neutral(), v(size_t(model.mechanism().nv()));
    for (const auto& c : model.mechanism().coordinates())
      if (c.nq == 1) q[size_t(c.q)] = normal(rng);
    for (double& rate : v) rate = normal(rng);
    starts.push_back(model.state(q, v));
  }
  return starts;
}

int differing(const std::vector<BatchResult>& a, const std::vector<BatchResult>& b) {
  int n = 0;
  for (size_t i = 0; i < a.size(); ++i)
    n += !(same_bits(a[i].state, b[i].state) && a[i].outcome == b[i].outcome);
  return n;
}

TEST(Batch, HasTheBitsOfEachRunAlone) {
  const auto model = test::ets_vii().model;
  const auto starts = starts_of(*model, 13, 0.3);  // 13: lanes that end with nothing left to do
  for (const char* method : {"gauss4", "gauss8", "gauss16", "hbvm4", "midpoint", "rk4",
                             "stormer_verlet", "kahan_li6_sv"}) {
    const double h = std::string(method) == "gauss16" ? 0.4 : 0.1;
    const auto lanes = integrators::make_lane_integrator(method, *model, h, {.port_work = false});
    EXPECT_EQ(lanes == nullptr, std::string(method) == "kahan_li6_sv") << method;
    const auto alone = one_by_one(*model, method, h, 40, starts);
    for (const int threads : {1, 2, 3}) {
      const auto batch = simulate_batch(*model, method, h, 40, starts, {.threads = threads});
      EXPECT_EQ(differing(batch, alone), 0) << method << ", " << threads << " threads";
    }
  }
}

TEST(Batch, BooksAndRecordsAreThoseOfARunAlone) {
  const phs::UserModel<test::DrivenPendulum> model({});
  struct Seen {
    std::vector<double> works;
    std::vector<phs::State> states;
    bool operator==(const Seen&) const = default;
  };
  class Watched final : public BatchRun {
   public:
    explicit Watched(Seen& to) : to_(to) {}
    void book(std::span<const double> w) override {
      to_.works.insert(to_.works.end(), w.begin(), w.end());
    }
    bool see(const phs::State& s) override {
      to_.states.push_back(s);
      return true;
    }
    void end(const phs::State&, Outcome) override {}

   private:
    Seen& to_;
  };
  const auto runs = [&](bool lanes, int threads) {
    std::vector<Seen> all(11);
    size_t at = 0;
    simulate_batch(
        model, "gauss8", 0.05,
        [&]() -> std::unique_ptr<BatchRun> {
          if (at == all.size()) return nullptr;
          auto run = std::make_unique<Watched>(all[at]);
          run->start = phs::State(model.description(), {0.3 * double(at), 1.0 + double(at)});
          run->steps = 100 + std::int64_t(at);
          run->every = 7;
          run->wants_port_work = true;
          ++at;
          return run;
        },
        {.threads = threads, .lanes = lanes});
    return all;
  };
  const auto alone = runs(false, 1);
  EXPECT_EQ(alone[3].states.size(), 103u / 7 + 1) << "every seventh state and the last";
  EXPECT_FALSE(alone[3].works.empty());
  EXPECT_TRUE(runs(true, 1) == alone);
  EXPECT_TRUE(runs(true, 2) == alone);
}

TEST(Batch, LanesHandOverWhatNeedsNewton) {
  // Stiff: the fixed point does not converge, lanes are stuck at their first step or where it gets
  // slow.
  const auto robot = test::stiff_chain(3, 3000, 0.0);
  std::vector<std::vector<double>> starts;
  for (int i = 0; i < 6; ++i) {
    auto x = robot.start.x;
    for (double& v : x) v *= 1 + 0.1 * i;
    starts.push_back(x);
  }
  const double h = 0.02;
  const auto alone = one_by_one(*robot.model, "gauss8", h, 50, starts);
  const auto one = integrators::make_integrator("gauss8", *robot.model, h);
  phs::State s = robot.start;
  for (int i = 0; i < 10; ++i) ASSERT_EQ(one->step(s), Outcome::ok);
  EXPECT_NE(one->remark(), "") << "the case must need Newton to mean anything";
  EXPECT_EQ(differing(simulate_batch(*robot.model, "gauss8", h, 50, starts, {.threads = 2}), alone),
            0);
}

/// A pendulum of length k, or one that blows up where x[0] passes 2.
struct Tuned {
  phs::Description description() const {
    phs::Description d;
    d.name = "tuned";
    d.nx = 2;
    d.blocks = {{"q", phs::BlockKind::linear, 0, 1, 1, "m", "kg m/s"}};
    d.traits = {.canonical = true};
    return d;
  }
};
class TunedPendulums : public phs::ModelFor<TunedPendulums> {
 public:
  const phs::Description& description() const override { return d_; }
  template <class T>
  std::unique_ptr<phs::System<T>> make_system() const {
    return std::make_unique<Evaluator<T>>(*this);
  }

 private:
  template <class T>
  class Evaluator final : public phs::System<T>, public phs::Tunable<T> {
    using In = std::span<const T>;
    using Out = std::span<T>;

   public:
    explicit Evaluator(const TunedPendulums& m) : m_(m) {}
    std::span<T> parameters() override { return k_; }
    const phs::Description& description() const override { return m_.d_; }
    std::unique_ptr<phs::System<T>> clone() const override {
      return std::make_unique<Evaluator>(m_);
    }
    T hamiltonian(In x) override {
      return T(0.5) * x[1] * x[1] + k_[0] * (T(1.0) - phs::cos(x[0])) -
             k_[1] * x[0] * x[0] * x[0] * x[0];
    }
    void gradient(In x, Out e) override {
      e[0] = k_[0] * phs::sin(x[0]) - T(4.0) * k_[1] * x[0] * x[0] * x[0];
      e[1] = x[1];
    }
    void field(T t, In x, In, Out dx) override {
      gradient(x, e_);
      rate(t, x, e_, dx);
    }
    void rate(T, In, In e, Out dx) override {
      dx[0] = e[1];
      dx[1] = -e[0];
    }
    void apply_structure(In, In e, Out Je) override {
      Je[0] = e[1];
      Je[1] = -e[0];
    }
    void apply_dissipation(In, In, Out Re) override { Re[0] = Re[1] = T(0.0); }
    void apply_input(In, In, Out) override {}
    void output(In, In, Out) override {}
    void invariants(In, Out) override {}

   private:
    const TunedPendulums& m_;
    T k_[2] = {T(1.0), T(0.0)}, e_[2];
  };
  phs::Description d_ = Tuned{}.description();
};

TEST(Batch, EachLaneHasItsParametersAndFailuresStayAlone) {
  const TunedPendulums model;
  std::vector<BatchResult> results(10);
  size_t at = 0;
  class Kept final : public BatchRun {
   public:
    explicit Kept(BatchResult& to) : to_(to) {}
    void end(const phs::State& s, Outcome o) override { to_ = {s, o}; }

   private:
    BatchResult& to_;
  };
  simulate_batch(model, "gauss6", 0.1,
                 [&]() -> std::unique_ptr<BatchRun> {
                   if (at == results.size()) return nullptr;
                   auto run = std::make_unique<Kept>(results[at]);
                   run->start = phs::State(model.description(), {0.5, 1.0});
                   // Case 2 and 7 run away to infinity in finite time.
                   run->steps = 200;
                   run->parameters = {1.0 + double(at), at % 5 == 2 ? 3.0 : 0.0};
                   ++at;
                   return run;
                 },
                 {.threads = 1});
  for (size_t i = 0; i < results.size(); ++i) {
    const phs::TunedModel tuned(model, {1.0 + double(i), i % 5 == 2 ? 3.0 : 0.0});
    const auto alone = one_by_one(tuned, "gauss6", 0.1, 200, {{0.5, 1.0}});
    EXPECT_TRUE(same_bits(results[i].state, alone[0].state)) << i;
    EXPECT_EQ(results[i].outcome, alone[0].outcome) << i;
    EXPECT_EQ(results[i].outcome == Outcome::ok, i % 5 != 2) << i;
    EXPECT_EQ(same_bits(results[i].state, results[0].state), i == 0) << "control";
  }
}

TEST(Batch, LanesAreRefilledAtOnceAndMemoryIsThatOfTheRunsAtWork) {
  const TunedPendulums model;
  std::atomic<int> alive = 0, most = 0;
  std::vector<int> order;
  class Counted final : public BatchRun {
   public:
    Counted(int number, std::atomic<int>& alive_, std::atomic<int>& most_, std::vector<int>& order_)
        : number_(number), counter_(alive_), order_to_(order_) {
      const int now = ++counter_;
      if (now > most_) most_ = now;
    }
    ~Counted() override { --counter_; }
    void end(const phs::State&, Outcome) override { order_to_.push_back(number_); }

   private:
    int number_;
    std::atomic<int>& counter_;
    std::vector<int>& order_to_;
  };
  int made = 0;
  simulate_batch(
      model, "gauss4", 0.1,
      [&]() -> std::unique_ptr<BatchRun> {
        if (made == 300) return nullptr;
        auto run = std::make_unique<Counted>(made, alive, most, order);
        run->start = phs::State(model.description(), {0.5, 1.0});
        run->steps = made == 0
                         ? 5000
                         : 10;  // 299 short ones beside the long one: 750 steps of each other lane
        ++made;
        return run;
      },
      {.threads = 1});
  EXPECT_EQ(order.size(), 300u);
  EXPECT_EQ(order.back(), 0) << "nothing waits for the long run";
  EXPECT_LE(most, integrators::LaneIntegrator::width);
  EXPECT_EQ(alive, 0);
}

TEST(Batch, RefusesAndPassesOnWhatARunThrows) {
  const TunedPendulums model;
  EXPECT_EQ(refusal([&] {
              (void)simulate_batch(model, "gauss4", 0.1, 10,
                                   std::vector<std::vector<double>>{{1.0}});
            }),
            "start state of a run has 1 entries, expected 2");
  EXPECT_EQ(refusal([&] { (void)simulate_batch(model, "gauss4", 0, 10, {}); }).substr(0, 7),
            "step is");
  for (const int threads : {1, 2})
    EXPECT_EQ(refusal([&] {
                simulate_batch(model, "gauss4", 0.1,
                               []() -> std::unique_ptr<BatchRun> { throw InvalidArgument("no"); },
                               {.threads = threads});
              }),
              "no");
}

}  // namespace
}  // namespace porthos::ensemble::batch_test
