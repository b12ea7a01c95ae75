#include "mechanics/mechanical_model.h"

#include "mechanics/derivatives/linearised_mechanism.h"
#include "mechanics/detail/mechanical_description.h"
#include "mechanics/hamiltonian_field.h"
#include "mechanics/momentum.h"
#include "mechanics/passes-inl.h"
#include "mechanics/resolvent.h"

namespace porthos::mechanics {
namespace {

using phs::BlockKind;

template <class T>
class MechanicalSystem : public phs::System<T>, public phs::Differentiable<T> {
  using In = std::span<const T>;
  using Out = std::span<T>;

 public:
  MechanicalSystem(const Mechanism& m, const std::vector<BodyFrame>& ports,
                   const ConstraintSet* constraints, const phs::Description& d)
      : m_(m),
        ports_(ports),
        constraints_(constraints),
        d_(d),
        w_(m),
        nq_(size_t(m.nq())),
        scratch_(size_t(m.nq())) {
    if (!ports.empty()) {
      wrench_.resize(m.nodes().size());
      force_.resize(size_t(m.nv()));
    }
  }

  const phs::Description& description() const override { return d_; }
  std::unique_ptr<phs::System<T>> clone() const override {
    auto copy = std::make_unique<MechanicalSystem>(m_, ports_, constraints_, d_);
    copy->w_.turn_angle = w_.turn_angle;
    return copy;
  }

  T hamiltonian(In x) override {
    T H = kinetic_energy(m_, w_, q(x), p(x)) + potential_energy(m_, w_, q(x));
    for (const auto& j : m_.joint_properties()) {
      const T d = deflection(j, x);
      H = H + T(0.5 * j.stiffness) * d * d;
    }
    return H;
  }

  void gradient(In x, Out e) override {
    // The conservative field is J e:  ∂H/∂p = q',  ∂H/∂q = -p'.
    hamiltonian_field(m_, w_, q(x), p(x), {}, e.subspan(nq_), Out(scratch_));
    for (size_t i = 0; i < nq_; ++i) e[i] = -scratch_[i];
    for (const auto& j : m_.joint_properties())
      e[slot(j)] = e[slot(j)] + T(j.stiffness) * deflection(j, x);
  }

  void field(T, In x, In u, Out dx) override {
    Loads<T> loads;
    if (!u.empty()) loads.tau = u.first(size_t(m_.nv()));
    if (!u.empty() && !ports_.empty()) {
      collect_wrenches(u);
      loads.wrench = wrench_;
    }
    hamiltonian_field(m_, w_, q(x), p(x), loads, dx.first(nq_), dx.subspan(nq_));
    for (const auto& j : m_.joint_properties()) {
      T& p_dot = dx[nq_ + slot(j)];
      p_dot = p_dot - T(j.stiffness) * deflection(j, x) - T(j.damping) * dx[slot(j)];
    }
  }

  void rate(T, In, In e, Out dx) override {
    apply_structure({}, e, dx);
    for (const auto& j : m_.joint_properties()) {
      T& p_dot = dx[nq_ + slot(j)];
      p_dot = p_dot - T(j.damping) * e[nq_ + slot(j)];
    }
  }
  void efforts(T, In, In dx, Out e) override {
    for (size_t i = 0; i < nq_; ++i) {
      e[i] = -dx[nq_ + i];
      e[nq_ + i] = dx[i];
    }
    for (const auto& j : m_.joint_properties())
      e[slot(j)] = e[slot(j)] - T(j.damping) * dx[slot(j)];
  }
  void stored(In x, Out values) override {
    size_t k = 0;
    values[k] = kinetic_energy(m_, w_, q(x), p(x));
    if (d_.storages[0] == base_storage) {
      const T base = base_kinetic_energy(m_, w_);
      values[k + 1] = values[k] - base;
      values[k] = base;
      ++k;
    }
    if (m_.has_gravity()) values[++k] = potential_energy(m_, w_, q(x));
    for (const auto& j : m_.joint_properties())
      if (j.stiffness != 0) {
        const T d = deflection(j, x);
        values[++k] = T(0.5 * j.stiffness) * d * d;
      }
  }
  void powers(T, In, In e, Out values) override {
    size_t k = 0;
    for (const auto& j : m_.joint_properties())
      if (j.damping != 0) values[k++] = T(j.damping) * e[nq_ + slot(j)] * e[nq_ + slot(j)];
    while (k < d_.powers.size())
      values[k++] = T(0.0);  // constraints: the method knows their forces
  }
  void apply_structure(In, In e, Out Je) override {
    for (size_t i = 0; i < nq_; ++i) {
      Je[i] = e[nq_ + i];
      Je[nq_ + i] = -e[i];
    }
  }
  void apply_dissipation(In, In e, Out Re) override {
    for (auto& r : Re) r = T(0.0);
    for (const auto& j : m_.joint_properties()) Re[nq_ + slot(j)] = T(j.damping) * e[nq_ + slot(j)];
  }
  void apply_input(In x, In u, Out Gu) override {
    for (auto& g : Gu) g = T(0.0);
    if (u.empty()) return;
    if (!ports_.empty()) u = joint_forces(x, u);
    passes::lift(m_, x.data(), u.data(), Gu.data() + nq_);
  }
  void output(In x, In e, Out y) override {
    // y = Gᵀ e; of the gradient these are the joint rates.
    passes::transposed_lift(m_, x.data(), e.data() + nq_, y.data());
    if (ports_.empty()) return;
    // The body twists of those joint rates: the transpose of joint_forces, pass by pass.
    passes::place_joints(m_, w_, x.data());
    passes::twists(m_, w_, y.data());
    T* out = y.data() + m_.nv();
    for (const auto& frame : ports_) {
      const Motion<T> V = converted<T>(frame.pose).to_child(w_.V[size_t(frame.node)]);
      for (int k = 0; k < 6; ++k) *out++ = V[k];
    }
  }

  void invariants(In x, Out values) override {
    Momentum<T> total;
    for (const auto& i : d_.invariants)
      if (i.size == 3) {
        total = momentum(m_, w_, q(x), p(x));
        if (const Node& root = m_.nodes()[0]; is_type(root, "spherical"))  // about its pivot
          total.angular -= cross(Vec3<T>(root.placement.r), total.linear);
        break;
      }
    size_t k = 0;
    for (const auto& i : d_.invariants) {
      if (i.size != 3) continue;
      const Vec3<T>& v = i.name == "linear_momentum" ? total.linear : total.angular;
      for (int c = 0; c < 3; ++c) values[k++] = v[c];
    }
    for (const auto& c : m_.coordinates()) {
      if (c.kind != BlockKind::rotation) continue;
      const auto xi = Quaternion<T>::load(x.data() + c.q),
                 pi = Quaternion<T>::load(x.data() + nq_ + c.q);
      values[k++] = xi.norm2();
      values[k++] = xi.w * pi.w + dot(xi.v, pi.v);
    }
  }

  void set_turn_angles(In angles) override {
    std::copy(angles.begin(), angles.end(), w_.turn_angle.begin());
  }
  std::unique_ptr<phs::Constraints<T>> constraints() override {
    if (!constraints_) return nullptr;
    auto rows = make_constraints<T>(m_, *constraints_);
    rows->set_turn_angles(w_.turn_angle);
    return rows;
  }
  std::unique_ptr<phs::Resolvent> resolvent() override {
    if constexpr (std::is_same_v<T, double>) return make_resolvent(m_, w_.turn_angle);
    return nullptr;
  }
  std::unique_ptr<phs::Linearised<T>> linearised() override { return own_linearised<T>(); }
  std::unique_ptr<phs::Linearised<phs::BasicDual<T>>> linearised_in_duals() override {
    return own_linearised<phs::BasicDual<T>>();
  }

 private:
  template <class S>
  std::unique_ptr<phs::Linearised<S>> own_linearised() const {
    if constexpr (phs::has_linearised<S>) return linearise<S>(m_);
    return nullptr;
  }
  In q(In x) const { return x.first(nq_); }
  In p(In x) const { return x.subspan(nq_); }
  size_t slot(const JointProperties& j) const { return size_t(j.q); }
  /// The wrenches of the body ports on each moving body, about the origin of its frame.
  void collect_wrenches(In u) {
    for (auto& f : wrench_) f = passes::zero_force<T>();
    const T* in = u.data() + m_.nv();
    for (const auto& frame : ports_) {
      Force<T> f;
      for (int k = 0; k < 6; ++k) f[k] = *in++;
      wrench_[size_t(frame.node)] += converted<T>(frame.pose).to_parent(f);
    }
  }
  /// Joint forces equivalent to all ports together: τ + Σ Jᵀ w, leaf → root.
  In joint_forces(In x, In u) {
    passes::place_joints(m_, w_, x.data());
    collect_wrenches(u);
    for (size_t i = wrench_.size(); i-- > 0;) {
      const Node& n = m_.nodes()[i];
      visit_joint(n.type, [&](auto J) {
        unroll<decltype(J)::nv>([&](auto k) {
          const size_t j = size_t(n.v + k);
          force_[j] = u[j] + decltype(J)::template project<k>(n, wrench_[i]);
        });
      });
      if (n.parent >= 0) wrench_[size_t(n.parent)] += passes::to_parent<void>(n, w_, i, wrench_[i]);
    }
    return force_;
  }
  T deflection(const JointProperties& j, In x) const {
    const T turn = j.turn >= 0 ? w_.turn_angle[size_t(j.turn)] : T(0.0);
    return (x[slot(j)] - T(j.rest)) + turn;
  }

  const Mechanism& m_;
  const std::vector<BodyFrame>& ports_;
  const ConstraintSet* constraints_;
  const phs::Description& d_;
  Workspace<T> w_;
  size_t nq_;
  std::vector<T> scratch_;
  // with body ports only:
  std::vector<Force<T>> wrench_;  ///< per moving body
  std::vector<T> force_;          ///< per freedom
};

}  // namespace

MechanicalModel::MechanicalModel(std::shared_ptr<const Mechanism> mechanism,
                                 const std::vector<BodyPort>& ports,
                                 const ConstraintSpec& constraints)
    : mechanism_(std::move(mechanism)),
      ports_(port_frames(*mechanism_, ports)),
      constraints_(constraints.empty() ? nullptr
                                       : std::make_shared<ConstraintSet>(*mechanism_, constraints)),
      description_(describe(*mechanism_, ports_, constraints_.get())) {}

template <class T>
std::unique_ptr<phs::System<T>> MechanicalModel::make_system() const {
  return std::make_unique<MechanicalSystem<T>>(*mechanism_, ports_, constraints_.get(),
                                               description_);
}

#define PORTHOS_INSTANTIATE(T) \
  template std::unique_ptr<phs::System<T>> MechanicalModel::make_system<T>() const;
PORTHOS_FOR_EACH_SCALAR(PORTHOS_INSTANTIATE)
#undef PORTHOS_INSTANTIATE

std::vector<double> MechanicalModel::state(std::span<const double> q,
                                           std::span<const double> v) const {
  require_size("q", q.size(), size_t(mechanism_->nq()));
  require_size("v", v.size(), size_t(mechanism_->nv()));
  Workspace<double> w(*mechanism_);
  std::vector<double> x(q.begin(), q.end());
  x.resize(2 * q.size());
  momenta_from_rates<double>(*mechanism_, w, q, v, std::span(x).subspan(q.size()));
  return x;
}

std::vector<double> MechanicalModel::rates(std::span<const double> x,
                                           std::span<const std::int64_t> turns) const {
  require_size("x", x.size(), size_t(2 * mechanism_->nq()));
  Workspace<double> w(*mechanism_);
  w.set_turns(turns);
  const size_t nq = size_t(mechanism_->nq());
  rates_from_momenta<double>(*mechanism_, w, x.first(nq), x.subspan(nq));
  return w.rate;
}

}  // namespace porthos::mechanics
