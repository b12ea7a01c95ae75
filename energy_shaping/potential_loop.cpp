#include "energy_shaping/potential_loop.h"

#include <fmt/format.h>

#include <cmath>
#include <random>

#include "energy_shaping/derivatives.h"
#include "mechanics/crba.h"
#include "mechanics/kinematics.h"
#include "mechanics/rnea.h"
#include "phs/dense.h"
#include "phs/linear_algebra.h"
#include "phs/random_state.h"

namespace porthos::energy_shaping {
namespace {

using mechanics::Mat3, mechanics::Vec3;
using Parts = PotentialLoop::Parts;

template <class T>
class ShapedSystem final : public LoopSystem<T> {
  using In = std::span<const T>;
  using Out = std::span<T>;

 public:
  explicit ShapedSystem(const PotentialLoop& loop)
      : loop_(loop),
        p_(loop.parts()),
        m_(loop.mechanical().mechanism()),
        w_(m_),
        plant_(loop.mechanical().template instantiate<T>()),
        nq_(size_t(m_.nq())),
        nv_(size_t(m_.nv())),
        nu_(size_t(loop.mechanical().description().nu)),
        poses_(m_.nodes().size()),
        J_(6 * nv_),
        e_(2 * nq_),
        still_(2 * nq_),
        lift_(2 * nq_),
        tau_(nv_),
        y_(nu_),
        u_(nu_) {
    if (p_.zero_momentum) {
      M_.resize(nv_ * nv_);
      A_.resize(6 * nv_);
      Tb_.resize(7 * 6);
      q_dot_.resize(nq_);
    }
  }
  const phs::Description& description() const override { return loop_.description(); }
  std::unique_ptr<phs::System<T>> clone() const override {
    return std::make_unique<ShapedSystem>(loop_);
  }

  T hamiltonian(In x) override { return plant_->hamiltonian(x) + shaped(x); }
  void stored(In x, Out values) override {
    const T total = hamiltonian(x);
    halt(x);
    const T potential = plant_->hamiltonian(still_) + shaped(x);
    values[0] = total - potential;
    values[1] = potential;
  }
  void gradient(In x, Out e) override {
    plant_->gradient(x, e);
    forces(x);
    plant_->apply_input(x, u_, lift_);  // -∂U/∂q, lifted for quaternions
    for (size_t i = 0; i < nq_; ++i) e[i] = e[i] - lift_[nq_ + i];
    if (!p_.compensate) return;
    halt(x);
    plant_->gradient(still_, lift_);
    for (size_t i = 0; i < nq_; ++i) e[i] = e[i] - lift_[i];
  }
  void field(T t, In x, In u, Out dx) override {
    gradient(x, e_);
    rate(t, x, e_, dx);
    if (u.empty()) return;
    plant_->apply_input(x, u, lift_);
    for (size_t i = 0; i < 2 * nq_; ++i) dx[i] = dx[i] + lift_[i];
  }
  void rate(T, In x, In e, Out dx) override {
    apply_structure(x, e, dx);
    damp(x, e);
    for (size_t i = 0; i < nq_; ++i) dx[nq_ + i] = dx[nq_ + i] - lift_[nq_ + i];
  }
  void apply_structure(In x, In e, Out Je) override {
    plant_->apply_structure(x, e, Je);
    if (!p_.zero_momentum) return;
    follow(x);
    const size_t bq = p_.base_q, bv = p_.base_v;
    // q_b' = T A v_j, p_b' = 0, and the transpose in the joints' rows.
    for (size_t i = 0; i < 7; ++i) {
      T s(0.0);
      for (size_t a = 0; a < 6; ++a) s = s + Tb_[i * 6 + a] * base_rate(e, a);
      Je[bq + i] = s;
      Je[nq_ + bq + i] = T(0.0);
    }
    for (size_t a = 0; a < 6; ++a) {
      T g(0.0);
      for (size_t i = 0; i < 7; ++i) g = g + Tb_[i * 6 + a] * e[bq + i];
      for (const auto& c : m_.coordinates())
        if (size_t(c.v) < bv || size_t(c.v) >= bv + 6)
          Je[nq_ + size_t(c.q)] = Je[nq_ + size_t(c.q)] - A_[a * nv_ + size_t(c.v)] * g;
    }
  }
  void apply_dissipation(In x, In e, Out Re) override {
    damp(x, e);
    for (size_t i = 0; i < nq_; ++i) {
      Re[i] = T(0.0);
      Re[nq_ + i] = lift_[nq_ + i];
    }
  }
  void apply_input(In x, In u, Out Gu) override { plant_->apply_input(x, u, Gu); }
  void output(In x, In e, Out y) override { plant_->output(x, e, y); }
  void powers(T, In x, In e, Out values) override {
    damp(x, e);
    T sum(0.0);
    for (size_t i = 0; i < nq_; ++i) sum = sum + e[nq_ + i] * lift_[nq_ + i];
    values[0] = sum;
  }
  void invariants(In x, Out values) override { plant_->invariants(x, values); }

  void law(T, In x, Out u) override {
    forces(x);
    if (p_.zero_momentum) {
      follow(x);
      for (size_t j = 0; j < nv_; ++j)
        for (size_t a = 0; a < 6; ++a)
          if (j < p_.base_v || j >= p_.base_v + 6)
            tau_[j] = tau_[j] + A_[a * nv_ + j] * tau_[p_.base_v + a];
    }
    if (p_.compensate) {
      mechanics::rnea<T>(m_, w_, x.first(nq_), {}, {}, {}, Out(y_).first(nv_));
      for (const auto& j : m_.joint_properties())
        y_[size_t(j.v)] = y_[size_t(j.v)] + T(j.stiffness) * (x[size_t(j.q)] - T(j.rest));
      for (size_t j = 0; j < nv_; ++j) tau_[j] = tau_[j] + y_[j];
    }
    plant_->gradient(x, e_);
    plant_->output(x, e_, y_);
    for (auto& v : u) v = T(0.0);
    for (size_t j = 0; j < nv_; ++j)
      if (p_.actuated[j]) u[j] = tau_[j] - T(p_.damping[j]) * y_[j];
  }

  /// What the loop asks of each freedom, by springs and compensation, per unit of v; for the check.
  In wanted(In x) {
    forces(x);
    if (p_.compensate) {
      mechanics::rnea<T>(m_, w_, x.first(nq_), {}, {}, {}, Out(y_).first(nv_));
      for (size_t j = 0; j < nv_; ++j) tau_[j] = tau_[j] + y_[j];
    }
    return tau_;
  }

 private:
  void halt(In x) {
    for (size_t i = 0; i < nq_; ++i) {
      still_[i] = x[i];
      still_[nq_ + i] = T(0.0);
    }
  }
  mechanics::Transform<T> pose_of(const Parts::Pose& p) const {
    return mechanics::body_pose<T>(m_, p.frame, poses_);
  }
  /// U(q), and -V where it is compensated.
  T shaped(In x) {
    T U(0.0);
    for (const auto& s : p_.joints) {
      const T d = x[s.q] - T(s.rest);
      const T half = phs::sin(T(0.5) * d);
      U = U + (s.periodic ? T(2 * s.stiffness) * half * half : T(0.5 * s.stiffness) * d * d);
    }
    for (const auto& c : m_.coordinates())
      if (c.nq == 1) U = U - T(p_.constant[size_t(c.v)]) * x[size_t(c.q)];
    if (!p_.poses.empty())
      mechanics::forward_kinematics<T>(m_, w_, x.first(nq_), std::span(poses_));
    for (const auto& p : p_.poses) {
      const auto X = pose_of(p);
      const Vec3<T> d = X.r - Vec3<T>(p.spring.position);
      U = U + T(0.5 * p.spring.stiffness) * dot(d, d);
      // tr(A (1 - R_dᵀR)) = Σ a_i (1 - d_i·r_i) = ½ Σ a_i |d_i - r_i|², columns d_i and r_i: no
      // cancellation near R_d
      const Mat3<T> D(p.spring.attitude);
      for (int i = 0; i < 3; ++i) {
        const Vec3<T> off = column(D, i) - column(X.R, i);
        U = U + T(0.5 * p.spring.attitude_stiffness[i]) * dot(off, off);
      }
    }
    if (!p_.compensate) return U;
    halt(x);
    return U - plant_->hamiltonian(still_);
  }
  static Vec3<T> column(const Mat3<T>& m, int i) { return i == 0 ? m.x : i == 1 ? m.y : m.z; }

  /// -∂U/∂q (without the compensation) per unit of v in tau_ and, as inputs of the joints' ports,
  /// in u_.
  void forces(In x) {
    for (size_t j = 0; j < nv_; ++j) tau_[j] = T(p_.constant[j]);
    for (const auto& s : p_.joints) {
      const T d = x[s.q] - T(s.rest);
      tau_[s.v] = tau_[s.v] - T(s.stiffness) * (s.periodic ? phs::sin(d) : d);
    }
    if (!p_.poses.empty())
      mechanics::forward_kinematics<T>(m_, w_, x.first(nq_), std::span(poses_));
    for (const auto& p : p_.poses) {
      const auto X = pose_of(p);
      const Vec3<T> f = X.R.tmul(T(-p.spring.stiffness) * (X.r - Vec3<T>(p.spring.position)));
      // moment = Σ a_i r_i × d_i, in the body's axes
      const Mat3<T> D(p.spring.attitude);
      Vec3<T> n{T(0.0), T(0.0), T(0.0)};
      for (int i = 0; i < 3; ++i)
        n += T(p.spring.attitude_stiffness[i]) * cross(column(X.R, i), column(D, i));
      n = X.R.tmul(n);
      mechanics::jacobian<T>(m_, w_, x.first(nq_), p.frame, mechanics::JacobianAxes::body,
                             std::span(J_));
      for (size_t j = 0; j < nv_; ++j)
        for (int k = 0; k < 3; ++k)
          tau_[j] = tau_[j] + J_[6 * j + size_t(k)] * n[k] + J_[6 * j + 3 + size_t(k)] * f[k];
    }
    for (size_t j = 0; j < nu_; ++j) u_[j] = j < nv_ ? tau_[j] : T(0.0);
  }
  /// G Kd Gᵀ e and the plant's own R e, in lift_.
  void damp(In x, In e) {
    plant_->output(x, e, y_);
    for (size_t j = 0; j < nu_; ++j) u_[j] = j < nv_ ? T(p_.damping[j]) * y_[j] : T(0.0);
    plant_->apply_input(x, u_, lift_);
    plant_->apply_dissipation(x, e, still_);
    for (size_t i = 0; i < nq_; ++i) lift_[nq_ + i] = lift_[nq_ + i] + still_[nq_ + i];
  }
  /// A = -M_bb⁻¹M_bj and T, the base's coordinate rates per unit of its twist.
  void follow(In x) {
    mechanics::crba<T>(m_, w_, x.first(nq_), std::span(M_));
    const size_t b = p_.base_v;
    T Mbb[36], L[36], column[6];
    for (size_t i = 0; i < 6; ++i)
      for (size_t j = 0; j < 6; ++j) Mbb[i * 6 + j] = M_[(b + i) + nv_ * (b + j)];
    phs::dense::cholesky(size_t(6), Mbb, L);
    for (size_t j = 0; j < nv_; ++j) {
      for (size_t i = 0; i < 6; ++i) column[i] = -M_[(b + i) + nv_ * j];
      phs::dense::solve(size_t(6), L, column, column);
      for (size_t i = 0; i < 6; ++i) A_[i * nv_ + j] = column[i];
    }
    for (size_t a = 0; a < 6; ++a) {
      for (T& v : tau_scratch()) v = T(0.0);
      tau_scratch()[b + a] = T(1.0);
      mechanics::coordinate_rates<T>(m_, x.first(nq_), In(tau_scratch()), Out(q_dot_));
      for (size_t i = 0; i < 7; ++i) Tb_[i * 6 + a] = q_dot_[p_.base_q + i];
    }
  }
  std::vector<T>& tau_scratch() { return J_; }  // 6 nv numbers, free between poses
  /// Component a of A v_j at the efforts e.
  T base_rate(In e, size_t a) const {
    T s(0.0);
    for (const auto& c : m_.coordinates())
      if (size_t(c.v) < p_.base_v || size_t(c.v) >= p_.base_v + 6)
        s = s + A_[a * nv_ + size_t(c.v)] * e[nq_ + size_t(c.q)];
    return s;
  }

  const PotentialLoop& loop_;
  const Parts& p_;
  const mechanics::Mechanism& m_;
  mechanics::Workspace<T> w_;
  std::unique_ptr<phs::System<T>> plant_;
  size_t nq_, nv_, nu_;
  std::vector<mechanics::Transform<T>> poses_;
  std::vector<T> J_, e_, still_, lift_, tau_, y_, u_, M_, A_, Tb_, q_dot_;
};

[[noreturn]] void refuse_shaping(const std::string& name, const std::string& why) {
  throw InvalidArgument("potential shaping '" + name + "': " + why);
}

const mechanics::JointCoordinates& single(const mechanics::Mechanism& m, int v,
                                          const std::string& name, const std::string& port) {
  for (const auto& c : m.coordinates())
    if (c.v == v && c.nq == 1) return c;
  refuse_shaping(name, "port '" + port + "' is no joint of one freedom");
}

Parts look_up(const mechanics::MechanicalModel& model, const PotentialShaping& s) {
  const auto& m = model.mechanism();
  const auto& d = model.description();
  Parts p;
  p.damping.assign(size_t(m.nv()), 0.0);
  p.constant = p.damping;
  p.actuated.assign(size_t(m.nv()), s.actuators.empty());
  const auto joint_offsets = [&](const std::string& port) {
    const auto at = port_offsets(d, {port});
    if (at.front() >= m.nv())
      refuse_shaping(s.name, "port '" + port + "' is a body port; name a joint's");
    return at;
  };
  for (const auto& name : s.actuators)
    for (const int a : joint_offsets(name)) p.actuated[size_t(a)] = true;
  for (const auto& j : s.joints) {
    const int v = joint_offsets(j.port).front();
    const auto& c = single(m, v, s.name, j.port);
    if (!(j.stiffness >= 0) || !std::isfinite(j.rest))
      refuse_shaping(s.name, fmt::format("spring at '{}' has stiffness {} and rest {}", j.port,
                                         j.stiffness, j.rest));
    p.joints.push_back({size_t(c.q), size_t(v), j.stiffness, j.rest, j.periodic});
  }
  for (const auto& pose : s.poses) {
    const auto& body = m.body(pose.link);
    if (body.node < 0) refuse_shaping(s.name, "link '" + pose.link + "' is fixed to the world");
    const auto& a = pose.attitude_stiffness;
    if (!(pose.stiffness >= 0 && a.x >= 0 && a.y >= 0 && a.z >= 0))
      refuse_shaping(s.name, "a spring at '" + pose.link + "' has negative stiffness");
    p.poses.push_back(
        {{body.name, body.node, body.pose * mechanics::Pose{Mat3<double>::identity(), pose.point}},
         pose});
  }
  for (const auto& damp : s.damping) {
    const auto at = joint_offsets(damp.port);
    if (damp.damping.size() != 1 && damp.damping.size() != at.size())
      refuse_shaping(s.name, fmt::format("damping of '{}' has {} numbers, expected 1 or {}",
                                         damp.port, damp.damping.size(), at.size()));
    for (size_t k = 0; k < at.size(); ++k) {
      const double value = damp.damping[damp.damping.size() == 1 ? 0 : k];
      if (!(value >= 0))
        refuse_shaping(s.name, fmt::format("damping of '{}' is {}", damp.port, value));
      if (value > 0 && !p.actuated[size_t(at[k])])
        refuse_shaping(s.name, "damping at '" + damp.port + "', which has no actuator");
      p.damping[size_t(at[k])] += value;
    }
  }
  if (s.compensate && s.constant_compensation)
    refuse_shaping(s.name, "compensate and constant_compensation exclude each other");
  p.compensate = s.compensate && [&] {
    bool springs = m.has_gravity();
    for (const auto& j : m.joint_properties()) springs = springs || j.stiffness != 0;
    return springs;
  }();
  if (!s.zero_momentum) return p;
  p.zero_momentum = true;
  int roots = 0;
  for (const auto& n : m.nodes()) roots += n.parent < 0;
  const auto& root = m.nodes().front();
  int base = 0;
  for (const auto& c : m.coordinates()) {
    if (c.node == 0)
      base += c.nv;
    else if (c.nq != 1)
      refuse_shaping(s.name, "zero_momentum needs joints of one freedom, not '" + c.name + "'");
  }
  if (roots != 1 || base != 6 || m.has_gravity())
    refuse_shaping(s.name, "zero_momentum needs one free base and no gravity");
  p.base_q = size_t(root.q);
  p.base_v = size_t(root.v);
  for (size_t a = 0; a < 6; ++a) p.actuated[p.base_v + a] = false;
  return p;
}

phs::Description describe(const mechanics::MechanicalModel& model, const PotentialShaping& s,
                          const Parts& p) {
  phs::Description d = model.description();
  d.name = s.name + " of " + d.name;
  for (auto& b : d.blocks)
    if (b.kind == phs::BlockKind::angle) b.kind = phs::BlockKind::linear;  // springs count turns
  d.flows.clear();
  d.traits.lossless = d.traits.separable = false;
  if (p.zero_momentum) d.traits.canonical = false;
  d.storages = {"kinetic", "shaped potential"};
  d.powers = {{"damping", phs::PowerKind::dissipated}};
  // Momenta and quaternions' norms stay; what the shaping breaks goes.
  std::vector<phs::Invariant> kept;
  const bool external = [&] {
    for (size_t a = 0; a < p.actuated.size(); ++a)
      for (const auto& c : model.mechanism().coordinates())
        if (p.actuated[a] && c.node >= 0 && model.mechanism().nodes()[size_t(c.node)].parent < 0 &&
            int(a) >= c.v && int(a) < c.v + c.nv)
          return true;
    return !p.poses.empty() && !p.zero_momentum;
  }();
  bool momenta_first = true;
  for (const auto& i : d.invariants) {
    const bool momentum = i.size == 3;
    if (momentum && external)
      momenta_first = false;
    else
      kept.push_back(i);
  }
  // Offsets in `values` are the plant's: either all invariants stay or, momenta gone, none is
  // declared.
  d.invariants = momenta_first && !p.zero_momentum ? kept : std::vector<phs::Invariant>{};
  return d;
}

std::vector<double> rest_state(const mechanics::MechanicalModel& m, const PotentialShaping& s) {
  require_size("rest", s.rest.size(), size_t(m.mechanism().nq()));
  auto x = s.rest;
  x.resize(2 * x.size(), 0.0);
  return x;
}

}  // namespace

PotentialLoop::PotentialLoop(std::shared_ptr<const mechanics::MechanicalModel> plant,
                             PotentialShaping shaping)
    : ClosedLoopFor(plant, rest_state(*plant, shaping)), mechanical_(std::move(plant)) {
  parts_ = look_up(*mechanical_, shaping);
  description_ = describe(*mechanical_, shaping, parts_);
  for (size_t j = 0; j < parts_.actuated.size(); ++j)
    if (parts_.actuated[j]) actuated_.push_back(int(j));
  if (shaping.constant_compensation) {
    mechanics::Workspace<double> w(mechanical_->mechanism());
    mechanics::rnea<double>(mechanical_->mechanism(), w, shaping.rest, {}, {}, {}, parts_.constant);
  }
  certificate_ = Certificate("potential shaping '" + description_.name + "'");
  check(shaping);
  refuse_failure(certificate_);
}

void PotentialLoop::check(const PotentialShaping& shaping) {
  ShapedSystem<double> s(*this);
  const auto& m = mechanical_->mechanism();
  const size_t nq = size_t(m.nq());
  std::mt19937_64 generator(1);
  double worst = 0, scale = 1e-300;
  std::vector<double> at;
  for (int i = 0; i < 500 && !parts_.zero_momentum; ++i) {
    auto x = phs::random_state(description_, 1.0, generator);
    std::fill(x.begin() + long(nq), x.end(), 0.0);
    const auto tau = s.wanted(x);
    for (size_t j = 0; j < tau.size(); ++j) {
      scale = std::max(scale, std::fabs(tau[j]));
      if (parts_.actuated[j] || std::fabs(tau[j]) <= worst) continue;
      worst = std::fabs(tau[j]);
      at.assign(x.begin(), x.begin() + long(nq));
    }
  }
  if (!parts_.zero_momentum)
    certificate_.at_most("force without actuator", worst / scale, shaping.tolerance,
                         "potential matching, relative, 500 random coordinates", at);
  std::vector<double> e(2 * nq);
  s.gradient(rest_, e);
  double slope = 0, stiffness = 1e-300;
  for (size_t i = 0; i < nq; ++i) slope = std::max(slope, std::fabs(e[i]));
  const auto H = hessian(*this, rest_);
  std::vector<double> K(nq * nq);
  for (size_t i = 0; i < nq; ++i)
    for (size_t j = 0; j < nq; ++j) K[i * nq + j] = H[i * 2 * nq + j];
  const auto curvature = phs::symmetric_eigenvalues(nq, K);
  stiffness = std::max(stiffness, std::fabs(curvature.back()));
  certificate_.at_most("rest point", slope / stiffness, shaping.tolerance,
                       "gradient of H_d over its greatest curvature");
  certificate_.at_least("Hessian of V_d >= 0", curvature.front() / stiffness, -shaping.tolerance,
                        "least eigenvalue at the rest point, relative");
  int free = 0;
  for (const double k : curvature) free += std::fabs(k) <= 1e-9 * stiffness;
  certificate_.report("directions without stiffness", free,
                      "of the coordinates; a floating base and quaternions have some");
  certificate_.report("curvature of V_d", curvature.back(), "eigenvalues of the Hessian",
                      curvature);
}

template <class T>
std::unique_ptr<LoopSystem<T>> PotentialLoop::make_loop() const {
  return std::make_unique<ShapedSystem<T>>(*this);
}
#define PORTHOS_INSTANTIATE(T) \
  template std::unique_ptr<LoopSystem<T>> PotentialLoop::make_loop<T>() const;
PORTHOS_FOR_EACH_SCALAR(PORTHOS_INSTANTIATE)
#undef PORTHOS_INSTANTIATE

}  // namespace porthos::energy_shaping
