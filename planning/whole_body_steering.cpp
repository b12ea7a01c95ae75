// What the tasks of a whole-body controller ask for.
#include <algorithm>
#include <cmath>

#include "mechanics/kinematics.h"
#include "planning/detail/whole_body_law_work.h"

namespace porthos::planning {
namespace {

using mechanics::Vec3d;

/// The turn from one attitude to another, as axis times angle in world axes; |angle| ≤ π.
Vec3d turn_between(const mechanics::Quaternion<double>& from,
                   const mechanics::Quaternion<double>& to) {
  auto e = to * from.conj();
  if (e.w < 0) e = {-e.w, -e.v};
  const double s = mechanics::norm(e.v);
  return s > 0 ? (2 * std::atan2(s, e.w) / s) * e.v : Vec3d{0, 0, 0};
}

double at_time(const phs::FunctionPtr& f, double t) { return f ? (*f)(t) : 0.0; }

/// Towards an attitude: ω² turn - 2 ζ ω turning.
Vec3d turn_back(const PointMotion& p, const mechanics::Quaternion<double>& wanted, double bandwidth,
                double loss) {
  const auto xi = mechanics::quaternion_of(p.R);
  return bandwidth * bandwidth *
             turn_between(mechanics::Quaternion<double>::load(xi.data()), wanted) -
         loss * p.turning;
}

/// x_d, x_d' and x_d'' of one axis at t; the last by a dual number.
std::array<double, 3> wanted_at(const phs::Motion& m, double t) {
  return {at_time(m.position, t), at_time(m.rate, t), m.rate ? (*m.rate)(phs::Dual{t, 1}).d : 0.0};
}

}  // namespace

TaskLevel WholeBodyLaw::Work::points(const SteeredTask& s, double t) {
  const double w = s.bandwidth, loss = 2 * s.damping_ratio * w;
  const bool of_all = s.kind == SteeredTask::Kind::centre_of_mass;
  Vec3d at, moving;
  if (of_all) {
    const auto c = body->centre();
    at = c.at;
    moving = c.moving;
  } else {
    const auto p = body->point(s.link, s.at);
    at = p.at;
    moving = p.moving;
  }
  std::array<double, 6> a{NAN, NAN, NAN, NAN, NAN, NAN};
  for (int k = 0; k < 3; ++k) {
    if (!s.axes[size_t(k)]) continue;
    if (of_all && d.gait && k < 2) {
      a[size_t(3 + k)] = d.gait->acceleration(plan, at, w)[k];
      continue;
    }
    const auto [x, rate, acceleration] = wanted_at(s.target[size_t(k)], t);
    a[size_t(3 + k)] =
        asked(acceleration + w * w * (x - at[k]) + loss * (rate - moving[k]), w, moving[k]);
  }
  if (of_all) return body->centre_of_mass(std::span(a).last(3));
  return body->frame(s.link, s.at, a);
}

TaskLevel WholeBodyLaw::Work::task(const SteeredTask& s, double t, std::span<const double> q,
                                   std::span<const double> v) {
  const double w = s.bandwidth, loss = 2 * s.damping_ratio * w;
  std::array<double, 6> a{NAN, NAN, NAN, NAN, NAN, NAN};
  switch (s.kind) {
    case SteeredTask::Kind::centre_of_mass:
    case SteeredTask::Kind::position:
      return points(s, t);
    case SteeredTask::Kind::attitude: {
      const auto now = body->point(s.link, s.at);
      const Vec3d turn = asked(turn_back(now, s.attitude, w, loss), w, now.turning);
      for (int k = 0; k < 3; ++k)
        if (s.axes[size_t(k)]) a[size_t(k)] = turn[k];
      return body->frame(s.link, s.at, a);
    }
    case SteeredTask::Kind::swing:
      return swing(s);
    case SteeredTask::Kind::angular_momentum: {
      const Vec3d k_G = body->centre().spin;
      for (int k = 0; k < 3; ++k)
        if (s.axes[size_t(k)]) a[size_t(k)] = -w * k_G[k];
      return body->momentum(a);
    }
    default:
      std::fill(v_dot.begin(), v_dot.end(), NAN);
      for (const auto& j : s.joints)
        v_dot[size_t(j.v)] =
            asked(w * w * (j.target - q[size_t(j.q)]) - loss * v[size_t(j.v)], w, v[size_t(j.v)]);
      return body->joints(v_dot);
  }
}

std::vector<TaskLevel> WholeBodyLaw::Work::all_tasks(double t, std::span<const double> q,
                                                     std::span<const double> v) {
  std::vector<TaskLevel> all;
  for (const auto& s : d.tasks) all.push_back(task(s, t, q, v));
  all.push_back(body->small_forces());  // of what is left: the load is shared evenly
  return all;
}

/// Feet that swing follow their curves; soles keep their attitude.
TaskLevel WholeBodyLaw::Work::swing(const SteeredTask& s) {
  const double w = s.bandwidth, loss = 2 * s.damping_ratio * w;
  TaskLevel level;
  for (size_t i = 0; i < plan.feet.size(); ++i) {
    const Gait::Swing& foot = plan.feet[i];
    if (!foot.moves) continue;
    const Support& support = d.supports[i];
    const ContactPoint& first = support.points[0];
    Vec3d middle{0, 0, 0};
    for (const ContactPoint& p : support.points)
      middle += (1 / double(support.points.size())) * p.position;
    const auto now = body->point(first.body, middle);
    const Vec3d moving = asked(
        foot.acceleration + w * w * (foot.at - seen.feet[i]) + loss * (foot.rate - now.moving), w,
        now.moving);
    std::array<double, 6> a{NAN, NAN, NAN, moving.x, moving.y, moving.z};
    if (support.points.size() >= 3) {
      const Vec3d turn = asked(turn_back(now, support.attitude, w, loss), w, now.turning);
      for (int k = 0; k < 3; ++k) a[size_t(k)] = turn[k];
    }
    append(level, body->frame(first.body, middle, a));
  }
  level.name = s.name;
  return level;
}

}  // namespace porthos::planning
