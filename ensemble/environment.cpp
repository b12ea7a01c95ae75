#include "ensemble/environment.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numeric>

#include "ensemble/batch.h"
#include "ensemble/held_inputs.h"
#include "ensemble/lane_team.h"
#include "integrators/core/turns.h"
#include "phs/system/constraints.h"

namespace porthos::ensemble {
namespace {

/// Offsets in u of the ports with these names; of all ports if there are no names.
std::vector<int> offsets_of(const phs::Description& d, const std::vector<std::string>& names) {
  std::vector<int> at;
  if (names.empty())
    for (int i = 0; i < d.nu; ++i) at.push_back(i);
  for (const auto& name : names) {
    const auto& p = find_named(d.ports, name, "environment: '" + d.name + "' has no port");
    if (std::ranges::count(names, name) > 1)
      throw InvalidArgument("environment: the port '" + name + "' is named twice, expected once");
    for (int i = 0; i < p.size; ++i) at.push_back(p.at + i);
  }
  return at;
}

/// Norms the quaternions of x.
void norm_quaternions(const phs::Description& d, std::vector<double>& x) {
  for (const auto& b : d.blocks) {
    if (b.kind != phs::BlockKind::rotation) continue;
    double norm = 0;
    for (int k = 0; k < 4; ++k) norm = std::hypot(norm, x[size_t(b.at + k)]);
    if (!(norm > 0))
      throw InvalidArgument("the state an episode begins from: the quaternion '" + b.name +
                            "' is zero, expected one of norm 1");
    for (int k = 0; k < 4; ++k) x[size_t(b.at + k)] /= norm;
  }
}

/// The constraint of the largest |row|, and that number.
std::pair<std::string, double> worst_row(const phs::Description& d, std::span<const double> rows) {
  std::pair<std::string, double> worst;
  for (const auto& c : d.constraints)
    for (int r = 0; r < c.size; ++r)
      if (const double g = std::fabs(rows[size_t(c.at + r)]); !(g <= worst.second))
        worst = {c.name, g};
  return worst;
}

/// Whether x and u mean the same.
bool alike(const phs::Description& a, const phs::Description& b) {
  const auto same = [](const auto& x, const auto& y) {
    return x.name == y.name && x.at == y.at && x.size == y.size;
  };
  return a.nx == b.nx && a.nu == b.nu && std::ranges::equal(a.blocks, b.blocks, same) &&
         std::ranges::equal(a.ports, b.ports, same);
}

}  // namespace

/// A model with what observes it and what steps it.
class Environment::Plant {
 public:
  Plant(std::shared_ptr<const phs::Model> model, const EnvironmentOptions& o, int threads)
      : held_(std::move(model)),
        keeper_(held_.description()),
        system_(held_.plant().instantiate<double>()),
        constraints_(system_->constraints()) {
    if (!held_.holds().empty())
      throw InvalidArgument("environment: the controller '" + held_.holds()[0]->name +
                            "' is sampled, expected none");
    for (int i = 0; i < threads; ++i)
      teams_.push_back(std::make_unique<LaneTeam>(held_, o.method, o.step,
                                                  integrators::Options{.port_work = false}));
  }
  const phs::Model* model() const { return &held_.plant(); }
  /// For a state with its turns.
  phs::System<double>& at(const phs::State& s) {
    keeper_.synchronise(s, *system_);
    return *system_;
  }
  /// @throws InvalidArgument where x, angles with their turns, leaves a loop open or moves it
  void require_on_constraints(std::span<const double> x);
  LaneTeam& team(int thread) { return *teams_[size_t(thread)]; }
  void add_spent(LaneTeam::Spent& sum) const {
    for (const auto& t : teams_) t->add_spent(sum);
  }

 private:
  HeldInputs held_;
  integrators::TurnKeeper<double> keeper_;                 ///< of the turns of system_
  std::unique_ptr<phs::System<double>> system_;            ///< for observations
  std::unique_ptr<phs::Constraints<double>> constraints_;  ///< of it without turns; or null
  std::vector<std::unique_ptr<LaneTeam>> teams_;           ///< of each thread
};

/// One step of one environment under one action.
class Environment::Turn final : public BatchRun {
 public:
  Turn(Environment& e, size_t at) : e_(e), at_(at) {
    start = e.states_[at];
    steps = e.o_.substeps;
    parameters.assign(size_t(e.model().description().nu), 0.0);
    for (size_t i = 0; i < e.driven_.size(); ++i)
      parameters[size_t(e.driven_[i])] = e.actions_[at * e.driven_.size() + i];
  }
  void end(const phs::State& last, integrators::Outcome outcome) override {
    using integrators::Outcome;
    const bool finite = std::ranges::all_of(last.x, [](double x) { return std::isfinite(x); });
    if (outcome == Outcome::ok && !finite) outcome = Outcome::not_finite;
    e_.outcomes_[at_] = outcome;
    e_.failed_[at_] = outcome != Outcome::ok;
    if (!e_.failed_[at_]) e_.states_[at_] = last;
    const auto& own = e_.given_[size_t(e_.cases_[at_])].ended;
    const auto& ended = own ? own : e_.o_.ended;
    e_.terminated_[at_] = e_.failed_[at_] || (ended && ended(e_.states_[at_].x));
  }

 private:
  Environment& e_;
  size_t at_;
};

Environment::Environment(std::shared_ptr<const phs::Model> model, std::vector<double> start,
                         EnvironmentOptions options)
    : Environment(std::vector{EnvironmentCase{std::move(model), std::move(start)}},
                  std::move(options)) {}

Environment::Environment(std::vector<EnvironmentCase> cases, EnvironmentOptions options)
    : given_(std::move(cases)), o_(std::move(options)) {
  if (given_.empty()) throw InvalidArgument("an environment has no cases, expected 1 or more");
  check_options();
  const phs::Description& d = model().description();
  driven_ = offsets_of(d, o_.ports);
  observed_ = o_.observed;
  for (const int i : observed_)
    if (i < 0 || i >= d.nx)
      throw InvalidArgument("environment: there is no state number " + std::to_string(i) +
                            " to observe, expected 0 to " + std::to_string(d.nx - 1));
  if (observed_.empty())
    for (int i = 0; i < d.nx; ++i) observed_.push_back(i);
  threads_ = std::min(threads_of(o_.threads), o_.count);
  for (size_t k = 0; k < given_.size(); ++k) {
    const EnvironmentCase& c = given_[k];
    if (!alike(c.model->description(), d))
      throw InvalidArgument("case " + std::to_string(k) +
                            " of an environment has other state numbers or ports than case 0, "
                            "expected cases that differ in numbers alone");
    require_size("start state of an environment", c.start.size(), size_t(d.nx));
    const auto found = std::ranges::find(plants_, c.model.get(), &Plant::model);
    plant_of_case_.push_back(size_t(found - plants_.begin()));
    if (found == plants_.end()) plants_.push_back(std::make_unique<Plant>(c.model, o_, threads_));
  }
  e_.resize(size_t(d.nx));
  y_.resize(size_t(d.nu));
  const auto n = size_t(o_.count);
  states_.resize(n);
  cases_.resize(n);
  actions_.resize(n * driven_.size());
  energies_.resize(n);
  observations_.resize(n * size_t(observation_size()));
  lengths_ = episodes_ = std::vector<std::int64_t>(n, -1);
  reset(o_.seed);
  unused_.assign(n, 1);
}

void Environment::check_options() const {
  const auto at_least = [](int least, const std::string& what, std::int64_t n) {
    if (n < least)
      throw InvalidArgument(what + " is " + std::to_string(n) + ", expected " +
                            std::to_string(least) + " or more");
  };
  at_least(0, "longest", o_.longest);
  at_least(1, "environment: count", o_.count);
  at_least(1, "environment: substeps", o_.substeps);
  if (!(o_.step > 0))
    throw InvalidArgument("environment: step is " + std::to_string(o_.step) +
                          " s, expected more than 0 s");
}

Environment::~Environment() = default;

Environment::Plant& Environment::plant_of(int environment) const {
  return *plants_[plant_of_case_[size_t(cases_[size_t(environment)])]];
}

void Environment::begin(int environment) {
  const auto i = size_t(environment);
  ++episodes_[i];
  lengths_[i] = 0;
  Stream random(seeds_[i], streams_[i], std::uint64_t(episodes_[i]));
  if (given_.size() > 1) cases_[i] = int(double(given_.size()) * random.uniform());
  std::vector<double> x = given_[size_t(cases_[i])].start;
  const phs::Description& d = model().description();
  if (o_.begin) {
    o_.begin(random, x);
    require_size("state an episode begins from", x.size(), size_t(d.nx));
    if (!std::ranges::all_of(x, [](double value) { return std::isfinite(value); }))
      throw InvalidArgument("the state an episode begins from has a number that is not finite");
    norm_quaternions(d, x);
  }
  plant_of(environment).require_on_constraints(x);
  states_[i] = phs::State(d, std::move(x));
  phs::wrap_angles(d, states_[i]);
  observe(environment);
}

void Environment::Plant::require_on_constraints(std::span<const double> x) {
  if (!constraints_) return;
  constexpr double rounding = 1e-8;
  const phs::Description& d = held_.description();
  keeper_.synchronise(std::vector<std::int64_t>(size_t(d.angle_count()), 0), *system_);
  std::vector<double> e(x.size());
  system_->gradient(x, e);
  std::vector<double> rows(size_t(constraints_->count()));
  const auto refuse = [](const std::string& what, const char* unit, const auto& worst) {
    throw InvalidArgument("the state an episode begins from: " + what + " of the constraint '" +
                          worst.first + "' is " + number(worst.second, 3) + unit +
                          ", expected a start on it: q, v, found = model.close_loops(q, v) of the "
                          "mechanical model, in begin or before");
  };
  constraints_->set_time(0);
  constraints_->place(x, rows);
  if (const auto gap = worst_row(d, rows); !(gap.second <= rounding))
    refuse("the gap", " m or rad", gap);
  constraints_->rates(e, rows);
  constraints_->add_drift(rows);
  double fastest = 1;
  for (const auto& b : d.blocks)
    if (b.momentum >= 0)
      for (int k = 0; k < b.size; ++k)
        fastest = std::max(fastest, std::fabs(e[size_t(b.momentum + k)]));
  if (const auto slip = worst_row(d, rows); !(slip.second <= rounding * fastest))
    refuse("the rate of the gap", " m/s or rad/s", slip);
}

void Environment::observe(int environment) {
  const auto width = size_t(observation_size());
  const auto to = std::span(observations_).subspan(size_t(environment) * width, width);
  const phs::State& s = states_[size_t(environment)];
  auto& system = plant_of(environment).at(s);
  energies_[size_t(environment)] = system.hamiltonian(s.x);
  size_t at = 0;
  for (const int i : observed_) to[at++] = s.x[size_t(i)];
  if (!o_.outputs) return;
  system.gradient(s.x, e_);
  system.output(s.x, e_, y_);
  for (const int i : driven_) to[at++] = y_[size_t(i)];
}

void Environment::reset(std::optional<std::uint64_t> seed) {
  if (seed) {
    seeds_.assign(size_t(o_.count), *seed);
    streams_.resize(size_t(o_.count));
    std::iota(streams_.begin(), streams_.end(), 0);
    std::fill(episodes_.begin(), episodes_.end(), -1);
  }
  for (int i = 0; i < o_.count; ++i)
    if (episodes_[size_t(i)] < 0 || !unused_[size_t(i)]) begin(i);
  unused_.assign(states_.size(), 0);
  final_ = before_ = observations_;
  final_energies_ = energies_before_ = energies_;
  final_cases_ = cases_;
  for (auto* flags : {&terminated_, &truncated_, &failed_}) flags->assign(states_.size(), 0);
  outcomes_.assign(states_.size(), integrators::Outcome::ok);
}

void Environment::reset(std::span<const std::uint64_t> seeds) {
  require_size("seeds of an environment", seeds.size(), size_t(o_.count));
  seeds_.assign(seeds.begin(), seeds.end());
  streams_.assign(seeds.size(), 0);  // as one environment alone
  std::fill(episodes_.begin(), episodes_.end(), -1);
  reset();
}

void Environment::advance() {
  std::vector<std::vector<size_t>> copies(plants_.size());
  for (size_t i = 0; i < cases_.size(); ++i) copies[plant_of_case_[size_t(cases_[i])]].push_back(i);
  std::vector<std::atomic<size_t>> taken(plants_.size());
  LaneTeam::Spent earlier, now;
  for (const auto& p : plants_) p->add_spent(earlier);
  in_parallel(threads_, threads_, [&](int thread) {
    for (size_t j = 0; j < plants_.size(); ++j) {  // each thread from a model of its own
      const size_t k = (j + size_t(thread) * plants_.size() / size_t(threads_)) % plants_.size();
      if (taken[k] >= copies[k].size()) continue;
      const Source source = [&]() -> std::unique_ptr<BatchRun> {
        const size_t i = taken[k].fetch_add(1);
        return i < copies[k].size() ? std::make_unique<Turn>(*this, copies[k][i]) : nullptr;
      };
      plants_[k]->team(thread).work(source, [] { return false; });
    }
  });
  for (const auto& p : plants_) p->add_spent(now);
  iterations_ = double(now.iterations - earlier.iterations) / (o_.count * o_.substeps);
  alone_ = int(now.alone - earlier.alone);
}

void Environment::step(std::span<const double> actions) {
  require_size("actions of an environment", actions.size(), actions_.size());
  for (const double u : actions)
    if (!std::isfinite(u)) throw InvalidArgument("an action is not a finite number");
  std::copy(actions.begin(), actions.end(), actions_.begin());
  before_ = observations_;
  energies_before_ = energies_;
  unused_.assign(states_.size(), 0);
  advance();
  final_cases_ = cases_;
  for (size_t k = 0; k < states_.size(); ++k) {
    ++lengths_[k];
    truncated_[k] = !terminated_[k] && o_.longest > 0 && lengths_[k] >= o_.longest;
    unused_[k] = terminated_[k] || truncated_[k];
    observe(int(k));
  }
  final_ = observations_;
  final_energies_ = energies_;
  for (int i = 0; i < o_.count; ++i)
    if (unused_[size_t(i)]) begin(i);
}

void Environment::end(std::span<const std::uint8_t> which, bool failed) {
  require_size("flags of an environment", which.size(), size_t(o_.count));
  const auto width = size_t(observation_size());
  for (size_t k = 0; k < which.size(); ++k) {
    if (!which[k]) continue;
    terminated_[k] = 1;
    truncated_[k] = 0;
    if (failed && !failed_[k]) {
      failed_[k] = 1;
      std::copy_n(before_.begin() + long(k * width), width, final_.begin() + long(k * width));
      final_energies_[k] = energies_before_[k];
    }
    if (!unused_[k]) begin(int(k));
    unused_[k] = 1;
  }
}

void Environment::set_state(int environment, const phs::State& state) {
  const auto i = size_t(environment);
  require_size("state of an environment", state.x.size(), given_[0].start.size());
  require_size("turns of a state", state.turns.size(), states_[i].turns.size());
  states_[i] = state;
  unused_[i] = 0;
  observe(environment);
}

}  // namespace porthos::ensemble
