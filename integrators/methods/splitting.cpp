#include "integrators/methods/splitting.h"

#include <algorithm>

#include "integrators/core/entry.h"
#include "integrators/core/stagnation.h"
#include "integrators/methods/staged_steps.h"

namespace porthos::integrators {

template <class Real>
std::vector<PartialStep<Real>> splitting_program(const std::vector<Real>& gamma, int parts) {
  std::vector<PartialStep<Real>> program;
  for (size_t i = 0; i < gamma.size(); ++i)
    for (int k = 0; k < parts; ++k) {
      const int part = i % 2 ? parts - 1 - k : k;
      if (!program.empty() && program.back().part == part)
        program.back().coefficient += gamma[i];
      else
        program.push_back({part, gamma[i]});
    }
  return program;
}
template std::vector<PartialStep<double>> splitting_program(const std::vector<double>&, int);
template std::vector<PartialStep<phs::Quad>> splitting_program(const std::vector<phs::Quad>&, int);

namespace {

enum class Parts { offered, kick_and_drift };

inline bool same(double a, double b) { return a == b; }
inline bool same(phs::Quad a, phs::Quad b) { return a == b; }
inline bool same(phs::Dual a, phs::Dual b) { return a.v == b.v && a.d == b.d; }

template <class T>
class Splitting : public BasicIntegrator<T> {
  using Base = BasicIntegrator<T>;
  using Base::cost_, Base::n_, Base::system_;
  using typename Base::State;
  using Real = TableReal<T>;

 public:
  Splitting(const Declaration& d, const std::vector<Real>& gamma, Parts parts,
            const phs::Model& model, T h, const Options& o)
      : Base(d, model, h, o),
        offered_(parts == Parts::offered),
        autonomous_(model.description().traits.autonomous),
        program_(splitting_program(gamma, offered_ ? int(model.description().flows.size()) : 2)),
        clock_(offered_ ? model.description().flows.size() : 1),
        x_(n_),
        lo_(n_),
        y_(n_),
        q_of_force_(n_ / 2),
        force_(n_ / 2) {
    turns_of_force_.assign(size_t(model.description().angle_count()), 0);
  }

  void tell_turns(const State& s) override {
    if (s.turns != turns_of_force_) {
      turns_of_force_ = s.turns;
      have_force_ = false;
    }
    Base::tell_turns(s);
  }

  Outcome advance(T t, T h, State& s) override {
    std::copy(s.x.begin(), s.x.end(), x_.begin());
    std::copy(s.lo.begin(), s.lo.end(), lo_.begin());
    std::fill(clock_.begin(), clock_.end(), t);
    for (const auto& step : program_) {
      const T dt = T(step.coefficient) * h;
      if (offered_)
        flow(step.part, dt, s);
      else if (step.part == 0)
        kick(dt, s);
      else
        drift(dt, s);
    }
    for (const T& x : s.x)
      if (!(magnitude(x) < HUGE_VAL)) {
        std::copy(x_.begin(), x_.end(), s.x.begin());
        std::copy(lo_.begin(), lo_.end(), s.lo.begin());
        have_force_ = false;
        return Outcome::not_finite;
      }
    return Outcome::ok;
  }

 private:
  /// The flow moves the rounded state; the resulting change is added to x + lo.
  void flow(int part, T dt, State& s) {
    std::copy(s.x.begin(), s.x.end(), y_.begin());
    system_->flow(part, clock_[size_t(part)], dt, y_);
    clock_[size_t(part)] += dt;
    for (size_t i = 0; i < n_; ++i) phs::compensated_add(s.x[i], s.lo[i], y_[i] - s.x[i]);
    ++cost_.evaluations;
  }

  void kick(T dt, State& s) {
    if (!force_is_of(s)) {
      evaluate(s);
      std::copy(s.x.begin(), s.x.begin() + long(n_ / 2), q_of_force_.begin());
      std::copy(y_.begin() + long(n_ / 2), y_.end(), force_.begin());
      have_force_ = true;
      t_of_force_ = clock_[0];
    }
    for (size_t i = 0, p = n_ / 2; p < n_; ++i, ++p)
      phs::compensated_add(s.x[p], s.lo[p], dt * force_[i]);
    last_kick_ = dt;
  }
  void drift(T dt, State& s) {
    evaluate(s);
    for (size_t i = 0; i < n_ / 2; ++i) phs::compensated_add(s.x[i], s.lo[i], dt * y_[i]);
    clock_[0] += dt;
  }
  void evaluate(const State& s) {
    system_->field(clock_[0], s.x, {}, y_);
    ++cost_.evaluations;
  }
  /// The last kick of a step and the first of the next share one force evaluation, unless an angle
  /// was wrapped in between. The check compares q itself, so a restart, which evaluates the force
  /// anew, gives the same bits.
  bool force_is_of(const State& s) const {
    if (!have_force_ || !(autonomous_ || same(t_of_force_, clock_[0]))) return false;
    for (size_t i = 0; i < n_ / 2; ++i)
      if (!same(s.x[i], q_of_force_[i])) return false;
    return true;
  }

  bool offered_, autonomous_;
  std::vector<PartialStep<Real>> program_;
  std::vector<T> clock_;  ///< one per part

 protected:
  std::vector<T> x_, lo_, y_;  ///< the state before the step; a flow or field
  std::vector<T> q_of_force_, force_;
  T last_kick_ = T(0.0);  ///< over that time [s]

 private:
  std::vector<std::int64_t> turns_of_force_;
  T t_of_force_ = T(0.0);
  bool have_force_ = false;
};

template <class T>
class SplittingSteps final : public Splitting<T>, public StepsByDuals<T> {
  using Splitting<T>::x_, Splitting<T>::lo_;

 public:
  using Splitting<T>::Splitting;
  void stages(const phs::BasicState<T>& after, std::span<T> Y) const override {
    const size_t n = x_.size();
    for (size_t k = 0; k < n; ++k) {
      Y[k] = x_[k] + lo_[k];
      Y[n + k] = after.x[k] + after.lo[k];
    }
  }
};

/// Störmer-Verlet of a separable system.
template <class T>
class KickDriftKick final : public Splitting<T>, public StagedSteps<T> {
  using Splitting<T>::x_, Splitting<T>::lo_, Splitting<T>::force_, Splitting<T>::last_kick_;

 public:
  using Splitting<T>::Splitting;
  CollocationTable<TableReal<T>> table() const override { return lobatto_table<TableReal<T>>(2); }
  /// (q, p½), (q', p½)
  void stages(const phs::BasicState<T>& after, std::span<T> Y) const override {
    const size_t n = force_.size();
    for (size_t i = 0; i < n; ++i) {
      Y[i] = x_[i] + lo_[i];
      Y[2 * n + i] = this->q_of_force_[i];
      Y[n + i] = Y[3 * n + i] = after.x[n + i] + (after.lo[n + i] - last_kick_ * force_[i]);
    }
  }
};

template <class T>
auto gammas_of(const CompositionTable* table) {
  using Real = TableReal<T>;
  return table ? table->gammas<Real>() : std::vector<Real>{Real(1)};
}

}  // namespace

template <class T>
std::unique_ptr<BasicIntegrator<T>> make_splitting(const Declaration& d,
                                                   const CompositionTable* table,
                                                   const phs::Model& m, T h, const Options& o) {
  return std::make_unique<SplittingSteps<T>>(
      d, gammas_of<T>(table),
      m.description().flows.empty() ? Parts::kick_and_drift : Parts::offered, m, h, o);
}
template <class T>
std::unique_ptr<BasicIntegrator<T>> make_kick_drift_kick(const Declaration& d, const phs::Model& m,
                                                         T h, const Options& o) {
  return std::make_unique<KickDriftKick<T>>(d, gammas_of<T>(&composition_table("strang")),
                                            Parts::kick_and_drift, m, h, o);
}
#define PORTHOS_INSTANTIATE(T)                                                            \
  template std::unique_ptr<BasicIntegrator<T>> make_splitting<T>(                         \
      const Declaration&, const CompositionTable*, const phs::Model&, T, const Options&); \
  template std::unique_ptr<BasicIntegrator<T>> make_kick_drift_kick<T>(                   \
      const Declaration&, const phs::Model&, T, const Options&);
PORTHOS_FOR_EACH_STEP_SCALAR(PORTHOS_INSTANTIATE)
#undef PORTHOS_INSTANTIATE

Entries splitting_entries() {
  const auto splitting = [](std::string name, std::string title, int order, std::string source,
                            const CompositionTable* table) {
    return entry({.name = std::move(name),
                  .title = std::move(title),
                  .family = "Splittings",
                  .order = order,
                  .symmetric = table ? Claim::holds : Claim::fails,
                  .symplectic = Claim::holds,
                  .needs = {.lossless = true, .flows = true},
                  .source = std::move(source)},
                 [table](const Declaration& d, const phs::Model& m, auto h, const Options& o) {
                   return make_splitting(d, table, m, h, o);
                 });
  };
  Entries e{splitting("lie_trotter", "Lie-Trotter splitting, the symplectic Euler method", 1,
                      "Trotter 1959; de Vogelaere 1956", nullptr)};
  for (const auto& t : adjoint_compositions())
    e.push_back(splitting(t.name, t.title, t.order, t.source, &t));
  return e;
}

}  // namespace porthos::integrators
