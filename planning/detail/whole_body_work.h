#pragma once
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>

#include "mechanics/crba.h"
#include "mechanics/kinematics.h"
#include "mechanics/momentum.h"
#include "planning/detail/whole_body_parts.h"

/// What WholeBody keeps. Private to whole_body*.cpp.
namespace porthos::planning {

using mechanics::Vec3d;
using Matrix6 = Eigen::Matrix<double, 6, Eigen::Dynamic>;

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
  std::vector<double> x;                         ///< the solution
  std::vector<LevelOutcome> outcomes;            ///< of the tasks at x, where the budget acts
  std::vector<std::string> physical, kinematic;  ///< what each row of the limits says
  std::vector<Touch> touch;                      ///< of each contact
  double budget = std::numeric_limits<double>::infinity();  ///< of work [J]
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
      touch.push_back(o.contacts[i].touch);
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

  PointMotion point(const mechanics::BodyFrame& frame) const {
    const auto& X = pose[size_t(frame.node)];
    const auto& T = V[size_t(frame.node)];
    const Vec3d r = frame.pose.r;
    return {X.R * frame.pose.R, X.R * r + X.r, X.R * T.w, X.R * (T.v + mechanics::cross(T.w, r))};
  }

  /// Row i of M v' - J_cᵀ f, as a row over z.
  void dynamics_row(long i, double* row) const {
    for (long j = 0; j < nv; ++j) row[j] = M[size_t(i + nv * j)];
    for (long k = 0; k < n - nv; ++k) row[nv + k] = -mass * Jc(k, i);
  }

  /// By how much freedom i moves within a period, over the period: v + ½T v'.
  double way(long i) const { return v[size_t(i)] + 0.5 * o.period * out.v_dot[size_t(i)]; }

  void equations(TaskLevel& level) const;
  void keep_contacts(TaskLevel& level, Touch of) const;
  double* new_row(TaskLevel& level, double wanted) const;
  void physical_limits(TaskLevel& level);
  void kinematic_limits(TaskLevel& level);
  TaskLevel rows(const std::string& name, const Matrix6& J, const Eigen::Matrix<double, 6, 1>& dr,
                 std::span<const double> wanted) const;
  void explain(const HierarchySolution& s);
  bool accept(const HierarchySolution& s);
  void set(std::span<const double> x);
  void keep_budget(std::span<const TaskLevel> tasks, std::span<const TaskLevel> calm);
  void mix(std::span<const double> other, const WholeBodySolution& of_other);
  void limit_work(TaskLevel& level);
};

}  // namespace porthos::planning
