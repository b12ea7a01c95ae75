#pragma once
#include <nvector/nvector_serial.h>
#include <sundials/sundials_linearsolver.h>
#include <sundials/sundials_nonlinearsolver.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>

#include <cmath>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>
#include <type_traits>

#include "integrators/rivals/rival.h"

/// The common part of the SUNDIALS solvers. Private to sundials.cpp.
namespace porthos::integrators {

struct SundialsFree {
  void operator()(SUNContext c) const { SUNContext_Free(&c); }
  void operator()(N_Vector v) const { N_VDestroy(v); }
  void operator()(SUNMatrix m) const { SUNMatDestroy(m); }
  void operator()(SUNLinearSolver s) const { SUNLinSolFree(s); }
  void operator()(SUNNonlinearSolver s) const { SUNNonlinSolFree(s); }
};
template <class Handle>
using Owned = std::unique_ptr<std::remove_pointer_t<Handle>, SundialsFree>;

/// `free` is CVodeFree, ARKStepFree or IDAFree.
template <void (*free)(void**)>
struct FreeSolver {
  void operator()(void* solver) const { free(&solver); }
};
/// Declare it last in its class: it is then freed before the objects it uses.
template <void (*free)(void**)>
using OwnedSolver = std::unique_ptr<void, FreeSolver<free>>;

inline Owned<SUNContext> make_context() {
  SUNContext c = nullptr;
  SUNContext_Create(nullptr, &c);
  return Owned<SUNContext>(c);
}

inline constexpr long most_inner_steps = 1'000'000;  // in one step

/// The common part of the solvers: context, state vector, dense matrix, callbacks, counters.
class Sundials : public Rival {
 protected:
  Sundials(const Declaration& d, const phs::Model& model, double h, const Options& o)
      : Rival(d, model, h, o),
        context_(make_context()),
        vector_(N_VMake_Serial(sunindextype(n_), y_.data(), context())) {
    require(context_ && vector_ ? 0 : -1, "allocation");
  }

  /// Set-up can fail only by lack of memory or an error in this code.
  void require(int flag, const char* what) const {
    if (flag < 0)
      throw std::runtime_error("method '" + declaration_.name + "': SUNDIALS' " + what + " failed");
  }

  /// The solver's counters since its last start: Newton or fixed-point iterations, factorisations.
  struct Counts {
    long iterations = 0, factorisations = 0;
  };
  virtual bool restart(double t) = 0;
  virtual bool integrate(double end) = 0;
  /// With smaller inner steps the clock stands still while the state moves, and SUNDIALS would
  /// follow a singularity to overflow.
  static double least_inner_step(double end) {
    return std::numeric_limits<double>::epsilon() * std::fabs(end);
  }
  virtual Counts counts() const = 0;

  SUNContext context() const { return context_.get(); }
  /// A view of y_.
  N_Vector vector() const { return vector_.get(); }
  /// For the implicit methods: a matrix with its LU solver, and the exact Jacobian if the system
  /// supports duals. Returns false if it does not; SUNDIALS then uses differences.
  bool use_newton(const phs::Model& model) {
    const auto n = sunindextype(n_);
    matrix_.reset(SUNDenseMatrix(n, n, context()));
    linear_.reset(SUNLinSol_Dense(vector(), matrix_.get(), context()));
    require(matrix_ && linear_ ? 0 : -1, "allocation");
    return use_duals(model);
  }

  /// User data of every callback.
  void* self() { return static_cast<Sundials*>(this); }
  /// The return value of callbacks; 1: try a shorter inner step.
  int answer(bool ok) const { return ok ? 0 : hopeless() ? -1 : 1; }
  static int right_hand_side(double t, N_Vector y, N_Vector dy, void* self) {
    auto& me = *static_cast<Sundials*>(self);
    const bool ok = me.field(t, N_VGetArrayPointer(y), N_VGetArrayPointer(dy));
    if (!ok) me.refused_at_ = t;
    return me.answer(ok);
  }
  static int dense_jacobian(double t, N_Vector y, N_Vector, SUNMatrix J, void* self, N_Vector,
                            N_Vector, N_Vector) {
    auto& me = *static_cast<Sundials*>(self);
    return me.answer(me.jacobian(t, N_VGetArrayPointer(y), SUNDenseMatrix_Data(J)));
  }
  /// Stores what SUNDIALS would print to stderr.
  static void listen(int code, const char* module, const char*, char* text, void* self) {
    if (code < 0) static_cast<Sundials*>(self)->remark_ = std::string(module) + ": " + text;
  }

 private:
  bool start(double t, double) final {
    counted_ = {};
    return restart(t);
  }
  bool go_to(double end) final {
    const bool ok = integrate(end);
    const Counts now = counts();
    cost_.sweeps += now.iterations - counted_.iterations;
    cost_.factorisations += now.factorisations - counted_.factorisations;
    counted_ = now;
    return ok;
  }

  Owned<SUNContext> context_;  // first: freed after everything made in it
  Owned<N_Vector> vector_;

 protected:
  Owned<SUNMatrix> matrix_;
  Owned<SUNLinearSolver> linear_;
  double refused_at_ = 0;  ///< time of the last evaluation that was not finite

 private:
  Counts counted_;
};

}  // namespace porthos::integrators
