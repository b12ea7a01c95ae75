#include <cmath>

#include "integrators/rk4.h"

namespace porthos::integrators {
namespace {

/// The step of rk4.cpp for a state per lane.
class LaneRungeKutta4 final : public LaneIntegrator {
 public:
  LaneRungeKutta4(const phs::Model& model, double h, const Options& o)
      : LaneIntegrator(model, h, o),
        k_(n_, Lanes(0.0)),
        y_(k_),
        sum_(k_),
        e_(works_.empty() ? 0 : n_),
        power_(works_) {}

  std::vector<double> memory(int) const override { return {}; }

 private:
  void forget(int) override {}
  void begin(Set lanes) override {
    for (int l = 0; l < width; ++l)
      if (lanes & bit(l)) run_[size_t(l)].phase = Phase::sweeping;
  }
  void advance() override {
    const Set all = in(Phase::sweeping);
    const double at[] = {0.0, 0.5, 0.5, 1.0},
                 weight[] = {1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0};
    const auto m = mask(all);
    for (Lanes& w : works_) w = select(m, Lanes(0.0), w);
    for (Lanes& s : sum_) s = Lanes(0.0);
    for (int stage = 0; stage < 4; ++stage) {
      const Lanes t = t_ + Lanes(at[stage] * h_), c(at[stage] * h_), hw(h_ * weight[stage]);
      for (size_t i = 0; i < n_; ++i) y_[i] = stage == 0 ? x_[i] : x_[i] + c * k_[i];
      system_->field(t, y_, {}, k_);
      for (size_t i = 0; i < n_; ++i) sum_[i] += hw * k_[i];
      if (works_.empty()) continue;
      system_->efforts(t, y_, k_, e_);
      system_->powers(t, y_, e_, power_);
      for (size_t a = 0; a < works_.size(); ++a)
        works_[a] = select(m, works_[a] + hw * power_[a], works_[a]);
    }
    Set done = all;
    for (int l = 0; l < width; ++l) {
      if (!(all & bit(l))) continue;
      bool finite = true;
      for (const Lanes& s : sum_) finite &= std::fabs(s[l]) < HUGE_VAL;
      if (!finite) done &= ~bit(l), run_[size_t(l)].phase = Phase::stuck;
    }
    if (!done) return;
    for (size_t i = 0; i < n_; ++i) add(done, i, sum_[i]);
    finished(done);
  }

  std::vector<Lanes> k_, y_, sum_, e_, power_;
};

}  // namespace

std::unique_ptr<LaneIntegrator> make_lane_rk4(const phs::Model& model, double h, const Options& o) {
  return std::make_unique<LaneRungeKutta4>(model, h, o);
}

}  // namespace porthos::integrators
