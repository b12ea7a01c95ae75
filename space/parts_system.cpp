// The system of a mechanism with parts: their effects on the motion and on the ledger.
#include <algorithm>

#include "mechanics/kinematics.h"
#include "mechanics/rotation.h"
#include "phs/system/forwarding.h"
#include "space/detail/parts_algebra-inl.h"
#include "space/detail/parts_checks.h"
#include "space/gravity_gradient.h"

namespace porthos::space {
namespace {

using mechanics::Force;
using mechanics::Mechanism;
using mechanics::Motion;
using mechanics::Transform;

template <class T>
class PartsSystem final : public phs::Forwarding<T> {
  using In = std::span<const T>;
  using Out = std::span<T>;

 public:
  explicit PartsSystem(const PartsModel& model, const PartsModel::Placed& placed)
      : phs::Forwarding<T>(model.mechanical().template instantiate<T>(), model.description()),
        model_(model),
        parts_(model.parts()),
        placed_(placed),
        inner_(this->inner()),
        m_(model.mechanical().mechanism()),
        w_(m_),
        pose_(m_.nodes().size()),
        nq_(size_t(m_.nq())),
        u_(size_t(model.description().nu)),
        y_(u_.size()),
        e_(2 * nq_, T(0.0)),
        Gu_(2 * nq_),
        damped_(std::any_of(parts_.latches.begin(), parts_.latches.end(), damped)) {}

  std::unique_ptr<phs::System<T>> clone() const override {
    return this->alike(std::make_unique<PartsSystem>(model_, placed_));
  }

  T hamiltonian(In x) override {
    T H = inner_.hamiltonian(x);
    if (parts_.latches.empty()) return H;
    place(x);
    for (size_t k = 0; k < parts_.latches.size(); ++k) H = H + elastic_energy(k);
    return H;
  }
  void gradient(In x, Out e) override {
    inner_.gradient(x, e);
    if (parts_.latches.empty()) return;
    place(x);
    clear_inputs();
    add_elastic();
    inner_.apply_input(x, u_, Gu_);
    for (size_t i = 0; i < nq_; ++i) e[i] = e[i] - Gu_[nq_ + i];
  }
  void field(T t, In x, In u, Out dx) override {
    inner_.field(t, x, u, dx);
    std::copy_n(dx.begin(), nq_, e_.begin() + long(nq_));
    place(x);
    clear_inputs();
    add_elastic();
    add_losses(x, e_);
    add_sources(t, x);
    add_to(x, dx);
  }
  void rate(T t, In x, In e, Out dx) override {
    inner_.rate(t, x, e, dx);
    place(x);
    clear_inputs();
    add_losses(x, e);
    add_sources(t, x);
    add_to(x, dx);
  }
  void efforts(T t, In x, In dx, Out e) override {
    std::copy_n(dx.begin(), nq_, e_.begin() + long(nq_));
    place(x);
    clear_inputs();
    add_losses(x, e_);
    add_sources(t, x);
    inner_.apply_input(x, u_, Gu_);
    for (size_t i = 0; i < 2 * nq_; ++i) Gu_[i] = dx[i] - Gu_[i];
    inner_.efforts(t, x, Gu_, e);
  }
  void apply_dissipation(In x, In e, Out Re) override {
    inner_.apply_dissipation(x, e, Re);
    if (!damped_) return;
    place(x);
    clear_inputs();
    add_losses(x, e);
    inner_.apply_input(x, u_, Gu_);
    for (size_t i = nq_; i < 2 * nq_; ++i) Re[i] = Re[i] - Gu_[i];
  }

  void stored(In x, Out values) override {
    phs::Forwarding<T>::stored(x, values);
    if (parts_.latches.empty()) return;
    place(x);
    size_t k = this->inner_storages();
    for (size_t l = 0; l < parts_.latches.size(); ++l) values[k++] = elastic_energy(l);
  }
  void powers(T t, In x, In e, Out values) override {
    phs::Forwarding<T>::powers(t, x, e, values);
    place(x);
    inner_.output(x, e, y_);
    size_t k = this->inner_powers();
    for (size_t l = 0; l < parts_.latches.size(); ++l)
      if (damped(parts_.latches[l])) values[k++] = loss(l);
    size_t i = k + parts_.pushes();  // impulses come after the works
    for (size_t n = 0; n < parts_.forces(); ++n) {
      const auto& at = placed_.pushed[n];
      const Force<T> given = load(n, t);
      const T* twist = &y_[at.u];
      values[k++] = dot(given.n, Vec3<T>{twist[0], twist[1], twist[2]}) +
                    dot(given.f, Vec3<T>{twist[3], twist[4], twist[5]});
      const auto X = world(at);
      const Vec3<T> F = X.R * given.f, L = cross(X.r, F) + X.R * given.n;
      for (const T& value : {F.x, F.y, F.z, L.x, L.y, L.z}) values[i++] = value;
    }
    for (size_t n = 0; n < parts_.torquers.size(); ++n) {
      const Mat3<T> R = base(x);
      const Vec3<T> torque = torquer_torque(n, t, x, R);
      const size_t at = placed_.base_u;
      values[k++] = dot(torque, Vec3<T>{y_[at], y_[at + 1], y_[at + 2]});
      const Vec3<T> L = R * torque;
      for (const T& value : {L.x, L.y, L.z}) values[i++] = value;
    }
  }
  void set_turn_angles(In angles) override {
    phs::Forwarding<T>::set_turn_angles(angles);
    std::copy_n(angles.begin(), w_.turn_angle.size(), w_.turn_angle.begin());
  }
  std::unique_ptr<phs::Resolvent> resolvent() override {
    if (!parts_.latches.empty()) return nullptr;  // latches may be stiffer than the mechanism
    return parts_.pushes() > 0 ? this->near_resolvent() : inner_.resolvent();
  }

 private:
  void place(In x) { mechanics::forward_kinematics<T>(m_, w_, x.first(nq_), pose_); }
  void clear_inputs() { std::fill(u_.begin(), u_.end(), T(0.0)); }
  void add_to(In x, Out dx) {
    inner_.apply_input(x, u_, Gu_);
    for (size_t i = nq_; i < 2 * nq_; ++i) dx[i] = dx[i] + Gu_[i];
  }
  /// Pose of a port in the world.
  Transform<T> world(const PartsModel::Mount& at) const {
    const Transform<T> port{Mat3<T>(at.port.R), Vec3<T>(at.port.r)};
    return at.node < 0 ? port : pose_[size_t(at.node)] * port;
  }
  /// Adds a wrench given in world axes about the port's origin.
  void push(const PartsModel::Mount& at, const Transform<T>& X, const Vec3<T>& moment,
            const Vec3<T>& force) {
    if (at.node < 0) return;
    const Vec3<T> n = X.R.tmul(moment), f = X.R.tmul(force);
    for (int c = 0; c < 3; ++c) {
      u_[at.u + size_t(c)] = u_[at.u + size_t(c)] + n[c];
      u_[at.u + 3 + size_t(c)] = u_[at.u + 3 + size_t(c)] + f[c];
    }
  }

  // --- soft latches -----------------------------------------------------------------------------
  struct Ends {
    Transform<T> X_WA, X_WB;  ///< the ports in the world: A on the link, B on the body
    Mat3<T> R_WA, R_WB;       ///< axes of the latch there
    Vec3<T> p_AB_W;           ///< from A to B, in the world's axes
  };
  Ends ends(size_t k) const {
    const auto &a = placed_.a[k], &b = placed_.b[k];
    Ends e{world(a), world(b), {}, {}, {}};
    e.R_WA = e.X_WA.R * Mat3<T>(a.axes);
    e.R_WB = e.X_WB.R * Mat3<T>(b.axes);
    e.p_AB_W = e.X_WB.r - e.X_WA.r;
    return e;
  }
  static double tip_stiffness(const SoftLatch& l, int i) {
    const Vec3d& Q = l.turning_stiffness;
    return 0.5 * (Q.x + Q.y + Q.z) - Q[i];
  }
  T elastic_energy(size_t k) const {
    const SoftLatch& l = parts_.latches[k];
    const Ends e = ends(k);
    T U = T(0.5) * dot(e.p_AB_W, along_both(e.R_WA, e.R_WB, l.stiffness, e.p_AB_W));
    if (l.line.stiffness > 0) {
      const T longer = length_of(e.p_AB_W) - T(l.line.rest);
      U = U + T(0.5 * l.line.stiffness) * (longer * longer);
    }
    for (int i = 0; i < 3; ++i) {
      const Vec3<T> apart = column_of(e.R_WA, i) - column_of(e.R_WB, i);
      U = U + T(0.5 * tip_stiffness(l, i)) * dot(apart, apart);
    }
    return U;
  }
  /// |d|², not 0 where the ends of a spring meet: nothing is divided by 0 there, and elsewhere the
  /// addition changes no bit.
  static T square_of(const Vec3<T>& d) { return dot(d, d) + T(1e-280); }
  static T length_of(const Vec3<T>& d) {
    using phs::sqrt;
    return sqrt(square_of(d));
  }
  /// The force of a line spring on B; without a rest length it is smooth where A and B meet.
  static Vec3<T> tension(const SoftLatch::Line& l, const Vec3<T>& d) {
    if (l.stiffness == 0) return zero<T>();
    if (l.rest == 0) return T(-l.stiffness) * d;
    const T length = length_of(d);
    return (T(l.stiffness) * (T(l.rest) - length) / length) * d;
  }
  void add_elastic() {
    for (size_t k = 0; k < parts_.latches.size(); ++k) {
      const SoftLatch& l = parts_.latches[k];
      const Ends e = ends(k);
      const Vec3<T> f_A = e.R_WA * scaled(l.stiffness, e.R_WA.tmul(e.p_AB_W)),
                    f_B = e.R_WB * scaled(l.stiffness, e.R_WB.tmul(e.p_AB_W));
      const Vec3<T> f = T(-0.5) * (f_A + f_B);  // on B
      Vec3<T> turn = zero<T>();                 // on B
      for (int i = 0; i < 3; ++i)
        turn += T(tip_stiffness(l, i)) * cross(column_of(e.R_WB, i), column_of(e.R_WA, i));
      const Vec3<T> half_d = T(0.5) * e.p_AB_W;
      const Vec3<T> pull = f + tension(l.line, e.p_AB_W);
      push(placed_.b[k], e.X_WB, turn + cross(half_d, f_B), pull);
      push(placed_.a[k], e.X_WA, cross(half_d, f_A) - turn, -pull);
    }
  }
  /// Twist of B relative to A at the midpoint, in world axes, from the ports' twists in y_.
  Motion<T> relative(size_t k, const Ends& e) const {
    const auto twist = [&](const PartsModel::Mount& at, const Transform<T>& X) {
      if (at.node < 0) return Motion<T>{zero<T>(), zero<T>()};
      const T* y = y_.data() + at.u;
      return Motion<T>{X.R * Vec3<T>{y[0], y[1], y[2]}, X.R * Vec3<T>{y[3], y[4], y[5]}};
    };
    const Motion<T> a = twist(placed_.a[k], e.X_WA), b = twist(placed_.b[k], e.X_WB);
    const Vec3<T> half_d = T(0.5) * e.p_AB_W;
    return {b.w - a.w, (b.v - cross(b.w, half_d)) - (a.v + cross(a.w, half_d))};
  }
  Force<T> damper(size_t k, const Ends& e, const Motion<T>& v) const {
    const SoftLatch& l = parts_.latches[k];
    Force<T> r{along_both(e.R_WA, e.R_WB, l.turning_damping, v.w),
               along_both(e.R_WA, e.R_WB, l.damping, v.v)};
    const Vec3<T>& d = e.p_AB_W;
    if (l.line.damping > 0) r.f += (T(l.line.damping) * dot(v.v, d) / square_of(d)) * d;
    return r;
  }
  T loss(size_t k) const {
    const Ends e = ends(k);
    const Motion<T> v = relative(k, e);
    return dot(v, damper(k, e, v));
  }
  void add_losses(In x, In e) {
    if (!damped_) return;
    inner_.output(x, e, y_);
    for (size_t k = 0; k < parts_.latches.size(); ++k) {
      const Ends at = ends(k);
      const Force<T> r = damper(k, at, relative(k, at));
      const Vec3<T> half_d = T(0.5) * at.p_AB_W;
      push(placed_.b[k], at.X_WB, cross(half_d, r.f) - r.n, -r.f);
      push(placed_.a[k], at.X_WA, cross(half_d, r.f) + r.n, r.f);
    }
  }

  // --- sources -----------------------------------------------------------------------------------
  /// Of thruster or wrench n at its port, link's axes.
  Force<T> load(size_t n, const T& t) const {
    if (n < parts_.thrusters.size()) {
      const Thruster& th = parts_.thrusters[n];
      const T on = lane_by_lane(t, [&](double at) { return th.thrust * th.schedule.at(at); });
      return {zero<T>(), on * Vec3<T>(th.direction)};
    }
    const Wrench& w = parts_.wrenches[n - parts_.thrusters.size()];
    const Force<T> given{at_time(w.moment, t), at_time(w.force, t)};
    if (!w.in_world) return given;
    const Mat3<T> R_WL = world(placed_.pushed[n]).R;
    return {R_WL.tmul(given.n), R_WL.tmul(given.f)};
  }
  static Mat3<T> base(In x) {
    return mechanics::rotation_matrix(mechanics::Quaternion<T>::load(x.data() + base_attitude));
  }
  Vec3<T> torquer_torque(size_t n, const T& t, In x, const Mat3<T>& R) const {
    return torque_of(parts_.torquers[n], placed_.wheels[n], t, x, nq_,
                     R.tmul(Vec3<T>(parts_.field)));
  }
  void add_sources(const T& t, In x) {
    for (size_t n = 0; n < parts_.forces(); ++n) {
      const Force<T> given = load(n, t);
      const size_t at = placed_.pushed[n].u;
      for (size_t c = 0; c < 3; ++c) {
        u_[at + c] = u_[at + c] + given.n[int(c)];
        u_[at + 3 + c] = u_[at + 3 + c] + given.f[int(c)];
      }
    }
    if (parts_.torquers.empty()) return;
    const Mat3<T> R = base(x);
    for (size_t n = 0; n < parts_.torquers.size(); ++n) {
      const Vec3<T> torque = torquer_torque(n, t, x, R);
      for (int c = 0; c < 3; ++c) {
        T& u = u_[placed_.base_u + size_t(c)];
        u = u + torque[c];
      }
    }
  }

  const PartsModel& model_;
  const Parts& parts_;
  const PartsModel::Placed& placed_;
  phs::System<T>& inner_;
  const Mechanism& m_;
  mechanics::Workspace<T> w_;
  std::vector<Transform<T>> pose_;
  size_t nq_;
  std::vector<T> u_, y_, e_, Gu_;
  bool damped_;
};

}  // namespace

template <class T>
std::unique_ptr<phs::System<T>> PartsModel::make_system() const {
  return std::make_unique<PartsSystem<T>>(*this, placed_);
}

#define PORTHOS_INSTANTIATE(T) \
  template std::unique_ptr<phs::System<T>> PartsModel::make_system<T>() const;
PORTHOS_FOR_EACH_SCALAR(PORTHOS_INSTANTIATE)
#undef PORTHOS_INSTANTIATE

}  // namespace porthos::space
