#include "energy_shaping/null_space.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "energy_shaping/derivatives.h"
#include "energy_shaping/gate.h"
#include "mechanics/crba.h"
#include "mechanics/kinematics.h"
#include "phs/dense.h"
#include "phs/linear_algebra.h"
#include "phs/random_state.h"

namespace porthos::energy_shaping {
namespace {

constexpr double margin = 0.1;  // of the tank, at either bound, where the gates move

/// J, M and what projects, at one q.
template <class T>
class Projector {
 public:
  explicit Projector(const NullSpaceLoop& loop)
      : loop_(loop),
        m_(loop.task().mechanical().mechanism()),
        w_(m_),
        n_(size_t(m_.nv())),
        r_(loop.rows().size()),
        all_(6 * n_),
        J_(r_ * n_),
        M_(n_ * n_),
        L_(n_ * n_),
        S_(r_ * r_),
        LS_(r_ * r_),
        column_(n_),
        a_(r_) {}

  void place(std::span<const T> q) {
    const auto& frame = loop_.task().parts().poses[0].frame;
    mechanics::jacobian<T>(m_, w_, q, frame, mechanics::JacobianAxes::body, std::span<T>(all_));
    for (size_t i = 0; i < r_; ++i)
      for (size_t j = 0; j < n_; ++j) J_[i * n_ + j] = all_[6 * j + size_t(loop_.rows()[i])];
    mechanics::crba<T>(m_, w_, q, std::span<T>(M_));
    phs::dense::cholesky(n_, M_.data(), L_.data());
    for (size_t i = 0; i < r_; ++i) {  // J M⁻¹Jᵀ, column by column
      phs::dense::solve(n_, L_.data(), J_.data() + i * n_, column_.data());
      for (size_t k = 0; k < r_; ++k)
        S_[k * r_ + i] = phs::dense::dot(n_, J_.data() + k * n_, column_.data());
    }
    phs::dense::cholesky(r_, S_.data(), LS_.data());
  }
  /// a = J M⁻¹τ
  const std::vector<T>& acceleration(const T* tau) {
    phs::dense::solve(n_, L_.data(), tau, column_.data());
    phs::dense::multiply(r_, n_, J_.data(), column_.data(), a_.data());
    return a_;
  }
  /// w = Jᵀ J̄ᵀ τ, the part of τ that the task feels.
  void felt(const T* tau, T* w) {
    (void)acceleration(tau);
    phs::dense::solve(r_, LS_.data(), a_.data(), a_.data());
    phs::dense::multiply_transposed(r_, n_, J_.data(), a_.data(), w);
  }
  const std::vector<T>& jacobian() const { return J_; }

 private:
  const NullSpaceLoop& loop_;
  const mechanics::Mechanism& m_;
  mechanics::Workspace<T> w_;
  size_t n_, r_;
  std::vector<T> all_, J_, M_, L_, S_, LS_, column_, a_;
};

template <class T>
class NullSpaceSystem final : public LoopSystem<T> {
  using In = std::span<const T>;
  using Out = std::span<T>;

 public:
  explicit NullSpaceSystem(const NullSpaceLoop& loop)
      : loop_(loop),
        p_(loop.posture()),
        task_(loop.task().loop<T>()),
        projector_(loop),
        n_(p_.rest.size()),
        e_(2 * n_ + 1),
        y_(2 * n_),
        c_(n_),
        pull_(n_),
        felt_(n_) {}
  const phs::Description& description() const override { return loop_.description(); }
  std::unique_ptr<phs::System<T>> clone() const override {
    return std::make_unique<NullSpaceSystem>(loop_);
  }

  T hamiltonian(In x) override { return task_->hamiltonian(plant(x)) + spring(x) + x[2 * n_]; }
  void stored(In x, Out values) override {
    task_->stored(plant(x), values);
    values[2] = spring(x);
    values[3] = x[2 * n_];
  }
  void gradient(In x, Out e) override {
    task_->gradient(plant(x), e.first(2 * n_));
    pull(x);
    for (size_t i = 0; i < n_; ++i) e[i] = e[i] + pull_[i];
    e[2 * n_] = T(1.0);
  }
  void field(T t, In x, In u, Out dx) override {
    gradient(x, e_);
    rate(t, x, e_, dx);
    if (u.empty()) return;
    task_->apply_input(plant(x), u, y_);
    for (size_t i = 0; i < 2 * n_; ++i) dx[i] = dx[i] + y_[i];
  }
  void rate(T t, In x, In e, Out dx) override {
    task_->rate(t, plant(x), e.first(2 * n_), dx.first(2 * n_));
    couple(x);
    exchange(e, dx);
    for (size_t i = 0; i < n_; ++i)  // the tank's share of the damping is in c, not lost
      dx[n_ + i] = dx[n_ + i] + T(p_.fill * damping(i)) * e[n_ + i];
    dx[2 * n_] = dx[2 * n_] - valve_ * e[2 * n_];
  }
  void apply_structure(In x, In e, Out Je) override {
    task_->apply_structure(plant(x), e.first(2 * n_), Je.first(2 * n_));
    couple(x);
    exchange(e, Je);
  }
  void apply_dissipation(In x, In e, Out Re) override {
    task_->apply_dissipation(plant(x), e.first(2 * n_), Re.first(2 * n_));
    couple(x);
    for (size_t i = 0; i < n_; ++i) Re[n_ + i] = Re[n_ + i] - T(p_.fill * damping(i)) * e[n_ + i];
    Re[2 * n_] = valve_ * e[2 * n_];
  }
  void apply_input(In x, In u, Out Gu) override {
    task_->apply_input(plant(x), u, Gu.first(2 * n_));
    Gu[2 * n_] = T(0.0);
  }
  void output(In x, In e, Out y) override { task_->output(plant(x), e.first(2 * n_), y); }
  void powers(T t, In x, In e, Out values) override {
    task_->powers(t, plant(x), e.first(2 * n_), values);
    couple(x);
    for (size_t i = 0; i < n_; ++i)
      values[0] = values[0] - T(p_.fill * damping(i)) * e[n_ + i] * e[n_ + i];
    values[1] = valve_ * e[2 * n_] * e[2 * n_];
  }
  void invariants(In, Out) override {}

  void law(T t, In x, Out u) override {
    task_->law(t, plant(x), u);
    couple(x);
    for (size_t i = 0; i < n_; ++i) u[i] = u[i] - pull_[i] + alpha_ * felt_[i];
  }

 private:
  In plant(In x) const { return x.first(2 * n_); }
  double damping(size_t i) const { return loop_.task().parts().damping[i]; }
  T spring(In x) const {
    T U(0.0);
    for (size_t i = 0; i < n_; ++i) {
      const T d = x[i] - T(p_.rest[i]);
      U = U + T(0.5 * p_.stiffness[i]) * d * d;
    }
    return U;
  }
  void pull(In x) {
    for (size_t i = 0; i < n_; ++i) pull_[i] = T(p_.stiffness[i]) * (x[i] - T(p_.rest[i]));
  }
  /// c, the valve and α at x.
  void couple(In x) {
    pull(x);
    projector_.place(x.first(n_));
    projector_.felt(pull_.data(), felt_.data());
    const T E = x[2 * n_];
    const double width = margin * (p_.most - p_.least);
    alpha_ = gate(E, p_.least, p_.least + width);
    task_->gradient(plant(x), Out(y_));
    T inflow(0.0);
    for (size_t i = 0; i < n_; ++i) {
      const T rate = y_[n_ + i];
      c_[i] = alpha_ * felt_[i] - T(p_.fill * damping(i)) * rate;
      inflow = inflow - c_[i] * rate;
    }
    valve_ = gate(E, p_.most - width, p_.most) * phs::max(inflow, T(0.0));
  }
  void exchange(In e, Out dx) {
    T given(0.0);
    for (size_t i = 0; i < n_; ++i) {
      dx[n_ + i] = dx[n_ + i] + c_[i] * e[2 * n_];
      given = given + c_[i] * e[n_ + i];
    }
    dx[2 * n_] = -given;
  }

  const NullSpaceLoop& loop_;
  const NullSpacePosture& p_;
  std::unique_ptr<LoopSystem<T>> task_;
  Projector<T> projector_;
  size_t n_;
  std::vector<T> e_, y_, c_, pull_, felt_;
  T alpha_{}, valve_{};
};

[[noreturn]] void refuse_posture(const std::string& name, const std::string& why) {
  throw InvalidArgument("null-space posture of '" + name + "': " + why);
}

/// Coordinates with the task met and the posture's energy least, from q on: Newton's steps with a
/// multiplier per task row.
std::vector<double> settle(const NullSpaceLoop& loop, std::vector<double> q) {
  const auto& m = loop.task().mechanical().mechanism();
  const auto& pose = loop.task().parts().poses[0];
  const size_t n = q.size(), r = loop.rows().size(), N = n + r;
  Projector<double> projector(loop);
  mechanics::Workspace<double> w(m);
  std::vector<mechanics::Transform<double>> poses(m.nodes().size());
  std::vector<double> A(N * N), b(N);
  for (int round = 0; round < 2000; ++round) {  // far postures: each round a tenth of the way
    projector.place(q);
    mechanics::forward_kinematics<double>(m, w, q, poses);
    const auto X = mechanics::body_pose<double>(m, pose.frame, poses);
    const auto off = X.R.tmul(X.r - pose.spring.position);
    // small rotation from R_d to R, in the body's axes: ½ Σ d_i × r_i
    const auto& D = pose.spring.attitude;
    const auto at = [](const mechanics::Mat3<double>& R, int i) {
      return i == 0 ? R.x : i == 1 ? R.y : R.z;
    };
    mechanics::Vec3d turn{0, 0, 0};
    for (int i = 0; i < 3; ++i) turn += 0.5 * cross(at(D, i), at(X.R, i));
    turn = X.R.tmul(turn);
    std::fill(A.begin(), A.end(), 0.0);
    for (size_t i = 0; i < n; ++i) {
      A[i * N + i] = loop.posture().stiffness[i];
      b[i] = -loop.posture().stiffness[i] * (q[i] - loop.posture().rest[i]);
    }
    for (size_t k = 0; k < r; ++k) {
      const int row = loop.rows()[k];
      b[n + k] = -(row < 3 ? turn[row] : off[row - 3]);
      for (size_t i = 0; i < n; ++i)
        A[i * N + n + k] = A[(n + k) * N + i] = projector.jacobian()[k * n + i];
    }
    const auto step = phs::linear_solve(N, A, b);
    double most = 0;
    for (size_t i = 0; i < n; ++i) most = std::max(most, std::fabs(step[i]));
    const double part = std::min(1.0, 0.3 / most);
    for (size_t i = 0; i < n; ++i) q[i] += part * step[i];
    if (most < 1e-14) break;
  }
  return q;
}

PotentialShaping settled(PotentialShaping s, const std::vector<double>& rest) {
  s.rest = rest;
  return s;
}

}  // namespace

NullSpaceLoop::NullSpaceLoop(std::shared_ptr<const mechanics::MechanicalModel> plant,
                             PotentialShaping task, NullSpacePosture posture)
    : ClosedLoopFor(plant, {}), posture_(std::move(posture)) {
  const auto& m = plant->mechanism();
  const std::string& name = task.name;
  const size_t n = size_t(m.nv());
  for (const auto& c : m.coordinates())
    if (c.nq != 1)
      refuse_posture(name, "joint '" + c.name + "' has several freedoms, expected one");
  if (task.poses.size() != 1 || !task.joints.empty() || task.zero_momentum)
    refuse_posture(
        name, fmt::format("the task has {} poses and {} joint springs, expected one pose alone",
                          task.poses.size(), task.joints.size()));
  auto& p = posture_;
  if (p.stiffness.size() == 1) p.stiffness.assign(n, p.stiffness[0]);
  require_size("posture stiffness", p.stiffness.size(), n);
  require_size("posture rest", p.rest.size(), n);
  for (const double k : p.stiffness)
    if (!(k > 0)) refuse_posture(name, fmt::format("a stiffness is {}, expected > 0", k));
  if (!(p.least >= 0 && p.least < p.most && p.level >= p.least && p.level <= p.most))
    refuse_posture(name, fmt::format("the tank needs 0 <= least <= level <= most, has {}, {}, {}",
                                     p.least, p.level, p.most));
  if (!(p.fill >= 0 && p.fill <= 1))
    refuse_posture(name, fmt::format("fill is {}, expected a share in [0, 1]", p.fill));
  const auto& spring = task.poses[0];
  for (int i = 0; i < 3; ++i)
    if (spring.attitude_stiffness[0] + spring.attitude_stiffness[1] + spring.attitude_stiffness[2] >
        0)
      rows_.push_back(i);
  for (int i = 0; i < 3 && spring.stiffness > 0; ++i) rows_.push_back(3 + i);
  if (rows_.empty() || rows_.size() >= n)
    refuse_posture(
        name, fmt::format("a task of {} numbers leaves no freedom to {} joints", rows_.size(), n));

  auto start = task;  // to look the pose up: it need not rest yet
  start.tolerance = HUGE_VAL;
  task_ = std::make_shared<const PotentialLoop>(plant, start);
  const auto q = settle(*this, task.rest);
  task_ = std::make_shared<const PotentialLoop>(plant, settled(task, q));
  actuated_ = task_->actuated();
  if (actuated_.size() != n)
    refuse_posture(
        name, fmt::format("{} of {} joints have an actuator, expected all", actuated_.size(), n));
  rest_ = q;
  rest_.resize(2 * n, 0.0);
  rest_.push_back(std::max(p.level, p.least + margin * (p.most - p.least)));

  description_ = task_->description();
  description_.name += " with a posture";
  description_.nx = int(2 * n + 1);
  description_.traits.canonical = false;
  description_.invariants.clear();
  description_.blocks.push_back({"tank", phs::BlockKind::linear, int(2 * n), 1, -1, "J", ""});
  description_.storages = {"kinetic", "task", "posture", "tank"};
  description_.powers = {{"damping", phs::PowerKind::dissipated},
                         {"valve", phs::PowerKind::dissipated}};

  certificate_ = Certificate("null-space posture of '" + name + "'");
  std::mt19937_64 generator(1);
  double leak = 0;
  std::vector<double> at, tau(n);
  for (int i = 0; i < 200; ++i) {
    const auto x = phs::random_state(plant->description(), 1.0, generator);
    for (size_t k = 0; k < n; ++k) tau[k] = p.stiffness[k] * (x[k] - p.rest[k]);
    const std::span<const double> place = std::span<const double>(x).first(n);
    const auto free = task_acceleration(place, tau);
    const auto left = task_acceleration(place, projected(place, tau));
    double a = 0, b = 0;
    for (size_t k = 0; k < free.size(); ++k) {
      a = std::hypot(a, left[k]);
      b = std::hypot(b, free[k]);
    }
    if (a / b > leak) {
      leak = a / b;
      at.assign(place.begin(), place.end());
    }
  }
  certificate_.at_most("leakage into the task", leak, 1e-9,
                       "task acceleration by the posture, projected over not, 200 coordinates", at);
  for (size_t k = 0; k < n; ++k) tau[k] = p.stiffness[k] * (q[k] - p.rest[k]);
  const auto left = projected(q, tau);
  double pull = 0, scale = 1e-300;
  for (size_t k = 0; k < n; ++k) {
    pull = std::max(pull, std::fabs(left[k]));
    scale = std::max(scale, std::fabs(tau[k]));
  }
  certificate_.at_most("posture at rest", pull / scale, 1e-9,
                       "force left in the null space over the posture's");
  const auto system = make_loop<double>();
  std::vector<double> f(rest_.size());
  system->field(0.0, rest_, {}, f);
  double rate = 0;
  for (const double v : f) rate = std::max(rate, std::fabs(v));
  certificate_.at_most("rest point", rate / scale, 1e-9, "field over the posture's force");
  // The tank's level is free; every other mode is to decay.
  const auto modes = phs::eigenvalues(rest_.size(), field_jacobian(*this, rest_));
  size_t decaying = 0;
  std::vector<double> real;
  for (const auto& z : modes) {
    real.push_back(z.real());
    decaying += z.real() < -1e-9;
  }
  certificate_.at_least("decaying modes", double(decaying), double(2 * n),
                        "of the linearised loop; one mode, the tank's level, stays", {});
  certificate_.report("modes", real.back(), "real parts", real);
  certificate_.report("tank", p.level, "level at the start, its bounds [J]", {p.least, p.most});
  refuse_failure(certificate_);
}

std::vector<double> NullSpaceLoop::projected(std::span<const double> q,
                                             std::span<const double> tau) const {
  Projector<double> projector(*this);
  projector.place(q);
  std::vector<double> w(tau.size());
  projector.felt(tau.data(), w.data());
  for (size_t i = 0; i < w.size(); ++i) w[i] = tau[i] - w[i];
  return w;
}
std::vector<double> NullSpaceLoop::task_acceleration(std::span<const double> q,
                                                     std::span<const double> tau) const {
  Projector<double> projector(*this);
  projector.place(q);
  return projector.acceleration(tau.data());
}

template <class T>
std::unique_ptr<LoopSystem<T>> NullSpaceLoop::make_loop() const {
  return std::make_unique<NullSpaceSystem<T>>(*this);
}
#define PORTHOS_INSTANTIATE(T) \
  template std::unique_ptr<LoopSystem<T>> NullSpaceLoop::make_loop<T>() const;
PORTHOS_FOR_EACH_SCALAR(PORTHOS_INSTANTIATE)
#undef PORTHOS_INSTANTIATE

}  // namespace porthos::energy_shaping
