#include "mechanics/derivatives/linearised_mechanism.h"

#include "mechanics/derivatives/field_tangent.h"
#include "mechanics/kinematics.h"
#include "mechanics/momentum.h"
#include "mechanics/passes-inl.h"
#include "phs/scalars/derivative.h"

namespace porthos::mechanics {
namespace {

/// f = (J - R)∇H with R = diag(0, damping), so Dfᵀλ = H''(J - R)ᵀλ: the product of the undamped
/// field along w = (-λp, λq - damping λp), read as covector.
template <class T>
class LinearisedMechanism final : public phs::Linearised<T> {
  using typename phs::Linearised<T>::In;
  using typename phs::Linearised<T>::Out;
  using typename phs::Linearised<T>::Plain;

 public:
  explicit LinearisedMechanism(const Mechanism& m)
      : m_(m),
        n_(size_t(m.nq())),
        tangent_(m),
        turns_(size_t(m.angle_count()), T(0.0)),
        deflection_(m.joint_properties().size()),
        rate_(deflection_.size()),
        lambda_p_(deflection_.size()),
        w_(2 * n_) {
    for (const JointProperties& j : m.joint_properties()) {
      stiffness_.emplace_back(j.stiffness);
      damping_.emplace_back(j.damping);
      rest_.emplace_back(j.rest);
    }
    for (const BodyFrame& body : m.bodies())
      if (body.node >= 0)
        for (const char* number :
             {"mass", "moment.x", "moment.y", "moment.z", "inertia.xx", "inertia.xy", "inertia.xz",
              "inertia.yy", "inertia.yz", "inertia.zz"})
          names_.push_back(body.name + "." + number);
    for (const char* number : {"rotor_inertia", "stiffness", "damping", "rest"})
      for (const JointProperties& j : m.joint_properties())
        names_.push_back(j.joint + "." + number);
  }

  void at(const T&, In x, Out dx) override {
    tangent_.at(q(x), p(x), q(dx), p(dx));
    each_joint([&](const JointProperties& j, size_t k) {
      const size_t a = size_t(j.q);
      deflection_[k] = x[a] - rest_[k] + (j.turn >= 0 ? turns_[size_t(j.turn)] : T(0.0));
      rate_[k] = dx[a];
      dx[n_ + a] = dx[n_ + a] - stiffness_[k] * deflection_[k] - damping_[k] * rate_[k];
    });
  }
  void times(In v, Out out) override {
    tangent_.times(q(v), p(v), q(out), p(out));
    each_joint([&](const JointProperties& j, size_t k) {
      const size_t a = size_t(j.q);
      out[n_ + a] = out[n_ + a] - stiffness_[k] * v[a] - damping_[k] * out[a];
    });
  }
  void transpose_times(In lambda, Out out) override {
    for (size_t i = 0; i < n_; ++i) {
      w_[i] = -lambda[n_ + i];
      w_[n_ + i] = lambda[i];
    }
    each_joint([&](const JointProperties& j, size_t k) {
      const size_t a = size_t(j.q);
      lambda_p_[k] = lambda[n_ + a];
      w_[n_ + a] = w_[n_ + a] - damping_[k] * lambda_p_[k];
    });
    tangent_.times(q(In(w_)), p(In(w_)), p(out), q(out));
    for (T& x : q(out)) x = -x;
    each_joint([&](const JointProperties& j, size_t k) {
      const size_t a = size_t(j.q);
      out[a] = out[a] - stiffness_[k] * lambda_p_[k];
    });
  }

  const std::vector<std::string>& parameters() const override { return names_; }
  void add_gradient(const T& weight, Out gradient) override {
    const size_t inertial = FieldTangent<T>::inertial_count(m_), joints = deflection_.size();
    tangent_.add_inertial_gradient(weight, gradient.first(inertial));
    const Out own = gradient.subspan(inertial);
    each_joint([&](const JointProperties&, size_t k) {
      const T force = weight * lambda_p_[k];
      own[k] = own[k] - force * deflection_[k];
      own[joints + k] = own[joints + k] - force * rate_[k];
      own[2 * joints + k] = own[2 * joints + k] + force * stiffness_[k];
    });
  }

  void along_parameters(std::span<const double> change) override {
    if constexpr (passes::inertias_change<T>) {
      const size_t inertial = FieldTangent<T>::inertial_count(m_), joints = deflection_.size();
      each_joint([&](const JointProperties& j, size_t k) {
        const double* own = change.data() + inertial + k;
        if (own[-std::ptrdiff_t(joints)] != 0 && j.rotor_inertia == 0)
          throw InvalidArgument("a direction of second derivatives has '" + j.joint +
                                ".rotor_inertia', which is 0, expected that of a joint with a "
                                "rotor");
        stiffness_[k] = passes::with_change<T>(j.stiffness, own[0]);
        damping_[k] = passes::with_change<T>(j.damping, own[joints]);
        rest_[k] = passes::with_change<T>(j.rest, own[2 * joints]);
      });
      tangent_.along_inertias(change.first(inertial));
    }
  }

  /// The joints' own ports come first; those of one freedom are plain.
  Plain input(int i) const override {
    for (const auto& c : m_.coordinates())
      if (c.nv == 1 && c.nq == 1 && c.v == i) return {c.q, int(n_) + c.q};
    return {};
  }
  void set_turn_angles(In angles) override {
    std::copy(angles.begin(), angles.end(), turns_.begin());
    tangent_.set_turn_angles(angles);
  }

 private:
  template <class Span>
  Span q(Span x) const {
    return x.first(n_);
  }
  template <class Span>
  Span p(Span x) const {
    return x.subspan(n_);
  }
  template <class Visit>
  void each_joint(const Visit& visit) const {
    for (size_t k = 0; k < m_.joint_properties().size(); ++k) visit(m_.joint_properties()[k], k);
  }

  const Mechanism& m_;
  size_t n_;
  FieldTangent<T> tangent_;
  std::vector<T> turns_, deflection_, rate_, lambda_p_;  ///< of joints: at the point; of λ
  std::vector<T> stiffness_, damping_, rest_;            ///< of joints
  std::vector<T> w_;
  std::vector<std::string> names_;
};

}  // namespace

template <class T>
std::unique_ptr<phs::Linearised<T>> linearise(const Mechanism& m) {
  return std::make_unique<LinearisedMechanism<T>>(m);
}

StartGradient start_in_rates(const Mechanism& m, std::span<const double> q,
                             std::span<const double> v, std::span<const double> lambda) {
  using phs::Dual;
  const size_t nq = size_t(m.nq()), nv = size_t(m.nv());
  require_size("q", q.size(), nq);
  require_size("v", v.size(), nv);
  require_size("lambda", lambda.size(), 2 * nq);
  const auto lambda_p = lambda.subspan(nq);

  StartGradient g;
  Workspace<Dual> duals(m);
  std::vector<Dual> q_dual(q.begin(), q.end()), v_dual(v.begin(), v.end()), p_dual(nq);
  const auto along_p = [&] {
    momenta_from_rates<Dual>(m, duals, q_dual, v_dual, p_dual);
    double sum = 0;
    for (size_t i = 0; i < nq; ++i) sum += lambda_p[i] * p_dual[i].d;
    return sum;
  };
  phs::along_each(q_dual, [&](size_t k) { g.q.push_back(lambda[k] + along_p()); });
  phs::along_each(v_dual, [&](size_t) { g.v.push_back(along_p()); });

  // λpᵀ M_θ v is the kinetic energy's bilinear form of v and of the rates that λp pairs with: the
  // inertial gradient along momenta that cause those rates.
  Workspace<double> w(m);
  std::vector<double> p(nq), rates(nv), dp(nq), none(nq, 0.0), out(2 * nq);
  momenta_from_rates<double>(m, w, q, v, p);
  passes::transposed_lift(m, q.data(), lambda_p.data(), rates.data());
  momenta_from_rates<double>(m, w, q, rates, dp);
  const std::span<double> first(out.data(), nq), second(out.data() + nq, nq);
  FieldTangent<double> tangent(m);
  tangent.at(q, p, first, second);
  tangent.times(none, dp, first, second);
  g.parameters.assign(linearise<double>(m)->parameters().size(), 0.0);
  tangent.add_inertial_gradient(
      -1, std::span(g.parameters).first(FieldTangent<double>::inertial_count(m)));
  return g;
}

/// T is quadratic in p: its slope along p is 2T. V is linear in masses and first moments.
std::vector<double> energy_by_parameters(const Mechanism& m, std::span<const double> x,
                                         std::span<const std::int64_t> turns) {
  const size_t nq = size_t(m.nq()), inertial = FieldTangent<double>::inertial_count(m),
               joints = m.joint_properties().size();
  require_size("x", x.size(), 2 * nq);
  std::vector<double> angles, none(nq, 0.0), out(2 * nq), gradient(inertial + 3 * joints, 0.0);
  for (const auto turn : turns) angles.push_back(double(turn) * phs::two_pi_hi);
  angles.resize(size_t(m.angle_count()), 0.0);
  const std::span<double> first(out.data(), nq), second(out.data() + nq, nq);
  FieldTangent<double> tangent(m);
  tangent.set_turn_angles(angles);
  tangent.at(x.first(nq), x.subspan(nq), first, second);
  tangent.times(none, x.subspan(nq), first, second);
  tangent.add_inertial_gradient(0.5, std::span(gradient).first(inertial));

  Workspace<double> w(m);
  w.set_turns(turns);
  std::vector<Pose> poses(m.nodes().size());
  forward_kinematics<double>(m, w, x.first(nq), poses);
  size_t at = 0;
  for (const BodyFrame& body : m.bodies()) {
    if (body.node < 0) continue;
    const Pose pose = body_pose<double>(m, body, poses);
    const Vec3d weight = pose.R.tmul(m.gravity());
    gradient[at] -= dot(m.gravity(), pose.r);
    for (int k = 0; k < 3; ++k) gradient[at + 1 + size_t(k)] -= weight[k];
    at += 10;
  }
  for (size_t k = 0; k < joints; ++k) {
    const JointProperties& j = m.joint_properties()[k];
    const double deflection =
        x[size_t(j.q)] - j.rest + (j.turn >= 0 ? angles[size_t(j.turn)] : 0.0);
    gradient[inertial + k] = deflection * deflection / 2;
    gradient[inertial + 2 * joints + k] = -j.stiffness * deflection;
  }
  return gradient;
}

#define PORTHOS_INSTANTIATE(T) \
  template std::unique_ptr<phs::Linearised<T>> linearise<T>(const Mechanism&);
PORTHOS_INSTANTIATE(double)
PORTHOS_INSTANTIATE(phs::Pack4)
PORTHOS_INSTANTIATE(phs::Pack8)
PORTHOS_INSTANTIATE(phs::WideDual)
#undef PORTHOS_INSTANTIATE

}  // namespace porthos::mechanics
