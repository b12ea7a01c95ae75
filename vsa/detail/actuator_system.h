#pragma once
#include <algorithm>
#include <array>
#include <cstring>

#include "vsa/actuator.h"

/// The system of an actuator. Private to actuator.cpp.
namespace porthos::vsa {

/// Offsets of the numbers of an actuator; -1: it does not have them.
struct Layout {
  struct Axis {
    Drive::Kind kind = Drive::Kind::fixed;
    int at = -1, momentum = -1, servo = -1;  ///< in the state; servo: rate, then acceleration
    int port = -1;                           ///< in u
    double inertia = 0, per_inertia = 0, damping = 0;  ///< seen at the gear's output
    std::array<double, 3> p{};
    phs::FunctionPtr command;                   ///< of a servo
    int friction = -1, work = -1, stored = -1;  ///< in the ledger
  };
  ElasticPtr elastic;
  std::array<Axis, 2> axes;  ///< θ, σ
  phs::Description description;
};

template <class T>
class ActuatorSystem final : public phs::System<T> {
  using In = std::span<const T>;
  using Out = std::span<T>;

 public:
  explicit ActuatorSystem(const Layout& l) : l_(l) {}
  const phs::Description& description() const override { return l_.description; }
  std::unique_ptr<phs::System<T>> clone() const override {
    return std::make_unique<ActuatorSystem>(l_);
  }

  T hamiltonian(In x) override {
    T H = l_.elastic->energy(x[0], x[1], sigma(x));
    for (const auto& a : l_.axes)
      if (a.momentum >= 0) H = H + kinetic(a, x);
    return H;
  }
  // Entries are written one by one, because filling nine numbers first would cost as much as the
  // spring.
  void gradient(In x, Out e) override {
    know(x);
    e[0] = slopes_.q;
    for (size_t k = 0; k < 2; ++k) {
      const auto& a = l_.axes[k];
      if (a.at < 0) continue;
      e[size_t(a.at)] = slope(k);
      if (a.momentum >= 0) e[size_t(a.momentum)] = x[size_t(a.momentum)] * T(a.per_inertia);
      if (a.servo >= 0) e[size_t(a.servo)] = e[size_t(a.servo + 1)] = T(0.0);
    }
  }
  void field(T t, In x, In u, Out dx) override {
    know(x);
    dx[0] = T(0.0);
    for (size_t k = 0; k < 2; ++k) {
      const auto& a = l_.axes[k];
      if (a.at < 0) continue;
      if (a.momentum >= 0) {
        const T v = x[size_t(a.momentum)] * T(a.per_inertia);
        dx[size_t(a.at)] = v;
        dx[size_t(a.momentum)] = -slope(k) - T(a.damping) * v;
      } else if (a.servo >= 0) {
        serve(a, t, x, dx);
      } else {
        dx[size_t(a.at)] = T(0.0);
      }
    }
    if (!u.empty()) add_input(u, dx);
  }
  void efforts(T, In x, In, Out e) override { gradient(x, e); }  // usually known from the field
  void rate(T t, In x, In e, Out dx) override {
    apply_structure(x, e, dx);
    for (const auto& a : l_.axes) {
      if (a.momentum >= 0)
        dx[size_t(a.momentum)] = dx[size_t(a.momentum)] - T(a.damping) * e[size_t(a.momentum)];
      if (a.servo >= 0) serve(a, t, x, dx);
    }
  }
  void apply_structure(In, In e, Out Je) override {
    std::fill(Je.begin(), Je.end(), T(0.0));
    for (const auto& a : l_.axes)
      if (a.momentum >= 0) {
        Je[size_t(a.at)] = e[size_t(a.momentum)];
        Je[size_t(a.momentum)] = -e[size_t(a.at)];
      }
  }
  void apply_dissipation(In, In e, Out Re) override {
    std::fill(Re.begin(), Re.end(), T(0.0));
    for (const auto& a : l_.axes)
      if (a.momentum >= 0) Re[size_t(a.momentum)] = T(a.damping) * e[size_t(a.momentum)];
  }
  void apply_input(In, In u, Out Gu) override {
    Gu[0] = T(0.0);
    for (const auto& a : l_.axes)
      for (const int k : {a.at, a.momentum, a.servo, a.servo < 0 ? -1 : a.servo + 1})
        if (k >= 0) Gu[size_t(k)] = T(0.0);
    add_input(u, Gu);
  }
  void output(In, In e, Out y) override {
    y[0] = e[0];
    for (const auto& a : l_.axes)
      if (a.port >= 0) y[size_t(a.port)] = e[input_of(a)];
  }
  void stored(In x, Out values) override {
    values[0] = l_.elastic->energy(x[0], x[1], sigma(x));
    for (const auto& a : l_.axes)
      if (a.stored >= 0) values[size_t(a.stored)] = kinetic(a, x);
  }
  void powers(T, In x, In e, Out values) override {
    for (const auto& a : l_.axes) {
      if (a.friction >= 0) {
        const T v = e[size_t(a.momentum)];
        values[size_t(a.friction)] = T(a.damping) * v * v;
      }
      if (a.work >= 0) values[size_t(a.work)] = e[size_t(a.at)] * x[size_t(a.servo)];
    }
  }
  void invariants(In, Out) override {}

 private:
  /// Computes the slopes at x, unless x is bit for bit the last one.
  void know(In x) {
    const bool sigma_too = l_.axes[1].at >= 0;
    if (known_ && (sigma_too ? same<3>(x) : same<2>(x))) return;
    slopes_ = l_.elastic->slopes(x[0], x[1], sigma(x));
    at_[0] = x[0];
    at_[1] = x[1];
    known_ = true;
    if (sigma_too) at_[2] = x[2];
  }
  const T& slope(size_t axis) const { return axis == 0 ? slopes_.theta : slopes_.sigma; }
  static void serve(const Layout::Axis& a, T t, In x, Out dx) {
    const T z = x[size_t(a.at)], v = x[size_t(a.servo)], w = x[size_t(a.servo + 1)];
    dx[size_t(a.at)] = v;
    dx[size_t(a.servo)] = w;
    const T wish = a.command ? (*a.command)(t) : T(0.0);
    dx[size_t(a.servo + 1)] = T(a.p[0]) * (wish - z) - T(a.p[1]) * v - T(a.p[2]) * w;
  }
  template <size_t n>
  bool same(In x) const {
    return std::memcmp(at_.data(), x.data(), n * sizeof(T)) == 0;
  }
  T sigma(In x) const { return l_.axes[1].at >= 0 ? x[2] : T(0.0); }
  static T kinetic(const Layout::Axis& a, In x) {
    const T p = x[size_t(a.momentum)];
    return T(0.5 * a.per_inertia) * p * p;
  }
  static size_t input_of(const Layout::Axis& a) {
    return size_t(a.momentum >= 0 ? a.momentum : a.at);
  }
  void add_input(In u, Out dx) const {
    dx[0] = dx[0] + u[0];
    for (const auto& a : l_.axes)
      if (a.port >= 0) dx[input_of(a)] = dx[input_of(a)] + u[size_t(a.port)];
  }
  const Layout& l_;
  std::array<T, 3> at_{};  ///< the point of slopes_
  Slopes<T> slopes_{};
  bool known_ = false;
};

}  // namespace porthos::vsa
