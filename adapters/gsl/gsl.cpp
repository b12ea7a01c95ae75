#include "adapters/gsl/gsl.h"

#include <gsl/gsl_errno.h>
#include <gsl/gsl_odeiv2.h>

#include <cmath>

#include "integrators/catalogue.h"

namespace porthos::adapters {
namespace {

using namespace integrators;

/// A stepper of gsl_odeiv2 under its standard control. Works to Options::rtol and atol; a "step" of length h is as many
/// inner steps as it likes, stopped exactly at its end. Angles are not wrapped and low words stay zero.
class Gsl final : public Integrator {
 public:
  Gsl(const Declaration& d, const phs::Model& model, double h, const Options& o,
      const gsl_odeiv2_step_type* type)
      : Integrator(d, model, h, keep_angles(o)),
        tangent_system_(model.instantiate<phs::Dual>()),
        tangent_turns_(model.description()),
        y_(n_),
        before_(n_),
        tangent_(n_),
        slope_(n_) {
    gsl_set_error_handler_off();  // outcomes are returned
    system_of_equations_ = {&Gsl::right_hand_side, &Gsl::jacobian, n_, this};
    driver_ = gsl_odeiv2_driver_alloc_y_new(&system_of_equations_, type, 1e-3 * h, o.atol, o.rtol);
    if (!driver_) throw InvalidArgument("GSL: making the driver failed");
    gsl_odeiv2_driver_set_nmax(driver_, 1'000'000);
  }
  ~Gsl() override { gsl_odeiv2_driver_free(driver_); }
  Gsl(const Gsl&) = delete;
  Gsl& operator=(const Gsl&) = delete;

  void tell_turns(const State& s) override {
    Integrator::tell_turns(s);
    tangent_turns_.synchronise(s, *tangent_system_);
  }

  Outcome advance(double t, double h, phs::State& s) override {
    if (s.step != next_step_ || s.x != before_) gsl_odeiv2_driver_reset_hstart(driver_, 1e-3 * h);
    next_step_ = -1;
    for (size_t i = 0; i < n_; ++i) y_[i] = s.x[i] + s.lo[i];
    finite_ = true;
    double now = t;
    const int flag = gsl_odeiv2_driver_apply(driver_, &now, t + h, y_.data());
    for (double y : y_) finite_ = finite_ && std::isfinite(y);
    if (!finite_) return Outcome::not_finite;
    if (flag != GSL_SUCCESS) return Outcome::failed;
    s.x = y_;
    std::fill(s.lo.begin(), s.lo.end(), 0.0);
    before_ = s.x;
    next_step_ = s.step + 1;
    return Outcome::ok;
  }

 private:
  static Options keep_angles(Options o) { return o.wrap = false, o; }

  static int right_hand_side(double t, const double* y, double* dy, void* self) {
    auto& me = *static_cast<Gsl*>(self);
    const std::span<double> dx(dy, me.n_);
    me.system_->field(t, {y, me.n_}, {}, dx);
    ++me.cost_.evaluations;
    for (double d : dx)
      if (!std::isfinite(d)) return me.finite_ = false, GSL_EBADFUNC;
    return GSL_SUCCESS;
  }
  /// Column by column by dual numbers; counted as an evaluation each. ∂f/∂t is taken as 0, as f is autonomous.
  static int jacobian(double t, const double* y, double* dfdy, double* dfdt, void* self) {
    auto& me = *static_cast<Gsl*>(self);
    for (size_t i = 0; i < me.n_; ++i) me.tangent_[i] = y[i], dfdt[i] = 0;
    for (size_t j = 0; j < me.n_; ++j) {
      me.tangent_[j].d = 1;
      me.tangent_system_->field(t, me.tangent_, {}, me.slope_);
      me.tangent_[j].d = 0;
      for (size_t i = 0; i < me.n_; ++i) dfdy[i * me.n_ + j] = me.slope_[i].d;
    }
    me.cost_.evaluations += std::int64_t(me.n_);
    return GSL_SUCCESS;
  }

  std::unique_ptr<phs::System<phs::Dual>> tangent_system_;
  TurnKeeper<phs::Dual> tangent_turns_;
  std::vector<double> y_, before_;
  std::vector<phs::Dual> tangent_, slope_;
  std::int64_t next_step_ = -1;
  bool finite_ = true;
  gsl_odeiv2_system system_of_equations_{};
  gsl_odeiv2_driver* driver_ = nullptr;
};

Entries gsl_entries() {
  const auto rival = [](std::string name, std::string title, const gsl_odeiv2_step_type* type) {
    return double_entry(
        {.name = std::move(name),
         .title = std::move(title),
         .family = "Rivals",
         .resumable = false,
         .rival = true,
         .source = "GNU Scientific Library 2.7, odeiv2 (GPL-3)"},
        [type](const Declaration& d, const phs::Model& m, double h, const Options& o) {
          return std::make_unique<Gsl>(d, m, h, o, type);
        });
  };
  return {
      rival("gsl_rk8pd", "GSL, explicit Runge-Kutta-Prince-Dormand (8,9)", gsl_odeiv2_step_rk8pd),
      rival("gsl_msadams", "GSL, variable-coefficient Adams", gsl_odeiv2_step_msadams),
      rival("gsl_bsimp", "GSL, implicit Bulirsch-Stoer of Bader and Deuflhard",
            gsl_odeiv2_step_bsimp)};
}

}  // namespace

void add_gsl_methods() { add_entries(gsl_entries); }

}  // namespace porthos::adapters
