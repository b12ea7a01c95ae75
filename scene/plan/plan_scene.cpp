#include "scene/plan/plan_scene.h"

#include <cmath>
#include <filesystem>
#include <numeric>

#include "integrators/derivatives/step_variation.h"
#include "scene/compare/auto_method.h"
#include "scene/read/controllers/controller_type.h"
#include "scene/read/toml_table-inl.h"

namespace porthos::scene {
namespace {

/// What a scene has that a plan cannot be made with; empty: nothing.
std::string obstacle(const Scene& s) {
  return s.orbit                  ? "[orbit]"
         : s.rolls()              ? "[[rolling]]"
         : !s.robots.empty()      ? "[[robot]]"
         : !s.stops.empty()       ? "[[stop]]"
         : s.start_from           ? "[initial] from"
         : s.is_constrained()     ? "loops or couplings"
         : !s.events.empty()      ? "[[event]]"
         : !s.controllers.empty() ? "[[controller]] '" + s.controllers.front().name + "'"
         : !s.actuators.empty()   ? "[[actuator]]"
         : !s.contacts.empty()    ? "[[contact]]"
                                  : "";
}

void check_scene(const Scene& s, const std::string& where) {
  if (const auto other = obstacle(s); !other.empty())
    refuse(where,
           fmt::format("[plan] cannot be combined with {}, expected a scene without", other));
  for (const Element& e : s.elements)
    if (e.type != "spring" && e.type != "damper" && e.type != "friction" && e.type != "force" &&
        e.type != "limits")
      refuse(e.where, fmt::format("[plan] cannot be combined with an element of type \"{}\", "
                                  "expected springs, dampers, friction, limits and forces",
                                  e.type));
  for (const auto& [name, content] : s.files)
    if (std::filesystem::path(name).is_absolute() || name.find("..") != std::string::npos)
      refuse(where, fmt::format("[plan] writes a scene that reads '{}' too, expected a file beside "
                                "the scene or below it",
                                name));
  if (s.step_control != integrators::StepControl::fixed)
    refuse(where, "[plan] is given with a step_control, expected steps of one size");
  if (s.method == auto_method)
    refuse(where, "[plan] is given with method = \"auto\", expected a Gauss method");
  try {
    (void)integrators::gauss_stages(s.method);
  } catch (const InvalidArgument&) {
    refuse(where, fmt::format("[plan] is given with method = \"{}\", expected a Gauss method: "
                              "gauss2 to gauss16, midpoint",
                              s.method));
  }
  const double steps = s.duration / s.step;
  if (std::fabs(steps - std::round(steps)) > 1e-9 * steps)
    refuse(where, fmt::format("[plan] is given with a duration of {} s and steps of {} s, expected "
                              "a whole number of steps",
                              s.duration, s.step));
  if (steps > 100000)
    refuse(where, fmt::format("[plan] has {:.0f} steps, expected at most 100000", steps));
}

PlannedJoint read_joint(const std::string& name, const std::string& where, const Table& t) {
  PlannedJoint j;
  j.name = name;
  j.where = where;
  j.actuated = t.boolean("actuated");
  if (!j.actuated)
    for (const char* key : {"weight", "drawn_weight", "torque_limit", "guess", "guess_phase"})
      if (t.has(key)) t.fail(key, "is given to a joint that is not actuated, expected neither");
  if (t.has("weight")) j.weight = t.not_negative("weight");
  j.rate_weight = t.not_negative("rate_weight");
  j.drawn_weight = t.not_negative("drawn_weight");
  if (t.has("position")) j.position = t.number("position");
  j.rate = t.number("rate");
  if (t.boolean("free_rate")) {
    if (t.has("rate")) t.fail("rate", "is given with free_rate, expected one of both");
    j.rate = {};
  }
  if (t.has("torque_limit")) j.torque_limit = t.positive("torque_limit");
  if (t.has("rate_limit")) j.rate_limit = t.positive("rate_limit");
  if (j.rate && j.rate_limit && std::fabs(*j.rate) > *j.rate_limit)
    t.fail("rate", fmt::format("is {}, which is beyond its rate_limit {}", *j.rate, *j.rate_limit));
  if (t.has("momentum_limit")) j.momentum_limit = t.positive("momentum_limit");
  if (t.has("lower")) j.lower = t.number("lower");
  if (t.has("upper")) j.upper = t.number("upper");
  if (j.lower && j.upper && !(*j.lower < *j.upper))
    t.fail("lower", fmt::format("is {} and upper {}, expected lower < upper", *j.lower, *j.upper));
  if (j.position && ((j.lower && *j.position < *j.lower) || (j.upper && *j.position > *j.upper)))
    t.fail("position", fmt::format("is {}, which is beyond its limits", *j.position));
  j.guess = t.number("guess");
  j.guess_phase = t.number("guess_phase");
  return j;
}

PlannedOutput read_planned_output(const std::string& name, const std::string& where,
                                  const Table& t) {
  PlannedOutput o{.name = name, .where = where};
  if (t.has("lower")) o.lower = t.number("lower");
  if (t.has("upper")) o.upper = t.number("upper");
  if (t.has("value")) o.value = t.number("value");
  if (t.has("rate")) o.rate = t.number("rate");
  if (!o.lower && !o.upper && !o.value && !o.rate)
    refuse(where, "[plan.outputs] has none of lower, upper, value and rate for '" + name +
                      "', expected one or more");
  if (o.lower && o.upper && !(*o.lower < *o.upper))
    t.fail("lower", fmt::format("is {} and upper {}, expected lower < upper", *o.lower, *o.upper));
  if (o.value && ((o.lower && *o.value < *o.lower) || (o.upper && *o.value > *o.upper)))
    t.fail("value", fmt::format("is {}, which is beyond its limits", *o.value));
  return o;
}

/// An end time that is free. Its plans are compared at several durations, so nothing may depend on
/// the time itself.
std::optional<planning::EndTime> read_end_time(const Scene& scene, const Table& t) {
  if (!t.has("time_weight")) {
    for (const char* key : {"shortest", "longest"})
      if (t.has(key)) t.fail(key, "is given without time_weight, expected both or neither");
    return {};
  }
  planning::EndTime free{.weight = t.positive("time_weight")};
  if (t.has("shortest")) free.shortest = t.positive("shortest");
  if (t.has("longest")) free.longest = t.positive("longest");
  for (const char* key : {"shortest", "longest"})
    if (t.has(key) && !(free.shortest <= scene.duration && scene.duration <= free.longest))
      t.fail(key, fmt::format("is {} s, but the search begins at [run] duration = {} s, expected "
                              "shortest <= duration <= longest",
                              t.number(key), scene.duration));
  for (const Element& e : scene.elements)
    if (e.type == "force")
      refuse(e.where,
             "[plan] time_weight frees the end time, and a force may depend on the time, "
             "expected no element of type \"force\"");
  return free;
}

/// Offsets of the position and the momentum of a joint of one freedom in x, and its port.
struct Place {
  int q, p;
  std::string port;
};
Place place_of(const Assembly& a, const PlannedJoint& j) {
  const auto at = joint_place(*a.mechanical, j.where, "[plan]", j.name);
  const std::string own = at.port.substr(std::string("mechanism.").size());
  for (const auto& p : a.model->description().ports)
    if (p.name == own || p.name == at.port)
      return {int(at.q), a.mechanism->nq() + int(at.q), p.name};
  refuse(j.where, fmt::format("joint '{}' has no open port, expected one", j.name));
}

void set_limit(std::vector<double>& list, size_t size, double nothing, int at, double value) {
  if (list.empty()) list.assign(size, nothing);
  list[size_t(at)] = value;
}

/// The base's attitude in x, or -1.
int attitude_at(const Assembly& a) {
  for (const auto& c : a.mechanism->coordinates())
    if (c.name == std::string(mechanics::base_joint_name) + ".attitude") return c.q;
  return -1;
}

/// A rate beyond its limit at the start, or a way that is too long for it, cannot be planned away;
/// and a free end time takes numbers of the state alone.
void check_path(const planning::Problem& p, const Assembly& a, const PlanScene& plan) {
  if (plan.end_time && !plan.outputs.empty() && a.centre && a.centre->moves())
    refuse(plan.outputs.front().where,
           "[plan.outputs] is given with time_weight, and the centre of mass moves, expected it at "
           "rest or an end time that is stated");
  const double t = 0;
  std::vector<double> f(p.start.size());
  const std::vector<double> none(size_t(p.dynamics->nu()), 0.0);
  p.dynamics->field({&t, 1}, p.start, none, f);
  for (const PlannedJoint& j : plan.joints) {
    if (!j.rate_limit) continue;
    const size_t q = size_t(place_of(a, j).q);
    if (std::fabs(f[q]) > *j.rate_limit)
      refuse(j.where, fmt::format("joint '{}' starts at a rate of {:.6g}, which is beyond its "
                                  "rate_limit {} in [plan]",
                                  j.name, f[q], *j.rate_limit));
    const double least = std::fabs(j.position.value_or(p.start[q]) - p.start[q]) / *j.rate_limit;
    if (const double has = plan.end_time ? plan.end_time->longest : p.duration; least > has)
      refuse(j.where,
             fmt::format("joint '{}' needs {:.6g} s at its rate_limit {} in [plan], and has "
                         "{:.6g} s",
                         j.name, least, *j.rate_limit, has));
  }
}

/// Costs, goals and limits of a free base. @param end  gets its attitude
void plan_base(const Assembly& a, const PlanScene& plan, PlanProblem& made,
               std::vector<double>& end) {
  planning::Problem& p = made.problem;
  const int at = attitude_at(a);
  if (at < 0) return;
  const double* start = p.start.data() + at;
  for (int i = 0; i < 4; ++i) p.cost.rate[size_t(at + i)] = 4 * plan.base_weight;  // |ω|² = 4|ξ'|²
  if (plan.attitude) {
    auto g = *plan.attitude;
    const double along = std::inner_product(g.begin(), g.end(), start, 0.0);
    for (size_t i = 0; i < 4 && along < 0; ++i) g[i] = -g[i];
    const auto goals = planning::attitude_goals(at, g);
    p.goals.insert(p.goals.end(), goals.begin(), goals.end());
    for (const char* axis : {"x", "y", "z"})
      made.goal_names.push_back(std::string("base.attitude.") + axis);
    for (size_t i = 0; i < 4; ++i) end[size_t(at) + i] = g[i];
    const double away = 2 * std::acos(std::min(1.0, std::fabs(along)));
    if (plan.attitude_limit && away > *plan.attitude_limit)
      refuse(plan.base_where, fmt::format("attitude_wxyz is {:.6g} rad from the start, which is "
                                          "beyond attitude_limit {} in [plan]",
                                          away, *plan.attitude_limit));
  }
  if (plan.attitude_limit)
    p.limits.path.push_back(attitude_limit(at, p.start, *plan.attitude_limit));
}

}  // namespace

PlanScene read_plan(const Scene& scene) {
  const File file{scene.path};
  const toml::table root = parse_toml(scene.text, file);
  const toml::node* node = root.get("plan");
  if (!node || !node->is_table())
    refuse(file.path + ":1:1",
           "there is no [plan], expected a table with the key joints; see docs/planning.md");
  const Table t(file, *node->as_table(), "[plan]", "", *schema_of("plan"));
  check_scene(scene, t.where());
  PlanScene p;
  if (t.choice("inputs") == "polynomial") p.inputs = planning::Inputs::at_stages;
  p.options.approach = t.boolean("approach");
  if (t.choice("solver") == "ipopt") {
    p.options.solver = "ipopt";
    p.options.approach = false;
    if (!planning::find_solver("ipopt"))
      t.fail("solver", "is \"ipopt\", which this build does not have, expected \"newton\"");
  }
  p.options.iterations = int(std::min<std::uint64_t>(t.whole("iterations"), 1000000));
  p.options.tolerance = t.positive("tolerance");
  p.smoothing = t.positive("smoothing");
  p.end_time = read_end_time(scene, t);
  if (t.has("mesh_error")) p.mesh_error = t.positive("mesh_error");
  t.require("joints", "a table of joints");
  t.each("joints", [&](const std::string& name, const std::string& where, const Table& own) {
    p.joints.push_back(read_joint(name, where, own));
  });
  t.each("outputs", [&](const std::string& name, const std::string& where, const Table& own) {
    p.outputs.push_back(read_planned_output(name, where, own));
  });
  if (t.has("base")) {
    const Table base = t.table("base");
    if (base.has("attitude_wxyz")) p.attitude = read_attitude(base, "attitude_wxyz");
    p.base_weight = base.not_negative("rate_weight");
    p.base_where = base.where();
    if (base.has("attitude_limit")) {
      p.attitude_limit = base.positive("attitude_limit");
      if (!(*p.attitude_limit < phs::two_pi_hi / 2))
        base.fail("attitude_limit",
                  fmt::format("is {} rad, expected less than half a turn", *p.attitude_limit));
    }
    if (scene.urdf.base != mechanics::UrdfOptions::Base::free)
      refuse(base.where(),
             "[plan] base is given, but the base is \"fixed\", expected [model] base = \"free\"");
  }
  if (std::none_of(p.joints.begin(), p.joints.end(), [](const auto& j) { return j.actuated; }))
    refuse(t.where(), "[plan] has no actuated joint, expected one or more");
  return p;
}

PlanProblem plan_problem(const Scene& scene, const Assembly& a, const PlanScene& plan) {
  PlanProblem made;
  planning::Problem& p = made.problem;
  const auto& d = a.model->description();
  const size_t nx = size_t(d.nx);
  p.stages = integrators::gauss_stages(scene.method);
  p.duration = scene.duration;
  p.intervals = int(std::llround(scene.duration / scene.step));
  p.inputs = plan.inputs;
  p.start = phs::with_turns(d, a.initial);
  std::vector<double> end = p.start;
  std::vector<std::string> ports;
  std::vector<std::pair<double, double>> guesses;
  size_t nu = 0;
  for (const auto& j : plan.joints) nu += j.actuated;
  p.cost.rate.assign(nx, 0.0);
  for (const auto& j : plan.joints) {
    const Place at = place_of(a, j);
    p.cost.rate[size_t(at.q)] = j.rate_weight;
    if (j.position) {
      p.goals.push_back({{{at.q, 1.0}}, -1, *j.position});
      made.goal_names.push_back(j.name + ".position");
      end[size_t(at.q)] = *j.position;
    }
    if (j.rate) {
      p.goals.push_back({{}, at.q, *j.rate});
      made.goal_names.push_back(j.name + ".rate");
    }
    if (const double q = p.start[size_t(at.q)];
        (j.lower && q < *j.lower) || (j.upper && q > *j.upper))
      refuse(j.where, fmt::format("joint '{}' starts at {}, which is beyond its limits in [plan]",
                                  j.name, q));
    if (j.lower) set_limit(p.limits.state_lower, nx, -planning::no_limit, at.q, *j.lower);
    if (j.upper) set_limit(p.limits.state_upper, nx, planning::no_limit, at.q, *j.upper);
    if (j.rate_limit) set_limit(p.limits.rate, nx, planning::no_limit, at.q, *j.rate_limit);
    if (j.momentum_limit) {
      if (const double own = p.start[size_t(at.p)]; std::fabs(own) > *j.momentum_limit)
        refuse(j.where, fmt::format("joint '{}' starts with a momentum of {:.6g}, which is beyond "
                                    "its momentum_limit {} in [plan]",
                                    j.name, own, *j.momentum_limit));
      set_limit(p.limits.state_lower, nx, -planning::no_limit, at.p, -*j.momentum_limit);
      set_limit(p.limits.state_upper, nx, planning::no_limit, at.p, *j.momentum_limit);
    }
    if (!j.actuated) continue;
    const int input = int(ports.size());
    ports.push_back(at.port);
    made.inputs.push_back(j.name);
    p.cost.input.push_back(j.weight.value_or(j.rate_weight > 0 || j.drawn_weight > 0 ? 0 : 1));
    if (j.drawn_weight > 0) p.cost.drawn.push_back({input, at.q, j.drawn_weight, plan.smoothing});
    if (j.torque_limit) {
      set_limit(p.limits.input_lower, nu, -planning::no_limit, input, -*j.torque_limit);
      set_limit(p.limits.input_upper, nu, planning::no_limit, input, *j.torque_limit);
    }
    guesses.emplace_back(j.guess, j.guess_phase);
  }
  p.dynamics = planning::dynamics_of(a.model, ports);
  add_outputs(scene, a, plan.outputs, p, made.goal_names);
  plan_base(a, plan, made, end);
  check_path(p, a, plan);
  made.guess = planning::straight(p, end);
  bool waves = false;
  const size_t rows = made.guess.u.size() / nu;
  for (size_t i = 0; i < rows; ++i)
    for (size_t k = 0; k < nu; ++k)
      if (const auto [size, phase] = guesses[k]; size != 0) {
        made.guess.u[i * nu + k] =
            size * std::sin(phs::two_pi_hi * (double(i) + 0.5) / double(rows) + phase);
        waves = true;
      }
  if (waves) planning::follow_inputs(p, made.guess);
  return made;
}

}  // namespace porthos::scene
