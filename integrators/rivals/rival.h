#pragma once
#include <algorithm>
#include <cmath>
#include <exception>

#include "integrators/core/entry.h"

namespace porthos::integrators {

/// Common part of the methods of other libraries. They work to Options::rtol and atol. A "step" of
/// length h is as many inner steps as the library chooses, stopped exactly at its end; h may be
/// negative. Their histories do not support wrapping or low words: angles are not wrapped, and low
/// words become zero.
///
/// If a trial inside a step is infinite or NaN, the library tries a shorter inner step and the run
/// continues. Cost::evaluations counts every evaluation of the field, and each Dual column of a
/// Jacobian as one.
class Rival : public Integrator {
 public:
  /// Continues with the library's own history if the state is the last one; otherwise restarts from
  /// it.
  Outcome advance(double t, double h, phs::State& s) final;
  void tell_turns(const phs::State& s) override;
  /// The library's own message about the last step, if any.
  std::string remark() const override { return remark_; }
  bool sees_inside() const override { return true; }

 protected:
  /// @throws InvalidArgument for tolerances that no method in double can meet
  Rival(const Declaration& d, const phs::Model& model, double h, const Options& o);

  /// Restarts from y_ at time t, towards t + h. False: the library refused.
  virtual bool start(double t, double h) = 0;
  /// Whether the library's history can be continued from y_. Asked only if y_ is where it left.
  virtual bool goes_on() { return true; }
  /// Integrates to exactly `end` and leaves the state in y_. False: the library gave up.
  virtual bool go_to(double end) = 0;

  /// dy = f(t, y), for callbacks from C. An exception does not pass through; advance() throws it
  /// again. False: there was an exception, or dy is not finite. The library may then try a shorter
  /// inner step unless that is hopeless().
  bool field(double t, const double* y, double* dy) noexcept;
  /// There was an exception, or so many evaluations were not finite that the library is approaching
  /// a singularity.
  bool hopeless() const { return error_ || not_finite_ > most_not_finite; }
  /// The last evaluation was not finite, but another try is not hopeless.
  bool stopped_by_field() const { return !last_finite_ && !hopeless(); }

  /// Prepares jacobian() and time_derivative(). False if the system does not support duals.
  bool use_duals(const phs::Model& model);
  /// J(i, j) = ∂f_i/∂y_j at J[i + n j], one Dual evaluation per column. False as in field().
  bool jacobian(double t, const double* y, double* J) noexcept;
  /// dfdt = ∂f/∂t; for an autonomous system zero, without an evaluation. False as in field().
  bool time_derivative(double t, const double* y, double* dfdt) noexcept;

  /// Calls evaluate(), which fills `result`: for callbacks from C. False as in field().
  template <class Evaluate>
  bool guarded(Evaluate evaluate, const double* result, size_t size) noexcept {
    if (hopeless()) return false;
    try {
      evaluate();
    } catch (...) {
      error_ = std::current_exception();
      return false;
    }
    last_finite_ = std::all_of(result, result + size, [](double v) { return std::isfinite(v); });
    not_finite_ += !last_finite_;
    return last_finite_;
  }
  /// Moves a time of an evaluation into the step: see inside.h.
  double inside(double t) const { return std::clamp(t, from_, to_); }

  std::vector<double> y_;
  std::string remark_;

 private:
  static constexpr int most_not_finite = 100;  ///< in one step

  bool continues(double t, double h, const phs::State& s) const;
  void dual_field(phs::Dual t);

  bool running_ = false;  ///< the library's history ends in left_
  phs::State left_;
  double left_at_ = 0;  ///< time of left_ on the library's clock
  bool backwards_ = false;
  double from_ = 0, to_ = 0;  ///< ends of the step, moved inside by a hair
  int not_finite_ = 0;        ///< evaluations of this step that were infinite or NaN
  bool last_finite_ = true;   ///< the last evaluation of this step was finite
  std::exception_ptr error_;  ///< thrown by an evaluation of this step

  std::unique_ptr<phs::System<phs::Dual>> dual_system_;
  TurnKeeper<phs::Dual> dual_turns_;
  std::vector<phs::Dual> dual_x_, dual_f_;
};

/// The catalogue entry of a rival, from its class; `extra` goes to the constructor. It claims no
/// structure. Its accuracy depends on the tolerance, not on h. Its history is not part of a
/// checkpoint.
template <class Method, class... Extra>
Entry rival_entry(std::string name, std::string title, std::string source, Extra... extra) {
  return double_entry({.name = std::move(name),
                       .title = std::move(title),
                       .family = "Reference solvers",
                       .resumable = false,
                       .rival = true,
                       .source = std::move(source)},
                      [=](const Declaration& d, const phs::Model& m, double h, const Options& o) {
                        return std::make_unique<Method>(d, m, h, o, extra...);
                      });
}

/// The same for constrained systems, and only for them. It may leave the manifold.
/// @param rolling  whether it takes rows that restrict rates alone
template <class Method, class... Extra>
Entry constrained_rival_entry(bool rolling, std::string name, std::string title, std::string source,
                              Extra... extra) {
  Entry e = rival_entry<Method>(std::move(name), std::move(title), std::move(source), extra...);
  e.declaration.constraints = true;
  e.declaration.rolling = rolling;
  return e;
}

}  // namespace porthos::integrators
