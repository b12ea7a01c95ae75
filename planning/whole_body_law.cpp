#include "planning/whole_body_law.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "planning/detail/whole_body_law_work.h"
#include "planning/detail/whole_body_parts.h"

namespace porthos::planning {
namespace {

using mechanics::Vec3d;

/// A contact is closed up to here [m].
constexpr double closed = 1e-3;

void count_instant(size_t what, double t, std::span<double> memory) {
  if (memory[what]++ == 0) memory[what + 1] = t;
}

}  // namespace

bool WholeBodyLaw::Work::near(const ContactPoint& p, const Vec3d& at) const {
  return mechanics::dot(p.normal, at - p.ground) <= closed;
}

/// What the gait sees at an instant, and its plan.
void WholeBodyLaw::Work::step(double t, std::span<double> memory) {
  const auto centre = body->centre();
  seen = {t, d.period, centre.at, centre.moving, {}, {}, {}};
  size_t i = 0;
  for (const Support& s : d.supports) {
    Vec3d middle{0, 0, 0};
    bool down = true;
    for (const ContactPoint& p : s.points) {
      const Vec3d at = body->contact(i++).at;
      middle += (1 / double(s.points.size())) * at;
      down = down && near(p, at);
      if (near(p, at)) seen.points.push_back(at);
    }
    seen.feet.push_back(middle);
    seen.closed.push_back(down);
  }
  plan = d.gait->plan(seen, memory);
}

void WholeBodyLaw::Work::touch(double t) {
  size_t i = 0;
  if (d.lifted_every > 0) t -= d.lifted_every * std::floor(t / d.lifted_every);
  for (size_t k = 0; k < d.supports.size(); ++k) {
    const Support& s = d.supports[k];
    const bool lifted =
        (d.gait && plan.feet[k].lifted) || std::ranges::any_of(s.lifted, [&](const auto& when) {
          return when[0] <= t && t < when[1];
        });
    for (const ContactPoint& p : s.points) {
      const bool holds = !lifted && near(p, body->contact(i).at);
      body->touch(i++, holds ? Touch::holds : Touch::none);
    }
  }
}

void WholeBodyLaw::Work::give_way() {
  for (size_t i = 0; i < contacts; ++i)
    if (body->touch(i) == Touch::holds) body->touch(i, Touch::pushes);
}

void WholeBodyLaw::Work::tell(const WholeBodySolution& s, size_t before, double t,
                              std::span<double> memory) const {
  memory[instants] += 1;
  if (!s.exceeded.empty()) count_instant(unkept, t, memory);
  if (s.limited) count_instant(unpaid, t, memory);
  auto own = memory.subspan(told_size);
  for (size_t k = 0; k < d.tasks.size(); ++k, own = own.subspan(of_task)) {
    own[error_now] = s.tasks[before + k].distance();
    if (!s.tasks[before + k].met) own[missed] += 1;
    if (own[error_now] <= own[error_worst]) continue;
    own[error_worst] = own[error_now];
    own[error_when] = t;
  }
  size_t i = 0;
  for (const Support& support : d.supports) {
    std::fill_n(own.begin(), 3, 0.0);
    for (size_t p = 0; p < support.points.size(); ++p, ++i)
      for (size_t k = 0; k < 3; ++k) own[k] += s.forces[3 * i + k];
    own = own.subspan(3);
  }
}

WholeBodyLaw::WholeBodyLaw(std::shared_ptr<const mechanics::MechanicalModel> model,
                           WholeBodyDesign design)
    : work_(std::make_unique<Work>()) {
  Work& w = *work_;
  w.model = std::move(model);
  w.d = std::move(design);
  const auto& m = w.model->mechanism();
  w.v_dot.resize(size_t(m.nv()));
  WholeBodyOptions o;
  o.limits = w.d.limits;
  o.period = w.d.period;
  o.holding = w.d.holding;
  for (const Support& s : w.d.supports)
    o.contacts.insert(o.contacts.end(), s.points.begin(), s.points.end());
  for (const auto& task : w.d.tasks)
    if (!task.link.empty() && m.body(task.link).node < 0)
      throw InvalidArgument(
          fmt::format("task '{}' is of '{}', which never moves", task.name, task.link));
  w.contacts = o.contacts.size();
  w.body = std::make_unique<WholeBody>(std::shared_ptr<const mechanics::Mechanism>(w.model, &m),
                                       std::move(o));
  for (const auto* j : detail::single_freedoms(m)) {
    const auto idle = [&](const JointLimit& l) { return l.joint == j->joint && l.torque == 0; };
    if (std::ranges::any_of(w.d.limits, idle)) continue;
    w.freedoms.push_back(j->v);
    for (const auto& port : w.model->description().ports)
      if (port.name == j->joint + ".torque" || port.name == j->joint + ".force")
        w.motors.push_back(port.name);
  }
}
WholeBodyLaw::~WholeBodyLaw() = default;

const std::vector<std::string>& WholeBodyLaw::motors() const { return work_->motors; }

std::vector<double> WholeBodyLaw::fresh() const {
  const auto& d = work_->d;
  return std::vector<double>(work_->told() + (d.gait ? d.gait->size() : 0), 0.0);
}

std::vector<phs::Shown> WholeBodyLaw::shown() const {
  std::vector<phs::Shown> all;
  size_t at = Work::told_size;
  for (const auto& task : work_->d.tasks) {
    all.push_back({"error " + task.name, at + Work::error_now, 1});
    at += Work::of_task;
  }
  for (const auto& s : work_->d.supports) {
    all.push_back({"force " + s.name, at, 3});
    at += 3;
  }
  if (work_->d.gait) {
    all.push_back({"capture point", at + Gait::capture_at, 3});
    for (size_t k = 0; k < work_->d.supports.size(); ++k)
      all.push_back({"footstep " + work_->d.supports[k].name, at + Gait::footstep_at(k), 3});
  }
  return all;
}

void WholeBodyLaw::operator()(double t, std::span<const double> x, std::span<const double> y,
                              std::span<double> memory, std::span<double> u) const {
  Work& w = *work_;
  const std::lock_guard lock(w.mutex);
  const auto& m = w.model->mechanism();
  const auto own = x.first(size_t(w.model->description().nx));
  const auto q = own.first(size_t(m.nq()));
  const auto v = w.model->rates(own);
  w.body->update(q, v);
  if (w.d.reserve) w.body->budget(std::max(0.0, y[w.freedoms.size()] - *w.d.reserve));
  if (w.d.gait) w.step(t, memory.subspan(w.told()));
  w.touch(t);
  w.levels = w.all_tasks(t, q, v);
  if (w.d.reserve) {
    w.calm = true;
    w.calm_levels = w.all_tasks(t, q, v);
    w.calm = false;
  }
  const auto* s = &w.body->solve(w.levels, w.calm_levels);
  size_t before = 0;
  if (!s->possible) {
    count_instant(Work::gave_way, t, memory);
    w.give_way();
    for (auto* all : {&w.levels, &w.calm_levels})
      if (!all->empty()) all->insert(all->begin(), w.body->still_contacts());
    before = 1;
    s = &w.body->solve(w.levels, w.calm_levels);
  }
  if (!s->possible) throw phs::LawFailure(fmt::format("{} at {} s: {}", w.d.name, t, s->why));
  for (size_t k = 0; k < w.freedoms.size(); ++k) u[k] = s->tau[size_t(w.freedoms[k])];
  w.tell(*s, before, t, memory);
}

std::vector<std::string> WholeBodyLaw::stories(std::span<const double> memory) const {
  const auto& d = work_->d;
  std::vector<std::string> all;
  const auto tell_count = [&](size_t of, const char* what) {
    if (memory[of] > 0)
      all.push_back(fmt::format("{}: {} at {:.0f} of {:.0f} instants, first at {:g} s", d.name,
                                what, memory[of], memory[Work::instants], memory[of + 1]));
  };
  tell_count(Work::gave_way,
             "nothing kept contacts, cones and torque limits together, and contacts gave way");
  tell_count(Work::unkept, "limits of rate, position or work could not be kept");
  tell_count(Work::unpaid, "the tank held less than the tasks would have taken");
  if (d.gait) {
    const auto gait = memory.subspan(work_->told());
    if (Gait::steps(gait) > 0)
      all.push_back(fmt::format("{}: {:.0f} steps, the first at {:g} s", d.name, Gait::steps(gait),
                                Gait::first(gait)));
  }
  auto own = memory.subspan(Work::told_size);
  for (const auto& task : d.tasks) {
    if (own[Work::missed] > 0)
      all.push_back(fmt::format(
          "{}: task '{}' was not met at {:.0f} of {:.0f} instants, worst by {:.3g} at {:g} s",
          d.name, task.name, own[Work::missed], memory[Work::instants], own[Work::error_worst],
          own[Work::error_when]));
    own = own.subspan(Work::of_task);
  }
  return all;
}

}  // namespace porthos::planning
