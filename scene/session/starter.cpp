#include "scene/session/starter.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <utility>

#include "scene/compare/trial.h"
#include "scene/files/files.h"
#include "scene/read/scene_texts.h"

namespace porthos::scene {
namespace {

using Base = mechanics::UrdfOptions::Base;

// Choices of the pilot runs, the preferred one first.
constexpr double durations[] = {20, 10, 5, 2, 1};  // s
constexpr const char* methods[] = {"gauss16", "gauss8"};
constexpr double steps[] = {0.1,   0.05,  0.02,   0.01,   0.005,
                            0.002, 0.001, 0.0005, 0.0002, 0.0001};  // s
constexpr double limit = 1e-11;                                     // of [verify] energy,
constexpr double written_limit = 1e-12;                             // and of its momenta and norms
constexpr double margin = 10;  // by which a pilot stays below them

// Work in evaluations of the field times degrees of freedom, about 0.2 microseconds each, so that
// the choice does not depend on the clock.
constexpr double most_work_of_a_run = 4e6, most_work_of_a_duration = 8e6;

/// Keys of [model] that a file may need to be accepted, from the fewest to the most.
struct Allowance {
  bool massless, unphysical;
};
constexpr Allowance allowances[] = {{false, false}, {false, true}, {true, false}, {true, true}};

/// What [model] needs so that a file is accepted.
struct Accepted {
  mechanics::UrdfResult model;
  Base base;
  Allowance allowance;
  std::vector<std::string> lock, light;   ///< joints, and a link without mass behind each
  std::vector<std::string> runaway = {};  ///< slides that nothing stops
  bool rigid = false;                     ///< no joint moves: it floats as one body
};

/// A TOML key: bare where it can be.
std::string key_of(const std::string& name) {
  const bool bare = !name.empty() && std::all_of(name.begin(), name.end(), [](unsigned char c) {
    return c < 128 && (std::isalnum(c) || c == '_' || c == '-');
  });
  if (bare) return name;
  std::string quoted = "\"";
  for (const char c : name)
    quoted += c == '"' || c == '\\' ? std::string("\\") + c : std::string(1, c);
  return quoted + "\"";
}

std::string text_of(const std::string& text) {
  std::string quoted = key_of(text);
  return quoted.front() == '"' ? quoted : "\"" + quoted + "\"";
}

std::string model_table(const std::string& shown, const Accepted& a) {
  std::string text = fmt::format("[model]\nurdf = {}\nbase = \"{}\"                   # {}\n",
                                 text_of(shown), a.base == Base::free ? "free" : "fixed",
                                 a.rigid ? "no joint of this file moves: it floats as one body"
                                 : a.base == Base::free
                                     ? "it floats; \"fixed\": the root link stands in the world"
                                     : "the root link stands in the world; \"free\": it floats");
  const auto quoted = [](const std::vector<std::string>& joints) {
    std::string names;
    for (const auto& joint : joints) add_to_list(names, text_of(joint));
    return names;
  };
  auto held = a.runaway;
  if (!held.empty())
    text += "# Held, as they slide far out of their limits, which only an [[element]] enforces: " +
            quoted(held) + "\n";
  if (!a.lock.empty())
    text += "# Held, as they move no mass until their links have some: " + quoted(a.lock) + "\n";
  held.insert(held.end(), a.lock.begin(), a.lock.end());
  if (!held.empty()) text += fmt::format("lock = [{}]\n", quoted(held));
  for (const auto& link : a.light)
    text += fmt::format(
        "# inertia.{} = {{ mass = 0.1, inertia = [1e-4, 1e-4, 1e-4, 0, 0, 0] }}   # kg, kg m^2\n",
        key_of(link));
  if (a.allowance.massless)
    text +=
        "links_without_inertia = \"massless\"   # moving links of this file have no <inertial>: "
        "they are frames without mass\n";
  if (a.allowance.unphysical)
    text +=
        "unphysical_inertia = \"accept\"     # inertias of this file break the triangle "
        "inequality\n";
  return text;
}

/// A start inside the limits: the wished one, or else their middle.
double start_of(const mechanics::JointProperties* p, double wish) {
  if (!p || !p->lower || !p->upper || !(*p->lower < *p->upper)) return wish;
  if (wish > *p->lower && wish < *p->upper) return wish;
  return std::round(500 * (*p->lower + *p->upper)) / 1000;
}

std::string joints(const mechanics::Mechanism& m, Base base) {
  std::string text;
  int k = 0;
  for (const auto& c : m.coordinates()) {
    const bool turns_freely = c.kind == phs::BlockKind::rotation;
    if (turns_freely && !(base == Base::free && c.joint == mechanics::base_joint_name))
      text += fmt::format(
          "joints.{} = {{ attitude_wxyz = [1, 0.2, 0, 0], angular_velocity = [0, 0, 0.1] }}   # "
          "normalised, rad/s\n",
          key_of(c.joint));
    if (c.nq != 1 || c.nv != 1) continue;
    const mechanics::JointProperties* own = nullptr;
    for (const auto& p : m.joint_properties())
      if (p.q == c.q) own = &p;
    const bool slides = c.unit == "m";
    const double wish = (slides ? 0.05 : 0.3) * (k % 2 ? -1 : 1);
    text += fmt::format("joints.{} = {{ position = {:g}, velocity = {:g} }}   # {}, {}/s\n",
                        key_of(c.name), start_of(own, wish),
                        base == Base::free ? (slides ? 0.01 : 0.05) * (k % 2 ? -1 : 1) : 0.0,
                        c.unit, c.unit);
    ++k;
  }
  return text;
}

/// A method and a step for a duration.
struct Pilot {
  std::string method;
  double step = 0, duration = 0, error = HUGE_VAL, work = HUGE_VAL;
  bool good = false;
  std::vector<double> end = {};  ///< the state there
};

/// Finds method, step and duration: the longest affordable duration, and, of the methods that keep
/// all limits over it with a margin, the one that needs the fewest evaluations.
class Search {
 public:
  Search(const Assembly& assembly, bool floats) : assembly_(assembly), floats_(floats) {}

  Pilot run() {
    for (const double duration : durations) {
      Pilot best;
      spent_ = 0;
      for (const char* method : methods) {
        const Pilot p = largest_step(method, duration);
        if (p.good && p.work < best.work) best = p;
      }
      if (best.good) return best;
    }
    return nearest_;
  }

 private:
  Pilot largest_step(const char* method, double duration) {
    for (const double step : steps) {
      if (spent_ > most_work_of_a_duration) break;
      const double quick = std::min(duration, std::max(1.0, 50 * step));
      Pilot p = attempt(method, step, quick);
      if (p.good && p.work * duration / quick > most_work_of_a_run) break;
      // A quarter first: a failure then costs less.
      for (const double longer : {duration / 4, duration})
        if (p.good && longer > p.duration) p = attempt(method, step, longer);
      if (p.good) return p;
    }
    return {};
  }
  Pilot attempt(const char* method, double step, double duration) {
    const Trial t =
        run_trial(assembly_, {method, step},
                  {.duration = duration, .cpu_limit = 4, .records = 1000, .repeat = false});
    const RunReport& r = t.report;
    Pilot p{method, step, duration};
    p.work = double(r.cost.evaluations) * std::max(1, assembly_.mechanism->nv());
    spent_ += p.work;
    if (!t.complete() || !std::isfinite(r.energy.max_rel_error)) return p;
    p.error = r.energy.max_rel_error;
    p.end = r.final_state.x;
    const double other =
        std::max({r.linear_momentum_error, r.angular_momentum_error, r.quaternion_norm_error});
    // If Newton's method is needed, the step is too long for symmetry to rounding.
    p.good = p.error * margin < limit && (!floats_ || other * margin < written_limit) &&
             r.cost.factorisations == 0;
    if (p.error < nearest_.error) nearest_ = p;
    return p;
  }

  const Assembly& assembly_;
  const bool floats_;
  Pilot nearest_;
  double spent_ = 0;
};

/// At least ten times x, rounded up to one digit.
double widened(double x) {
  const double unit = std::pow(10.0, std::floor(std::log10(10 * x)));
  return std::ceil(10 * x / unit) * unit;
}

/// The choice and its reason.
std::string method_tables(const Pilot& p, bool floats) {
  std::string text = "\n[integrator]\n";
  text += fmt::format(
      "# Found by pilot runs of {}: the largest step whose energy error stays {:g} times below "
      "the\n"
      "# limit over {:g} s; it was {:.1e}.{}\n",
      fmt::join(methods, " and "), margin, p.duration, p.error,
      p.good ? "" : " No step did: the smallest error seen, and a limit to match.");
  text += fmt::format(
      "method = \"{}\"              # porthos methods lists them, porthos compare THIS_FILE "
      "compares them\nstep = {:g}                      # s\n\n[run]\n",
      p.method, p.step);
  text += fmt::format("duration = {:g}                    # s{}\n", p.duration,
                      p.duration < durations[0] ? "; short, because the motion needs small steps: "
                                                  "a longer one wants its own pilot runs"
                                                : "");
  text +=
      fmt::format("record_every = {:g}              # s, in whole steps\n", std::max(p.step, 0.02));
  text += "\n[verify]                         # largest errors of a passing run, relative\n";
  text += fmt::format("energy = {:g}\n", p.good ? limit : std::max(limit, widened(p.error)));
  if (floats)
    text += fmt::format("linear_momentum = {0:g}\nangular_momentum = {0:g}\n", written_limit);
  return text + fmt::format("quaternion_norm = {:g}\n", written_limit);
}

/// The scene without the tables that say how it is run.
std::string head(const std::string& shown, const Accepted& a) {
  const bool floats = a.base == Base::free;
  const auto& m = a.model.mechanism;
  std::string text = fmt::format(
      "# porthos run THIS_FILE runs it; porthos info THIS_FILE says what it was assembled to.\n"
      "# Every key: docs/scene_reference.md. All numbers are in SI units.\ntitle = {}\n\n",
      text_of(m.name()));
  text += model_table(shown, a) + "\n[environment]\n";
  text += floats ? "gravity = \"none\"\n"
                 : "gravity = \"uniform\"\nvector = [0, 0, -9.81]           # m/s^2, world axes\n";
  text += "\n[initial]\n";
  if (floats)
    text +=
        "base.position = [0, 0, 0]               # m\nbase.attitude_wxyz = [1, 0, 0, 0]       # "
        "quaternion, base to world\n"
        "base.angular_velocity = [0, 0, 0.02]    # rad/s, in the base's own axes\n";
  return text + joints(m, a.base);
}

constexpr const char* tail =
    "\n# Things at joints, any number of them:\n"
    "# [[element]]\n# type = \"damper\"                # spring, friction, limits, force, "
    "dc_motor, controller, wheel\n"
    "# joint = \"a_joint\"\n# damping = 0.1                  # N m s/rad\n";

/// Slides that have left their limits by more than their range: nothing stops them.
std::vector<std::string> runaways(const mechanics::Mechanism& m, const std::vector<double>& x) {
  std::vector<std::string> names;
  for (const auto& j : m.joint_properties())
    if (j.turn < 0 && j.lower && j.upper && !x.empty() &&
        std::fabs(2 * x[size_t(j.q)] - *j.lower - *j.upper) > 3 * (*j.upper - *j.lower))
      names.push_back(j.joint);
  return names;
}

/// Finds the keys of [model]. @throws InvalidArgument with the message of the last attempt
Accepted accept(const std::string& content, const std::string& urdf, Base base,
                const std::vector<std::string>& runaway = {}) {
  std::vector<std::string> lock, light;
  while (true) {
    std::optional<mechanics::MasslessPart> massless;
    std::string refusal;
    for (const Allowance a : allowances) {
      mechanics::UrdfOptions options;
      options.base = base;
      options.locked = lock;
      options.locked.insert(options.locked.end(), runaway.begin(), runaway.end());
      if (a.massless) options.links_without_inertia = mechanics::UrdfOptions::NoInertia::massless;
      options.accept_unphysical_inertia = a.unphysical;
      try {
        return {mechanics::parse_urdf(content, urdf, options), base, a, lock, light, runaway};
      } catch (const mechanics::MasslessPart& e) {
        massless = e;
        refusal = e.what();
      } catch (const InvalidArgument& e) {
        refusal = e.what();
      }
    }
    if (!massless || massless->joint.empty() || massless->joint == mechanics::base_joint_name)
      throw InvalidArgument(
          refusal + (massless && base == Base::free
                         ? "; its root can stand in the world instead, with base = \"fixed\""
                         : ""));
    lock.push_back(massless->joint);
    if (!massless->links.empty()) light.push_back(massless->links.front());
  }
}

/// If no base is given: fixed, but a model without joints that move floats as one body.
Accepted accept(const std::string& content, const std::string& urdf, std::optional<Base> base) {
  if (base) return accept(content, urdf, *base);
  try {
    return accept(content, urdf, Base::fixed);
  } catch (const InvalidArgument& fixed) {
    std::optional<Accepted> floating;
    try {
      floating = accept(content, urdf, Base::free);
    } catch (const InvalidArgument&) {
    }
    if (!floating || floating->model.mechanism.nodes().size() != 1) throw;
    floating->rigid = true;
    return std::move(*floating);
  }
}

}  // namespace

std::string starter_scene(const std::string& urdf, const std::string& shown,
                          std::optional<Base> base) {
  const std::string content = read_file(urdf);
  Accepted accepted = accept(content, urdf, base);
  const bool floats = accepted.base == Base::free;
  std::string begin;
  const auto search = [&] {
    begin = head(shown, accepted);
    const auto scene = read_scene_again(
        "scene.toml",
        {begin + method_tables({methods[0], steps[0], durations[0]}, floats), content});
    return Search(assemble(scene), floats).run();
  };
  Pilot p = search();
  const auto& m = accepted.model.mechanism;
  const auto away = runaways(m, p.end);
  if (!away.empty() && away.size() < m.joint_properties().size()) {  // something is left that moves
    accepted = accept(content, urdf, accepted.base, away);
    p = search();
  }
  if (!(p.error < HUGE_VAL))
    throw InvalidArgument(
        fmt::format("{}: no pilot run of {} with steps from {:g} to {:g} s came to "
                    "its end, expected a model whose motion can be followed",
                    urdf, fmt::join(methods, " or "), steps[0], *std::rbegin(steps)));
  return begin + method_tables(p, floats) + tail;
}

}  // namespace porthos::scene
