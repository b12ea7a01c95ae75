#include "integrators/methods/composition.h"

#include <algorithm>

#include "integrators/core/entry.h"

namespace porthos::integrators {
namespace {

template <class T>
class Composition final : public BasicIntegrator<T>, public ComposedSteps<T> {
  using Base = BasicIntegrator<T>;
  using Base::cost_, Base::port_work_;
  using ComposedSteps<T>::watch_;
  using typename Base::State;
  using Real = TableReal<T>;

 public:
  Composition(const Declaration& d, const CompositionTable& table, const std::string& base,
              const phs::Model& model, T h, const Options& o)
      : Base(d, model, h, o),
        gamma_(table.gammas<Real>()),
        base_(make_basic_integrator<T>(base, model, h, o)),
        x_(Base::n_),
        lo_(Base::n_),
        fresh_(base_->memory()) {
    const auto& b = base_->declaration();
    if (b.symmetric != Claim::holds || b.order < 2 || b.order % 2 || table.centre != Centre::one)
      throw InvalidArgument("composition '" + table.name + "' of '" + base +
                            "': expected a symmetric base of even order");
  }

  Outcome advance(T t, T h, State& s) override {
    std::copy(s.x.begin(), s.x.end(), x_.begin());
    std::copy(s.lo.begin(), s.lo.end(), lo_.begin());
    // The middle step is set so that the sum is exact: clock and base then agree on h to the last
    // bit.
    const size_t stages = gamma_.size(), middle = stages / 2;
    T outer(0.0), taken(0.0);
    port_work_.restart();
    for (size_t i = 0; i < middle; ++i) outer += T(gamma_[i]) * h;
    for (size_t i = 0; i < stages; ++i) {
      const T step = i == middle ? h - T(2.0) * outer : T(gamma_[i]) * h;
      const Outcome o = base_->advance(t + taken, step, s);
      if (o != Outcome::ok) {
        std::copy(x_.begin(), x_.end(), s.x.begin());
        std::copy(lo_.begin(), lo_.end(), s.lo.begin());
        base_->restore(fresh_);  // its memory is of stages that are undone
        return o;
      }
      if (watch_) watch_(i, t + taken, step, s);
      taken += step;
      if (integrates_power()) port_work_.add(base_->port_work());
    }
    return Outcome::ok;
  }

  const Base& base() const override { return *base_; }
  size_t count() const override { return gamma_.size(); }

  void tell_turns(const State& s) override { base_->tell_turns(s); }
  void carry(Archive& a) override { base_->carry(a); }
  std::string remark() const override { return base_->remark(); }
  bool integrates_power() const override { return base_->integrates_power(); }
  Cost cost() const override {
    Cost c = base_->cost();
    c.steps = cost_.steps;
    return c;
  }
  void set_cost(const Cost& c) override {
    cost_ = c;
    base_->set_cost(c);
  }

 private:
  std::vector<Real> gamma_;
  std::unique_ptr<BasicIntegrator<T>> base_;
  std::vector<T> x_, lo_;      ///< the state before the step
  std::vector<double> fresh_;  ///< memory of a base before its first step
};

}  // namespace

template <class T>
std::unique_ptr<BasicIntegrator<T>> make_composition(const Declaration& d,
                                                     const CompositionTable& table,
                                                     const std::string& base, const phs::Model& m,
                                                     T h, const Options& o) {
  return std::make_unique<Composition<T>>(d, table, base, m, h, o);
}
#define PORTHOS_INSTANTIATE(T)                                                               \
  template std::unique_ptr<BasicIntegrator<T>> make_composition<T>(                          \
      const Declaration&, const CompositionTable&, const std::string&, const phs::Model&, T, \
      const Options&);
PORTHOS_FOR_EACH_STEP_SCALAR(PORTHOS_INSTANTIATE)
#undef PORTHOS_INSTANTIATE

Entries composition_entries() {
  const auto composition = [](const CompositionTable& table, Declaration d, std::string base) {
    d.title = table.title + ", on " +
              (base == "midpoint" ? "the midpoint rule"
               : base == "rattle" ? "RATTLE, for constraints"
                                  : "Stormer-Verlet");
    d.family = compositions;
    d.order = table.order;
    d.symmetric = d.symplectic = Claim::holds;
    d.source = table.source;
    return entry(std::move(d), [&table, base](const Declaration& decl, const phs::Model& m, auto h,
                                              const Options& o) {
      return make_composition(decl, table, base, m, h, o);
    });
  };
  Entries e;
  for (const auto& t : symmetric_compositions())
    e.push_back(composition(t, {.name = t.name, .quadratic_invariants = Claim::holds}, "midpoint"));
  for (const char* name : {"suzuki4", "yoshida4", "kahan_li6", "kahan_li8"})
    e.push_back(composition(
        composition_table(name),
        {.name = std::string(name) + "_sv", .needs = {.canonical = true, .lossless = true}},
        "stormer_verlet"));
  for (const char* name : {"suzuki4", "kahan_li8"})
    e.push_back(composition(composition_table(name),
                            {.name = std::string(name) + "_rattle",
                             .constraints = true,
                             .needs = {.canonical = true, .lossless = true}},
                            "rattle"));
  return e;
}

}  // namespace porthos::integrators
