#include "ensemble/environment.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numeric>

#include "ensemble/batch.h"
#include "ensemble/lane_team.h"

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

}  // namespace

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
    bool finite = outcome == integrators::Outcome::ok;
    for (const double x : last.x) finite &= std::isfinite(x);
    e_.failed_[at_] = !finite;
    if (outcome == integrators::Outcome::ok) e_.states_[at_] = last;
    e_.terminated_[at_] = !finite || (e_.o_.ended && e_.o_.ended(e_.states_[at_].x));
  }

 private:
  Environment& e_;
  size_t at_;
};

Environment::Environment(std::shared_ptr<const phs::Model> model, std::vector<double> start,
                         EnvironmentOptions options)
    : model_(std::move(model)),
      start_(std::move(start)),
      o_(std::move(options)),
      keeper_(model_.description()) {
  const phs::Description& d = this->model().description();
  require_size("start state of an environment", start_.size(), size_t(d.nx));
  if (!model_.holds().empty())
    throw InvalidArgument("environment: the controller '" + model_.holds()[0]->name +
                          "' is sampled, expected none");
  if (o_.longest < 0)
    throw InvalidArgument("longest is " + std::to_string(o_.longest) + ", expected 0 or more");
  const auto at_least_one = [](const char* what, std::int64_t n) {
    if (n < 1)
      throw InvalidArgument(std::string("environment: ") + what + " is " + std::to_string(n) +
                            ", expected 1 or more");
  };
  at_least_one("count", o_.count);
  at_least_one("substeps", o_.substeps);
  if (!(o_.step > 0))
    throw InvalidArgument("environment: step is " + std::to_string(o_.step) +
                          " s, expected more than 0 s");
  driven_ = offsets_of(d, o_.ports);
  observed_ = o_.observed;
  for (const int i : observed_)
    if (i < 0 || i >= d.nx)
      throw InvalidArgument("environment: there is no state number " + std::to_string(i) +
                            " to observe, expected 0 to " + std::to_string(d.nx - 1));
  if (observed_.empty())
    for (int i = 0; i < d.nx; ++i) observed_.push_back(i);
  plant_ = this->model().instantiate<double>();
  constraints_ = plant_->constraints();
  e_.resize(size_t(d.nx));
  y_.resize(size_t(d.nu));
  const int teams = std::min(threads_of(o_.threads), o_.count);
  for (int i = 0; i < teams; ++i)
    teams_.push_back(std::make_unique<LaneTeam>(model_, o_.method, o_.step,
                                                integrators::Options{.port_work = false}));
  const auto n = size_t(o_.count);
  states_.resize(n);
  actions_.resize(n * driven_.size());
  energies_.resize(n);
  observations_.resize(n * size_t(observation_size()));
  final_ = observations_;
  terminated_.resize(n);
  truncated_.resize(n);
  failed_.resize(n);
  lengths_.resize(n);
  episodes_.assign(n, -1);
  reset(o_.seed);
}
Environment::~Environment() = default;

void Environment::begin(int environment) {
  const auto i = size_t(environment);
  std::vector<double> x = start_;
  ++episodes_[i];
  lengths_[i] = 0;
  if (o_.begin) {
    Stream random(seeds_[i], streams_[i], std::uint64_t(episodes_[i]));
    o_.begin(random, x);
    require_size("state an episode begins from", x.size(), start_.size());
    for (const double value : x)
      if (!std::isfinite(value))
        throw InvalidArgument("the state an episode begins from has a number that is not finite");
    norm_quaternions(model_.description(), x);
  }
  if (constraints_) require_on_constraints(x);
  states_[i] = phs::State(model_.description(), std::move(x));
  phs::wrap_angles(model_.description(), states_[i]);
}

void Environment::require_on_constraints(std::span<const double> x) {
  constexpr double rounding = 1e-8;
  const phs::Description& d = model_.description();
  keeper_.synchronise(std::vector<std::int64_t>(size_t(d.angle_count()), 0), *plant_);
  plant_->gradient(x, e_);
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
  constraints_->rates(e_, rows);
  constraints_->add_drift(rows);
  double fastest = 1;
  for (const auto& b : d.blocks)
    if (b.momentum >= 0)
      for (int k = 0; k < b.size; ++k)
        fastest = std::max(fastest, std::fabs(e_[size_t(b.momentum + k)]));
  if (const auto slip = worst_row(d, rows); !(slip.second <= rounding * fastest))
    refuse("the rate of the gap", " m/s or rad/s", slip);
}

void Environment::observe(int environment, std::span<double> to) {
  const phs::State& s = states_[size_t(environment)];
  keeper_.synchronise(s, *plant_);
  energies_[size_t(environment)] = plant_->hamiltonian(s.x);
  size_t at = 0;
  for (const int i : observed_) to[at++] = s.x[size_t(i)];
  if (!o_.outputs) return;
  plant_->gradient(s.x, e_);
  plant_->output(s.x, e_, y_);
  for (const int i : driven_) to[at++] = y_[size_t(i)];
}

void Environment::reset(std::optional<std::uint64_t> seed) {
  if (seed) {
    seeds_.assign(size_t(o_.count), *seed);
    streams_.resize(size_t(o_.count));
    std::iota(streams_.begin(), streams_.end(), 0);
    std::fill(episodes_.begin(), episodes_.end(), -1);
  }
  const auto width = size_t(observation_size());
  for (int i = 0; i < o_.count; ++i) {
    begin(i);
    observe(i, std::span(observations_).subspan(size_t(i) * width, width));
  }
  final_ = observations_;
  final_energies_ = energies_;
  for (auto* flags : {&terminated_, &truncated_, &failed_})
    std::fill(flags->begin(), flags->end(), 0);
}

void Environment::reset(std::span<const std::uint64_t> seeds) {
  require_size("seeds of an environment", seeds.size(), size_t(o_.count));
  seeds_.assign(seeds.begin(), seeds.end());
  streams_.assign(seeds.size(), 0);  // as one environment alone
  std::fill(episodes_.begin(), episodes_.end(), -1);
  reset();
}

void Environment::step(std::span<const double> actions) {
  require_size("actions of an environment", actions.size(), actions_.size());
  for (const double u : actions)
    if (!std::isfinite(u)) throw InvalidArgument("an action is not a finite number");
  std::copy(actions.begin(), actions.end(), actions_.begin());
  std::atomic<size_t> next{0};
  const Source source = [&]() -> std::unique_ptr<BatchRun> {
    const size_t i = next.fetch_add(1);
    return i < states_.size() ? std::make_unique<Turn>(*this, i) : nullptr;
  };
  in_parallel(int(teams_.size()), int(teams_.size()),
              [&](int t) { teams_[size_t(t)]->work(source, [] { return false; }); });
  const auto width = size_t(observation_size());
  for (int i = 0; i < o_.count; ++i) {
    const auto k = size_t(i);
    const auto row = std::span(observations_).subspan(k * width, width);
    ++lengths_[k];
    truncated_[k] = !terminated_[k] && o_.longest > 0 && lengths_[k] >= o_.longest;
    observe(i, row);
    std::copy(row.begin(), row.end(), final_.begin() + long(k * width));
    final_energies_[k] = energies_[k];
    if (terminated_[k] || truncated_[k]) {
      begin(i);
      observe(i, row);
    }
  }
}

void Environment::set_state(int environment, const phs::State& state) {
  require_size("state of an environment", state.x.size(), start_.size());
  require_size("turns of a state", state.turns.size(), states_[size_t(environment)].turns.size());
  states_[size_t(environment)] = state;
  const auto width = size_t(observation_size());
  observe(environment, std::span(observations_).subspan(size_t(environment) * width, width));
}

}  // namespace porthos::ensemble
