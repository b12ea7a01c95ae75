#pragma once
#include <cmath>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "energy_shaping/loop/certificate.h"
#include "phs/system/system.h"

/// A controller here is an object that gives the closed loop as a port-Hamiltonian system, with the
/// shaped energy H_d and a certificate.
namespace porthos::energy_shaping {

/// A closed loop evaluated in T; hamiltonian() is H_d.
template <class T>
class LoopSystem : public phs::System<T> {
 public:
  /// The law: u, as many numbers as the *plant* has inputs, 0 where there is no actuator.
  virtual void law(T t, std::span<const T> x, std::span<T> u) = 0;
  /// The gains this object works with, in the order of ClosedLoop::gains; each lane may have its
  /// own. Empty: fixed.
  virtual std::span<T> gains() { return {}; }
};

/// Immutable, shared by threads. The state is that of the plant, or the plant's followed by the
/// controller's.
///
/// The field of this model is the *target* dynamics (J_d - R_d) ∂H_d/∂x. The constructor has
/// verified that the plant under the law moves in the same way; run the plant itself with `law` to
/// see it (run.h).
class ClosedLoop : public phs::Model {
 public:
  ClosedLoop(std::shared_ptr<const phs::Model> plant, std::vector<double> rest)
      : plant_(std::move(plant)), rest_(std::move(rest)) {
    phs::refuse_constraints(plant_->description(), "energy shaping");
  }

  const phs::Model& plant() const { return *plant_; }
  const std::shared_ptr<const phs::Model>& shared_plant() const { return plant_; }
  /// x*: the desired rest state of the loop.
  const std::vector<double>& rest() const { return rest_; }
  const Certificate& certificate() const { return certificate_; }
  /// Offsets in the plant's u that the law writes.
  const std::vector<int>& actuated() const { return actuated_; }
  virtual std::vector<std::string> gain_names() const { return {}; }
  /// Why the law is not meant for a state of the plant, and behind ": " what to do; empty: it is.
  virtual std::string hindrance(std::span<const double> x) const {
    (void)x;
    return {};
  }

  template <class T>
  std::unique_ptr<LoopSystem<T>> loop() const {
    auto s = instantiate<T>();  // every `make` below makes a LoopSystem
    return std::unique_ptr<LoopSystem<T>>(static_cast<LoopSystem<T>*>(s.release()));
  }

 protected:
  std::shared_ptr<const phs::Model> plant_;
  std::vector<double> rest_;
  std::vector<int> actuated_;
  Certificate certificate_;
};

/// Fills the `make` overloads from Derived::make_loop<T>().
template <class Derived>
class ClosedLoopFor : public ClosedLoop {
 public:
  using ClosedLoop::ClosedLoop;

 protected:
#define PORTHOS_MAKE(T)                                             \
  void make(std::unique_ptr<phs::System<T>>& s) const override {    \
    std::unique_ptr<LoopSystem<T>> loop =                           \
        static_cast<const Derived*>(this)->template make_loop<T>(); \
    s = std::move(loop);                                            \
  }
  PORTHOS_FOR_EACH_SCALAR(PORTHOS_MAKE)
#undef PORTHOS_MAKE
};

/// The box of coordinates and rates in which conditions are checked.
struct Region {
  std::vector<double> lower, upper;  ///< of each coordinate
  double rate = 1;                   ///< |q'_i| up to this
  int samples = 2000;
  unsigned seed = 1;
};

/// Offsets in u of the ports of these names; each port must have one number. @throws
/// InvalidArgument listing the known ones
std::vector<int> port_offsets(const phs::Description& plant, const std::vector<std::string>& ports);

/// The names of the coordinates of a plant in the order of its state: "elbow", of a quaternion
/// "base.attitude[0]", of a plant whose blocks leave some out "q[0]".
std::vector<std::string> coordinate_names(const phs::Description& plant);

/// The largest of the forces wanted where no actuator is.
struct UnheldForce {
  static constexpr const char* condition = "force without actuator";
  double size = 0;
  std::string joint = {};
  /// True: it is the largest so far.
  bool take(double force, const std::string& at) {
    if (std::fabs(force) <= size) return false;
    size = std::fabs(force);
    joint = at;
    return true;
  }
  /// A condition of a certificate: that it is at most `bound` of `scale`. `what`: the text of the
  /// item; `remedy`: what to do at the joint, told where it fails.
  void certify(Certificate& certificate, double scale, double bound, const std::string& what,
               const std::string& remedy, std::vector<double> at) const {
    const double part = size / scale;
    certificate.at_most(condition, part, bound, what, std::move(at));
    if (!(part <= bound))
      certificate.help("joint '" + joint + "' needs a force no actuator provides: " + remedy);
  }
};

/// Throws InvalidArgument for the first failing item of a certificate, if any.
void refuse_failure(const Certificate& certificate);

}  // namespace porthos::energy_shaping
