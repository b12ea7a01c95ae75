#include "integrators/methods/lane_collocation.h"

#include "integrators/core/step_rule.h"
#include "integrators/methods/collocation_stages.h"

namespace porthos::integrators {

/// The step of one state per lane, by fixed-point iteration; each lane has its own iteration.
class LaneCollocation {
  using Pack = LaneIntegrator::Lanes;
  static constexpr int most_stages = 16;

 public:
  static constexpr bool integrates_power = true;
  LaneCollocation(const Workplace<Pack>& w, const CollocationTable<double>& table, double h)
      : work_(w),
        n_(size_t(w.model.description().nx)),
        h_(h),
        step_(table, n_),
        solver_(Stagnation::of<double>(w.options.iteration_tolerance), w.options, n_),
        F_(w.port_work.any() ? n_ : 0),
        lane_(size_t(LaneIntegrator::width), Lane(w.options.iteration_tolerance)) {
    step_.adapt_to(h, h);
    offer_newton(solver_, table, w.model, w.options);
  }

  LaneSet begin(LaneSet lanes, const StepStart<Pack>& at) {
    LaneSet predicted = 0, newton = 0;
    for_each_lane(lanes, [&](int i) {
      Lane& l = lane_[size_t(i)];
      if (l.memory.choice.newton()) {
        newton |= lane_bit(i);
        return;
      }
      l.before = l.memory;
      l.finishing = false;
      const bool trusts = l.memory.trusts(l.have_before);
      l.iteration.begin(trusts, work_.options.max_sweeps);
      if (trusts) predicted |= lane_bit(i);
    });
    step_.guess(at.x, at.lo, lanes & ~newton, predicted);
    return newton;
  }

  /// One evaluation of every stage of every lane: a sweep for lanes that iterate, the last
  /// evaluation for those that have stagnated.
  Ended round(LaneSet lanes, const StepStart<Pack>& at) {
    for (size_t i = 0; i < size_t(step_.s); ++i) {
      work_.system.field(at.t + Pack(step_.ch[i]), step_.Y[i], {}, step_.L[i]);
      for (Pack& L : step_.L[i]) L = Pack(step_.hb[i]) * L;
    }
    Ended e;
    for_each_lane(lanes, [&](int i) {
      if (lane_[size_t(i)].finishing) e.done |= lane_bit(i);
    });
    if (const LaneSet sweeping = lanes & ~e.done) sweep(sweeping, at, e);
    if (e.failed()) {
      for_each_lane(e.failed(), [&](int i) { lane_[size_t(i)].memory = lane_[size_t(i)].before; });
      step_.guess(at.x, at.lo, e.failed(), 0);
    }
    if (e.done) finish(e.done, at.t);
    return e;
  }
  Pack move(size_t k) const { return step_.sum(k); }

  void forget(LaneSet lanes, const StepStart<Pack>& at) {
    for_each_lane(lanes, [&](int i) {
      lane_[size_t(i)].have_before = false;
      lane_[size_t(i)].memory = {};
    });
    step_.guess(at.x, at.lo, lanes, 0);
  }
  void carry(Archive& a, int lane) {
    Lane& l = lane_[size_t(lane)];
    double h = l.have_before ? h_ : 0.0;
    a(l.have_before);
    a(h);
    step_.carry(a, lane);
    solver_.carry(a, l.memory);
  }

 private:
  struct Lane {
    explicit Lane(double tolerance) : iteration(Stagnation::of<double>(tolerance)) {}
    Iterating iteration;
    SolverMemory memory, before;  ///< before: at the start of the step
    bool have_before = false;
    bool finishing = false;  ///< the next evaluation is the last
  };

  void sweep(LaneSet sweeping, const StepStart<Pack>& at, Ended& e) {
    const auto moves = step_.sweep(at.x, step_.low_words(at.lo), sweeping);
    LaneSet again = 0;
    for_each_lane(sweeping, [&](int i) {
      using Next = Iterating::Next;
      Lane& l = lane_[size_t(i)];
      Next next = l.iteration.after(moves.in_lane(i), moves.distance[i], [] { return 0.0; });
      if ((next == Next::sweep || next == Next::guess_again) && l.iteration.ran_out())
        // Newton gets closer than "only noise seems to remain".
        next = l.iteration.settled() && !solver_.has_newton() ? Next::finish : Next::diverges;
      if (next == Next::guess_again)
        again |= lane_bit(i);
      else if (next == Next::finish)
        l.finishing = true;
      else if (next == Next::done)
        e.done |= lane_bit(i);
      else if (next != Next::sweep)
        (next == Next::diverges ? e.not_converged : e.not_finite) |= lane_bit(i);
    });
    if (again) step_.guess(at.x, at.lo, again, 0);
  }

  void finish(LaneSet done, Pack t) {
    if (work_.port_work.any()) book(t);
    const auto now = mask_of<Pack>(done);
    for (size_t i = 0; i < size_t(step_.s); ++i)
      for (size_t k = 0; k < n_; ++k)
        step_.L_before[i][k] = select(now, step_.L[i][k], step_.L_before[i][k]);
    for_each_lane(done, [&](int i) {
      Lane& l = lane_[size_t(i)];
      l.have_before = true;
      if (l.iteration.dropped()) l.memory.dropped_prediction();
      if (solver_.has_newton()) l.memory.choice.fixed_point_was(true, l.iteration.sweeps());
    });
  }
  void book(Pack t) {
    work_.port_work.restart();
    for (size_t i = 0; i < size_t(step_.s); ++i) {
      const Pack hb(step_.hb[i]);
      for (size_t k = 0; k < n_; ++k) F_[k] = step_.L[i][k] / hb;
      work_.port_work.add(work_.system, t + Pack(step_.ch[i]), hb, step_.Y[i], F_);
    }
  }

  Workplace<Pack> work_;
  size_t n_;
  double h_;
  CollocationStages<Pack, most_stages> step_;
  StepSolver solver_;  ///< not used to solve: decides when Newton is due, and lays out the memory
  std::vector<Pack> F_;
  std::vector<Lane> lane_;
};

std::unique_ptr<LaneIntegrator> make_lane_collocation(const CollocationTable<double>& table,
                                                      const phs::Model& model, double h,
                                                      const Options& o) {
  if (o.solver != Solver::automatic && o.solver != Solver::fixed_point) return nullptr;
  return std::make_unique<StatePerLane<LaneCollocation>>(model, h, o, table, h);
}

}  // namespace porthos::integrators
