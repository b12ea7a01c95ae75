#include "adapters/gsl/gsl.h"

#include <gsl/gsl_errno.h>
#include <gsl/gsl_odeiv2.h>

#include <mutex>

#include "integrators/catalogue.h"
#include "integrators/rivals/index_one.h"
#include "integrators/rivals/rival.h"

namespace porthos::adapters {
namespace {

using namespace integrators;

void keep_gsl_from_aborting() {
  static std::mutex mutex;  // the handler is global to the program
  const std::lock_guard lock(mutex);
  if (auto* own = gsl_set_error_handler_off()) gsl_set_error_handler(own);
}

/// A stepper of gsl_odeiv2 under its standard control.
class Gsl : public Rival {
 public:
  Gsl(const Declaration& d, const phs::Model& model, double h, const Options& o,
      const gsl_odeiv2_step_type* type)
      : Rival(d, model, h, o), equations_{right_hand_side, jacobian_by_rows, n_, this} {
    keep_gsl_from_aborting();
    if (type == gsl_odeiv2_step_bsimp) {
      columns_.resize(n_ * n_);
      if (!use_duals(model))
        throw InvalidArgument("method '" + d.name + "' needs the Jacobian of the field, '" +
                              model.description().name + "' cannot be evaluated in duals");
    }
    driver_.reset(gsl_odeiv2_driver_alloc_y_new(&equations_, type, first_step(h), o.atol, o.rtol));
    if (!driver_) throw InvalidArgument("method '" + d.name + "': GSL refuses its options");
    // of inner steps in one step; one of bsimp costs hundreds of evaluations
    gsl_odeiv2_driver_set_nmax(driver_.get(), type == gsl_odeiv2_step_bsimp ? 20'000 : 1'000'000);
  }

 private:
  /// GSL chooses none: its control shortens this one as it must.
  static double first_step(double h) { return 1e-3 * h; }

  bool start(double t, double h) override {
    t_ = t;
    return gsl_odeiv2_driver_reset_hstart(driver_.get(), first_step(h)) == GSL_SUCCESS;
  }
  bool go_to(double end) override {
    const int status = gsl_odeiv2_driver_apply(driver_.get(), &t_, end, y_.data());
    if (status != GSL_SUCCESS) remark_ = std::string("GSL: ") + gsl_strerror(status);
    return status == GSL_SUCCESS;
  }

  /// GSL_EDOM: GSL tries a shorter inner step.
  int answer(bool ok) const { return ok ? GSL_SUCCESS : hopeless() ? GSL_EBADFUNC : GSL_EDOM; }
  static int right_hand_side(double t, const double* y, double* dy, void* self) {
    auto& me = *static_cast<Gsl*>(self);
    return me.answer(me.field(t, y, dy));
  }
  static int jacobian_by_rows(double t, const double* y, double* J, double* dfdt, void* self) {
    auto& me = *static_cast<Gsl*>(self);
    const bool ok = me.jacobian(t, y, me.columns_.data()) && me.time_derivative(t, y, dfdt);
    for (size_t i = 0; i < me.n_; ++i)
      for (size_t j = 0; j < me.n_; ++j) J[i * me.n_ + j] = me.columns_[i + me.n_ * j];
    return me.answer(ok);
  }

  struct Free {
    void operator()(gsl_odeiv2_driver* d) const { gsl_odeiv2_driver_free(d); }
  };
  gsl_odeiv2_system equations_;
  std::vector<double> columns_;  ///< of the Jacobian
  double t_ = 0;
  std::unique_ptr<gsl_odeiv2_driver, Free> driver_;
};

Entries gsl_entries() {
  const char* gsl = "GNU Scientific Library 2.7, odeiv2 (GPL-3)";
  const auto rival = [=](const char* name, const char* title, const gsl_odeiv2_step_type* type) {
    return rival_entry<Gsl>(name, title, gsl, type);
  };
  return {
      rival("gsl_rk8pd", "GSL, explicit Runge-Kutta-Prince-Dormand (8,9)", gsl_odeiv2_step_rk8pd),
      rival("gsl_msadams", "GSL, variable-coefficient Adams", gsl_odeiv2_step_msadams),
      rival("gsl_bsimp", "GSL, implicit Bulirsch-Stoer of Bader and Deuflhard",
            gsl_odeiv2_step_bsimp),
      constrained_rival_entry<OnIndexOne<Gsl>>(
          true, "index1_gsl_rk8pd",
          "GSL, explicit Runge-Kutta-Prince-Dormand (8,9), multipliers eliminated", gsl,
          gsl_odeiv2_step_rk8pd)};
}

}  // namespace

void add_gsl_methods() { add_entries(gsl_entries); }

}  // namespace porthos::adapters
