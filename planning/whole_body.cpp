#include "planning/whole_body.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "mechanics/crba.h"
#include "mechanics/kinematics.h"
#include "mechanics/momentum.h"
#include "mechanics/rnea.h"
#include "planning/detail/whole_body_parts.h"

namespace porthos::planning {
namespace {

using mechanics::Vec3d;
using Matrix6 = Eigen::Matrix<double, 6, Eigen::Dynamic>;

}  // namespace

struct WholeBody::Work {
  std::shared_ptr<const mechanics::Mechanism> m;
  WholeBodyOptions o;
  std::vector<detail::Cone> cones;
  std::vector<detail::LimitedJoint> joints;
  std::vector<char> motor;  ///< of each freedom
  long nv, n;
  double mass;
  mutable mechanics::Workspace<double>
      kernel;  ///< after update(): twists and accelerations of q, v
  std::vector<double> q, v, M, b;
  std::vector<mechanics::Transform<double>> pose;
  Eigen::MatrixXd Jc;  ///< 3 rows for each contact
  Eigen::VectorXd Jc_dot_v;
  std::vector<mechanics::Motion<double>> V, a;  ///< copies: other kernels overwrite the workspace
  mechanics::Force<double> net{{0, 0, 0}, {0, 0, 0}};  ///< at v' = 0, about the world's origin
  std::vector<TaskLevel> levels;
  std::vector<std::string> physical, kinematic;  ///< what each row of the limits says
  TaskHierarchy hierarchy;
  WholeBodySolution out;

  Work(std::shared_ptr<const mechanics::Mechanism> mechanism, WholeBodyOptions options)
      : m(std::move(mechanism)),
        o(std::move(options)),
        joints(detail::limited_joints(*m, o.limits)),
        motor(size_t(m->nv()), 0),
        nv(m->nv()),
        n(nv + 3 * long(o.contacts.size())),
        mass(m->total_mass()),
        kernel(*m),
        pose(m->nodes().size()),
        hierarchy(int(n)) {
    for (size_t i = 0; i < o.contacts.size(); ++i) {
      for (size_t j = 0; j < i; ++j)
        if (o.contacts[i].name == o.contacts[j].name)
          throw InvalidArgument("two contacts are named '" + o.contacts[i].name + "'");
      cones.push_back(detail::make_cone(*m, o.contacts[i]));
    }
    if (!(o.period > 0)) throw InvalidArgument("the period of a whole-body controller must be > 0");
    for (const auto* j : detail::single_freedoms(*m)) motor[size_t(j->v)] = 1;
    for (const auto& j : joints)
      if (j.limit.torque == 0) motor[size_t(j.v)] = 0;
    q.resize(size_t(m->nq()));
    v.resize(size_t(nv));
    M.resize(size_t(nv * nv));
    b.resize(size_t(nv));
    Jc.resize(3 * long(cones.size()), nv);
    Jc_dot_v.resize(3 * long(cones.size()));
  }

  Matrix6 jacobian(const mechanics::BodyFrame& frame) const {
    Matrix6 J(6, nv);
    mechanics::jacobian<double>(*m, kernel, q, frame, mechanics::JacobianAxes::world,
                                {J.data(), size_t(J.size())});
    return J;
  }

  /// J̇ v of a frame: its acceleration at v' = 0. rnea's accelerations are spatial and of a world
  /// that accelerates by -g.
  Eigen::Matrix<double, 6, 1> drift(const mechanics::BodyFrame& frame) const {
    const auto& A = a[size_t(frame.node)];
    const auto& T = V[size_t(frame.node)];
    const auto& R = pose[size_t(frame.node)].R;
    const auto& r = frame.pose.r;
    const Vec3d w = R * A.w;
    const Vec3d at = A.v + mechanics::cross(A.w, r);
    const Vec3d l = R * (at + mechanics::cross(T.w, T.v + mechanics::cross(T.w, r))) + m->gravity();
    Eigen::Matrix<double, 6, 1> d;
    d << w.x, w.y, w.z, l.x, l.y, l.z;
    return d;
  }

  /// Row i of M v' - J_cᵀ f, as a row over z.
  void dynamics_row(long i, double* row) const {
    for (long j = 0; j < nv; ++j) row[j] = M[size_t(i + nv * j)];
    for (long k = 0; k < n - nv; ++k) row[nv + k] = -mass * Jc(k, i);
  }

  void equations(TaskLevel& level) const;
  void physical_limits(TaskLevel& level);
  void kinematic_limits(TaskLevel& level);
  TaskLevel rows(const std::string& name, const Matrix6& J, const Eigen::Matrix<double, 6, 1>& dr,
                 std::span<const double> wanted) const;
  void explain(const HierarchySolution& s);
};

void WholeBody::Work::equations(TaskLevel& level) const {
  level.A.clear();
  level.b.clear();
  for (long i = 0; i < nv; ++i) {
    if (motor[size_t(i)]) continue;
    level.A.resize(level.A.size() + size_t(n), 0.0);
    dynamics_row(i, level.A.data() + level.A.size() - n);
    level.b.push_back(-b[size_t(i)]);
  }
  for (long k = 0; k < n - nv; ++k) {
    if (o.contacts[size_t(k / 3)].moves) continue;
    level.A.resize(level.A.size() + size_t(n), 0.0);
    Eigen::Map<Eigen::RowVectorXd>(level.A.data() + level.A.size() - n, nv) = Jc.row(k);
    level.b.push_back(-Jc_dot_v[k]);
  }
}

void WholeBody::Work::physical_limits(TaskLevel& level) {
  level.C.clear();
  level.c.clear();
  physical.clear();
  const auto new_row = [&](double c, std::string what) {
    level.C.resize(level.C.size() + size_t(n), 0.0);
    level.c.push_back(c);
    physical.push_back(std::move(what));
    return level.C.data() + level.C.size() - n;
  };
  for (size_t i = 0; i < cones.size(); ++i) {
    const auto& p = o.contacts[i];
    const auto force = [&](double* row, double sn, double s0, double s1) {
      for (int k = 0; k < 3; ++k)
        row[nv + 3 * long(i) + k] =
            sn * cones[i].normal[k] + s0 * cones[i].across[0][k] + s1 * cones[i].across[1][k];
    };
    force(new_row(p.least / mass, "least force of '" + p.name + "'"), 1, 0, 0);
    if (std::isfinite(p.most))
      force(new_row(-p.most / mass, "most force of '" + p.name + "'"), -1, 0, 0);
    const double mu = p.friction / std::sqrt(2.0);
    for (const double s : {1.0, -1.0}) {
      force(new_row(0, "friction of '" + p.name + "'"), mu, s, 0);
      force(new_row(0, "friction of '" + p.name + "'"), mu, 0, s);
    }
  }
  for (const auto& j : joints) {
    const double most = j.limit.torque;
    if (!std::isfinite(most) || most == 0) continue;
    dynamics_row(j.v, new_row(-most - b[size_t(j.v)], "torque of '" + j.limit.joint + "'"));
    double* row = new_row(-most + b[size_t(j.v)], "torque of '" + j.limit.joint + "'");
    dynamics_row(j.v, row);
    for (long k = 0; k < n; ++k) row[k] = -row[k];
  }
}

void WholeBody::Work::kinematic_limits(TaskLevel& level) {
  level.C.clear();
  level.c.clear();
  kinematic.clear();
  const double T = o.period;
  for (const auto& j : joints) {
    const auto at_least = [&](double sign, double bound, const char* what) {  // sign v' ≥ bound
      if (!std::isfinite(bound)) return;
      level.C.resize(level.C.size() + size_t(n), 0.0);
      level.C[level.C.size() - size_t(n - j.v)] = sign;
      level.c.push_back(bound);
      kinematic.push_back(std::string(what) + " of '" + j.limit.joint + "'");
    };
    const double rate = v[size_t(j.v)], at = q[size_t(j.q)] + T * rate, half = 0.5 * T * T;
    at_least(1, (-j.limit.rate - rate) / T, "rate");
    at_least(-1, (rate - j.limit.rate) / T, "rate");
    at_least(1, (j.limit.lower - at) / half, "position");
    at_least(-1, (at - j.limit.upper) / half, "position");
  }
}

TaskLevel WholeBody::Work::rows(const std::string& name, const Matrix6& J,
                                const Eigen::Matrix<double, 6, 1>& dr,
                                std::span<const double> wanted) const {
  require_size(name.c_str(), wanted.size(), 6);
  TaskLevel level{name, {}, {}, {}, {}};
  for (long i = 0; i < 6; ++i) {
    if (std::isnan(wanted[size_t(i)])) continue;
    level.A.resize(level.A.size() + size_t(n), 0.0);
    Eigen::Map<Eigen::RowVectorXd>(level.A.data() + level.A.size() - n, nv) = J.row(i);
    level.b.push_back(wanted[size_t(i)] - dr[i]);
  }
  return level;
}

/// What fails, the worst first named with its number.
void WholeBody::Work::explain(const HierarchySolution& s) {
  const auto& equations = s.levels[0];
  const auto& limits = s.levels[1];
  out.why.clear();
  if (!equations.met) {
    out.why = "the contacts and the freedoms without motor contradict each other by " +
              std::to_string(equations.distance()) + " in their accelerations or forces";
  } else if (!limits.met) {
    out.why = "these limits cannot be kept together:";
    for (size_t i = 0; i < physical.size(); ++i)
      if (limits.short_of[i] > 1e-9) {
        const bool force = physical[i].find("torque") == std::string::npos;
        out.why += " " + physical[i] + " by " +
                   std::to_string(limits.short_of[i] * (force ? mass : 1)) + ",";
      }
    out.why.back() = '.';
  }
  out.exceeded.clear();
  for (size_t i = 0; i < kinematic.size(); ++i)
    if (s.levels[2].short_of[i] > 1e-9 * (1 + std::fabs(levels[2].c[i])))
      out.exceeded.push_back(kinematic[i]);
}

WholeBody::WholeBody(std::shared_ptr<const mechanics::Mechanism> mechanism,
                     WholeBodyOptions options)
    : work_(std::make_unique<Work>(std::move(mechanism), std::move(options))) {}
WholeBody::~WholeBody() = default;
WholeBody::WholeBody(WholeBody&&) noexcept = default;
const mechanics::Mechanism& WholeBody::mechanism() const { return *work_->m; }
int WholeBody::unknowns() const { return int(work_->n); }

void WholeBody::update(std::span<const double> q, std::span<const double> v) {
  Work& w = *work_;
  require_size("q", q.size(), w.q.size());
  require_size("v", v.size(), w.v.size());
  std::copy(q.begin(), q.end(), w.q.begin());
  std::copy(v.begin(), v.end(), w.v.begin());
  mechanics::crba<double>(*w.m, w.kernel, q, w.M);
  mechanics::forward_kinematics<double>(*w.m, w.kernel, q, w.pose);
  mechanics::rnea<double>(*w.m, w.kernel, q, v, {}, {}, w.b);
  w.V = w.kernel.V;
  w.a = w.kernel.a;
  w.net = {{0, 0, 0}, {0, 0, 0}};
  for (size_t i = 0; i < w.m->nodes().size(); ++i)
    if (w.m->nodes()[i].parent < 0) w.net += w.pose[i].to_parent(w.kernel.b[i]);
  for (size_t i = 0; i < w.cones.size(); ++i) {
    w.Jc.middleRows<3>(3 * long(i)) = w.jacobian(w.cones[i].frame).bottomRows<3>();
    const auto drift = w.drift(w.cones[i].frame);
    for (long k = 0; k < 3; ++k) w.Jc_dot_v[3 * long(i) + k] = drift[3 + k];
  }
}

TaskLevel WholeBody::frame(const std::string& body, const Vec3d& position,
                           std::span<const double> acceleration) const {
  auto frame = work_->m->body(body);
  if (frame.node < 0) throw InvalidArgument("a task is on '" + body + "', which never moves");
  frame.pose.r = frame.pose.R * position + frame.pose.r;
  return work_->rows("frame of " + body, work_->jacobian(frame), work_->drift(frame), acceleration);
}

TaskLevel WholeBody::momentum(std::span<const double> rate) const {
  const Work& w = *work_;
  Matrix6 A(6, w.nv);
  mechanics::centroidal_momentum_matrix<double>(*w.m, w.kernel, w.q, {A.data(), size_t(A.size())});
  const Vec3d com = mechanics::centre_of_mass<double>(*w.m, w.kernel, w.q);
  const Vec3d k = w.net.n - mechanics::cross(com, w.net.f);  // gravity has no moment about it
  const Vec3d l = w.net.f + w.mass * w.m->gravity();
  Eigen::Matrix<double, 6, 1> drift;
  drift << k.x, k.y, k.z, l.x, l.y, l.z;
  std::vector<double> wanted(rate.begin(), rate.end());
  for (auto& x : wanted) x /= w.mass;
  return w.rows("momentum", A / w.mass, drift / w.mass, wanted);
}

TaskLevel WholeBody::centre_of_mass(std::span<const double> acceleration) const {
  require_size("centre of mass", acceleration.size(), 3);
  std::vector<double> rate(6, NAN);
  for (size_t i = 0; i < 3; ++i) rate[3 + i] = work_->mass * acceleration[i];
  auto level = momentum(rate);
  level.name = "centre of mass";
  return level;
}

TaskLevel WholeBody::joints(std::span<const double> v_dot) const {
  const Work& w = *work_;
  require_size("joints", v_dot.size(), size_t(w.nv));
  TaskLevel level{"joints", {}, {}, {}, {}};
  for (size_t i = 0; i < size_t(w.nv); ++i) {
    if (std::isnan(v_dot[i])) continue;
    level.A.resize(level.A.size() + size_t(w.n), 0.0);
    level.A[level.A.size() - size_t(w.n) + i] = 1;
    level.b.push_back(v_dot[i]);
  }
  return level;
}

TaskLevel WholeBody::small_forces() const {
  const auto n = size_t(work_->n), nv = size_t(work_->nv);
  TaskLevel level{"small forces",
                  std::vector<double>((n - nv) * n, 0.0),
                  std::vector<double>(n - nv, 0.0),
                  {},
                  {}};
  for (size_t k = 0; k < n - nv; ++k) level.A[k * n + nv + k] = 1;
  return level;
}

const WholeBodySolution& WholeBody::solve(std::span<const TaskLevel> tasks) {
  Work& w = *work_;
  w.levels.resize(3 + tasks.size());
  w.levels[0].name = "equations";
  w.levels[1].name = "cones and torques";
  w.levels[2].name = "rates and positions";
  w.equations(w.levels[0]);
  w.physical_limits(w.levels[1]);
  w.kinematic_limits(w.levels[2]);
  std::copy(tasks.begin(), tasks.end(), w.levels.begin() + 3);
  const auto& s = w.hierarchy.solve(w.levels);
  w.out.possible = s.levels[0].met && s.levels[1].met;
  w.explain(s);
  w.out.v_dot.assign(s.x.begin(), s.x.begin() + w.nv);
  w.out.forces.assign(s.x.begin() + w.nv, s.x.end());
  for (auto& f : w.out.forces) f *= w.mass;
  w.out.tasks = std::span(s.levels).subspan(3);
  w.out.tau.clear();
  if (!w.out.possible) return w.out;
  w.out.tau.assign(size_t(w.nv), 0.0);
  const Eigen::Map<const Eigen::VectorXd> f(w.out.forces.data(), w.n - w.nv);
  for (long i = 0; i < w.nv; ++i) {
    if (!w.motor[size_t(i)]) continue;
    double t = w.b[size_t(i)] - w.Jc.col(i).dot(f);
    for (long j = 0; j < w.nv; ++j) t += w.M[size_t(i + w.nv * j)] * w.out.v_dot[size_t(j)];
    w.out.tau[size_t(i)] = t;
  }
  return w.out;
}

}  // namespace porthos::planning
