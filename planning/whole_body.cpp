#include "planning/whole_body.h"

#include "mechanics/rnea.h"
#include "planning/detail/whole_body_work.h"

namespace porthos::planning {
namespace {

/// Of the work of motors, at an instant.
constexpr int most_tangents = 10;

}  // namespace

double* WholeBody::Work::new_row(TaskLevel& level, double wanted) const {
  level.A.resize(level.A.size() + size_t(n), 0.0);
  level.b.push_back(wanted);
  return level.A.data() + level.A.size() - n;
}

void WholeBody::Work::equations(TaskLevel& level) const {
  level.A.clear();
  level.b.clear();
  for (long i = 0; i < nv; ++i)
    if (!motor[size_t(i)]) dynamics_row(i, new_row(level, -b[size_t(i)]));
  for (long k = 0; k < n - nv; ++k)
    if (touch[size_t(k / 3)] == Touch::none) new_row(level, 0)[nv + k] = 1;
  keep_contacts(level, Touch::holds);
}

/// One or two points of a body keep their velocities; of three or more the body does, since points
/// of a body that turns cannot: their distances would change.
void WholeBody::Work::keep_contacts(TaskLevel& level, Touch of) const {
  const auto row = [&](const auto& J, double drift) {
    Eigen::Map<Eigen::RowVectorXd>(new_row(level, -drift), nv) = J;
  };
  const auto together = [&](size_t i, size_t j) {
    return touch[j] == of && cones[i].frame.name == cones[j].frame.name;
  };
  for (size_t i = 0; i < cones.size(); ++i) {
    if (touch[i] != of) continue;
    size_t before = 0, points = 0;
    for (size_t j = 0; j < cones.size(); ++j) {
      before += j < i && together(i, j);
      points += together(i, j);
    }
    if (points >= 3 && before > 0) continue;
    const double w = o.holding;
    const auto p = point(cones[i].frame);
    const Vec3d& up = cones[i].normal;
    const Vec3d gap = mechanics::dot(up, p.at - o.contacts[i].ground) * up;
    const Vec3d back = -2 * w * p.moving - w * w * gap;
    if (points >= 3) {
      Vec3d sole{0, 0, 0};  // its normal, from the first three points that are not in line
      std::vector<Vec3d> at;
      for (size_t j = 0; j < cones.size(); ++j)
        if (together(i, j)) at.push_back(point(cones[j].frame).at);
      for (size_t j = 2; j < at.size() && mechanics::norm(sole) < 1e-9; ++j)
        sole = mechanics::cross(at[1] - at[0], at[j] - at[0]);
      const double size = std::copysign(mechanics::norm(sole), mechanics::dot(sole, up));
      const Vec3d tilt = size != 0 ? mechanics::cross((1 / size) * sole, up) : Vec3d{0, 0, 0};
      const Vec3d turn = -2 * w * p.turning + w * w * tilt;
      const Matrix6 J = jacobian(cones[i].frame);
      const auto dr = drift(cones[i].frame);
      for (int k = 0; k < 3; ++k) row(J.row(k), dr[k] - turn[k]);
      for (int k = 0; k < 3; ++k) row(J.row(3 + k), dr[3 + k] - back[k]);
      continue;
    }
    for (int k = 0; k < 3; ++k) row(Jc.row(3 * long(i) + k), Jc_dot_v[3 * long(i) + k] - back[k]);
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
    const double least = touch[i] == Touch::none ? 0 : p.least;
    force(new_row(least / mass, "least force of '" + p.name + "'"), 1, 0, 0);
    if (std::isfinite(p.most))
      force(new_row(-p.most / mass, "most force of '" + p.name + "'"), -1, 0, 0);
    const double mu = p.friction * std::cos(M_PI / p.edges);
    for (int k = 0; k < p.edges; ++k) {
      const double angle = 2 * M_PI * k / p.edges;
      force(new_row(0, "friction of '" + p.name + "'"), mu, std::cos(angle), std::sin(angle));
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

/// What fails, the worst first named with its number.
void WholeBody::Work::explain(const HierarchySolution& s) {
  const auto& equations = s.levels[0];
  const auto& limits = s.levels[1];
  out.why.clear();
  if (!equations.met) {
    out.why = "the contacts and the degrees of freedom without motor contradict each other by " +
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

void WholeBody::touch(size_t contact, Touch now) { work_->touch.at(contact) = now; }
Touch WholeBody::touch(size_t contact) const { return work_->touch.at(contact); }
PointMotion WholeBody::contact(size_t contact) const {
  return work_->point(work_->cones.at(contact).frame);
}

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
    if (const double r = w.o.contacts[i].radius; r > 0) {
      const auto& own = w.o.contacts[i];
      auto frame = w.m->body(own.body);
      const Vec3d down = w.pose[size_t(frame.node)].R.tmul(-r * w.cones[i].normal);
      w.cones[i].frame.pose.r = frame.pose.R * own.position + frame.pose.r + down;
    }
    w.Jc.middleRows<3>(3 * long(i)) = w.jacobian(w.cones[i].frame).bottomRows<3>();
    const auto drift = w.drift(w.cones[i].frame);
    for (long k = 0; k < 3; ++k) w.Jc_dot_v[3 * long(i) + k] = drift[3 + k];
  }
}

void WholeBody::budget(double work) {
  if (!(work >= 0))
    throw InvalidArgument("the budget of a whole-body controller is " + number(work) +
                          " J, expected 0 or more");
  work_->budget = work;
}

/// Accelerations, forces, torques and work at x.
void WholeBody::Work::set(std::span<const double> at) {
  x.assign(at.begin(), at.end());
  out.v_dot.assign(x.begin(), x.begin() + nv);
  out.forces.assign(x.begin() + nv, x.end());
  for (auto& f : out.forces) f *= mass;
  out.tau.assign(size_t(nv), 0.0);
  out.work = 0;
  const Eigen::Map<const Eigen::VectorXd> f(out.forces.data(), n - nv);
  for (long i = 0; i < nv; ++i) {
    if (!motor[size_t(i)]) continue;
    double t = b[size_t(i)] - Jc.col(i).dot(f);
    for (long j = 0; j < nv; ++j) t += M[size_t(i + nv * j)] * out.v_dot[size_t(j)];
    out.tau[size_t(i)] = t;
    out.work += o.period * t * way(i);
  }
}

/// Takes a solution. @return whether it is possible
bool WholeBody::Work::accept(const HierarchySolution& s) {
  out.possible = s.levels[0].met && s.levels[1].met;
  explain(s);
  set(s.x);
  if (out.possible) return true;
  out.tau.clear();
  out.work = 0;
  return false;
}

/// Goes back from x towards another solution as far as the budget lets it. Between two solutions
/// everything that is kept is kept, and the work is a convex quadratic of the way.
void WholeBody::Work::mix(std::span<const double> other, const WholeBodySolution& of_other) {
  double bend = 0;
  for (size_t i = 0; i < out.tau.size(); ++i)
    bend += 0.5 * o.period * o.period * (of_other.tau[i] - out.tau[i]) *
            (of_other.v_dot[i] - out.v_dot[i]);
  const double slope = of_other.work - out.work - bend, left = budget - out.work;
  const double root = std::sqrt(std::max(0.0, slope * slope + 4 * bend * left));
  const double share = slope > 0 ? 2 * left / (slope + root) : (root - slope) / (2 * bend);
  auto between = x;
  for (size_t k = 0; k < x.size(); ++k) between[k] += share * (other[k] - x[k]);
  set(between);
}

/// From a solution that takes too much work to one that does not.
void WholeBody::Work::keep_budget(std::span<const TaskLevel> tasks,
                                  std::span<const TaskLevel> calm) {
  const double excess = out.work - budget;
  out.limited = true;
  for (size_t k = calm.size(); k-- > 0;) {
    if (calm[k].b == tasks[k].b) continue;
    levels[3 + k] = calm[k];
    const auto before = x;
    const WholeBodySolution solution = out;
    if (!accept(hierarchy.solve(levels))) return;
    if (out.work <= budget) return mix(before, solution);
  }
  for (int tangents = 0; tangents < most_tangents; ++tangents) {
    limit_work(levels[2]);
    if (!accept(hierarchy.solve(levels)) || out.work - budget <= 1e-9 * excess) return;
  }
}

/// The work is convex in what keeps the equations, since τᵀv' has v'ᵀM v' there. So the tangent at
/// a solution that takes too much excludes it, and nothing that keeps the budget.
void WholeBody::Work::limit_work(TaskLevel& level) {
  const double T = o.period;
  Eigen::RowVectorXd row = Eigen::RowVectorXd::Zero(n), own = row;
  double c = budget;
  for (long i = 0; i < nv; ++i) {
    if (!motor[size_t(i)]) continue;
    dynamics_row(i, own.data());
    row += T * way(i) * own;
    const double curved = 0.5 * T * T * out.tau[size_t(i)];
    row[i] += curved;
    c += curved * out.v_dot[size_t(i)] - T * way(i) * b[size_t(i)];
  }
  const double size = row.norm();
  row /= -size;
  level.C.insert(level.C.end(), row.data(), row.data() + n);
  level.c.push_back(-c / size);
  kinematic.push_back("work");
}

const WholeBodySolution& WholeBody::solve(std::span<const TaskLevel> tasks,
                                          std::span<const TaskLevel> calm) {
  Work& w = *work_;
  if (!calm.empty()) require_size("calm tasks", calm.size(), tasks.size());
  w.levels.resize(3 + tasks.size());
  w.levels[0].name = "equations";
  w.levels[1].name = "cones and torques";
  w.levels[2].name = "rates and positions";
  w.equations(w.levels[0]);
  w.physical_limits(w.levels[1]);
  w.kinematic_limits(w.levels[2]);
  std::copy(tasks.begin(), tasks.end(), w.levels.begin() + 3);
  w.out.limited = false;
  const auto& s = w.hierarchy.solve(w.levels);  // always that of its last call
  if (w.accept(s) && w.out.work > w.budget) {
    w.keep_budget(tasks, calm);
    w.outcomes.assign(s.levels.begin() + 3, s.levels.end());
    for (size_t k = 0; k < tasks.size(); ++k) judge(tasks[k], w.x, w.outcomes[k]);
    w.out.tasks = w.outcomes;
  } else {
    w.out.tasks = std::span(s.levels).subspan(3);
  }
  return w.out;
}

}  // namespace porthos::planning
