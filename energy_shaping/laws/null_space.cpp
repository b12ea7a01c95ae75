#include "energy_shaping/laws/null_space.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "energy_shaping/laws/detail/null_space_projector.h"
#include "energy_shaping/loop/derivatives.h"
#include "phs/functions/tank.h"
#include "phs/linear_algebra/linear_algebra.h"
#include "phs/system/random_state.h"

namespace porthos::energy_shaping {
namespace {

[[noreturn]] void refuse_posture(const std::string& name, const std::string& why) {
  throw InvalidArgument("null-space posture of '" + name + "': " + why);
}

/// Coordinates that meet the task with the least energy of the posture, from q on: Newton's method
/// with a multiplier per task row.
std::vector<double> settle(const NullSpaceLoop& loop, std::vector<double> q,
                           const std::string& name) {
  const auto& m = loop.task().mechanical().mechanism();
  const auto& pose = loop.task().parts().poses[0];
  const size_t n = q.size(), r = loop.rows().size(), N = n + r;
  NullSpaceProjector<double> projector(loop);
  mechanics::Workspace<double> w(m);
  std::vector<mechanics::Transform<double>> poses(m.nodes().size());
  std::vector<double> A(N * N), b(N);
  for (int round = 0; round < 2000; ++round) {  // far postures: a tenth of the way per round
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
    if (most < 1e-14) return q;
    if (round == 1999 && !(most < 1e-9))
      refuse_posture(name,
                     "no coordinates near the start hold the task and come nearest to the "
                     "posture, expected a start or a posture closer to the task");
  }
  return q;
}

/// How many of the task's numbers the joints move at q, independently of each other.
int rank_of_task(const NullSpaceLoop& loop, std::span<const double> q) {
  const size_t n = q.size(), r = loop.rows().size();
  NullSpaceProjector<double> projector(loop);
  projector.place(q);
  const auto& J = projector.jacobian();
  std::vector<double> S(r * r);
  for (size_t i = 0; i < r; ++i)
    for (size_t j = 0; j < r; ++j)
      S[i * r + j] = phs::dense::dot(n, J.data() + i * n, J.data() + j * n);
  const auto squares = phs::symmetric_eigenvalues(r, S);
  return int(std::count_if(squares.begin(), squares.end(),
                           [&](double s) { return s > 1e-12 * squares.back(); }));
}

PotentialShaping settled(PotentialShaping s, const std::vector<double>& rest) {
  s.rest = rest;
  return s;
}

}  // namespace

NullSpaceLoop::NullSpaceLoop(std::shared_ptr<const mechanics::MechanicalModel> plant,
                             PotentialShaping task, NullSpacePosture posture)
    : ClosedLoopFor(plant, {}), posture_(std::move(posture)) {
  take_task(task, plant->mechanism());
  const std::string& name = task.name;
  const size_t n = size_t(plant->mechanism().nv());
  auto start = task;  // to find the pose: no rest needed yet
  start.tolerance = HUGE_VAL;
  task_ = std::make_shared<const PotentialLoop>(plant, start);
  if (const int rank = rank_of_task(*this, task.rest); rank < task_size())
    refuse_posture(name,
                   fmt::format("from the start the joints move '{}' in {} of the {} directions "
                               "of the task, expected all of them",
                               task.poses[0].link, rank, task_size()));
  const auto q = settle(*this, task.rest, name);
  task_ = std::make_shared<const PotentialLoop>(plant, settled(task, q));
  actuated_ = task_->actuated();
  if (actuated_.size() != n)
    refuse_posture(
        name, fmt::format("{} of {} joints have an actuator, expected all", actuated_.size(), n));
  rest_ = q;
  rest_.resize(2 * n, 0.0);
  rest_.push_back(std::max(posture_.level,
                           posture_.least + phs::tank_margin * (posture_.most - posture_.least)));
  describe();
  certify(name);
}

/// Refuses a shaping that is not a task with a posture, and finds the task's rows.
void NullSpaceLoop::take_task(const PotentialShaping& task, const mechanics::Mechanism& m) {
  const std::string& name = task.name;
  const size_t n = size_t(m.nv());
  for (const auto& c : m.coordinates())
    if (c.nq != 1)
      refuse_posture(name, "joint '" + c.name + "' has several degrees of freedom, expected one");
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
    refuse_posture(name,
                   fmt::format("a task of {} numbers leaves no degree of freedom to {} joints",
                               rows_.size(), n));
}

void NullSpaceLoop::describe() {
  const size_t n = posture_.rest.size();
  description_ = task_->description();
  description_.name += " with a posture";
  description_.nx = int(2 * n + 1);
  description_.traits.canonical = false;
  description_.invariants.clear();
  description_.blocks.push_back({"tank", phs::BlockKind::linear, int(2 * n), 1, -1, "J", ""});
  description_.storages = {"kinetic", "task", "posture", "tank"};
  description_.powers = {{"damping", phs::PowerKind::dissipated},
                         {"valve", phs::PowerKind::dissipated}};
}

void NullSpaceLoop::certify(const std::string& name) {
  const auto& p = posture_;
  const size_t n = p.rest.size();
  const std::vector<double> q(rest_.begin(), rest_.begin() + long(n));
  certificate_ = Certificate("null-space posture of '" + name + "'");
  certify_leakage();
  std::vector<double> tau(n);
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
  // The tank's level is free; every other mode must decay.
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

void NullSpaceLoop::certify_leakage() {
  const auto& p = posture_;
  const size_t n = p.rest.size();
  std::mt19937_64 generator(1);
  double leak = 0;
  std::vector<double> at, tau(n);
  for (int i = 0; i < 200; ++i) {
    const auto x = phs::random_state(task_->mechanical().description(), 1.0, generator);
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
}

std::vector<double> NullSpaceLoop::projected(std::span<const double> q,
                                             std::span<const double> tau) const {
  NullSpaceProjector<double> projector(*this);
  projector.place(q);
  std::vector<double> w(tau.size());
  projector.felt(tau.data(), w.data());
  for (size_t i = 0; i < w.size(); ++i) w[i] = tau[i] - w[i];
  return w;
}
std::vector<double> NullSpaceLoop::task_acceleration(std::span<const double> q,
                                                     std::span<const double> tau) const {
  NullSpaceProjector<double> projector(*this);
  projector.place(q);
  return projector.acceleration(tau.data());
}

}  // namespace porthos::energy_shaping
