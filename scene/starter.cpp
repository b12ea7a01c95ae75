#include "scene/starter.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "scene/files.h"
#include "scene/scene_texts.h"
#include "scene/trial.h"

namespace porthos::scene {
namespace {

using Base = mechanics::UrdfOptions::Base;

constexpr double duration = 20;        // s
constexpr double good_enough = 1e-13;  // relative energy error of a trial: rounding

/// What [model] may have to say so that a file is accepted, from the least to the most.
struct Allowance {
  bool massless, unphysical;
};
constexpr Allowance allowances[] = {{false, false}, {false, true}, {true, false}, {true, true}};

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

std::string model_table(const std::string& shown, Base base, Allowance a) {
  std::string text =
      fmt::format("[model]\nurdf = {}\nbase = \"{}\"                   # {}\n", text_of(shown),
                  base == Base::free ? "free" : "fixed",
                  base == Base::free ? "it floats; \"fixed\": the root link stands in the world"
                                     : "the root link stands in the world; \"free\": it floats");
  if (a.massless)
    text +=
        "links_without_inertia = \"massless\"   # links of this file have no <inertial>: they are "
        "frames without mass\n";
  if (a.unphysical)
    text +=
        "unphysical_inertia = \"accept\"     # inertias of this file break the triangle "
        "inequality\n";
  return text;
}

/// A start inside the limits, away from where nothing would happen.
double start_of(const mechanics::JointProperties* p, double wish) {
  if (!p || !p->lower || !p->upper || !(*p->lower < *p->upper)) return wish;
  if (wish > *p->lower && wish < *p->upper) return wish;
  return std::round(500 * (*p->lower + *p->upper)) / 1000;
}

std::string joints(const mechanics::Mechanism& m, Base base) {
  std::string text;
  int k = 0;
  for (const auto& c : m.coordinates()) {
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

std::string write(const std::string& title, const std::string& shown, Base base, Allowance a,
                  const std::string& starts, double step) {
  const bool free = base == Base::free;
  std::string text = fmt::format(
      "# porthos run THIS_FILE runs it; porthos info THIS_FILE says what it was assembled to.\n"
      "# Every key: docs/scene_reference.md. All numbers are in SI units.\ntitle = {}\n\n",
      text_of(title));
  text += model_table(shown, base, a) + "\n[environment]\n";
  text += free ? "gravity = \"none\"\n"
               : "gravity = \"uniform\"\nvector = [0, 0, -9.81]           # m/s^2, world axes\n";
  text += "\n[initial]\n";
  if (free)
    text +=
        "base.position = [0, 0, 0]               # m\nbase.attitude_wxyz = [1, 0, 0, 0]       # "
        "quaternion, base to world\n"
        "base.angular_velocity = [0, 0, 0.02]    # rad/s, in the base's own axes\n";
  text += starts;
  text += fmt::format(
      "\n[integrator]\nmethod = \"gauss16\"              # porthos methods lists them, porthos "
      "compare THIS_FILE compares them\n"
      "step = {:g}                      # s\n\n[run]\nduration = {:g}                    # "
      "s\nrecord_every = {:g}              # s, in whole steps\n",
      step, duration, std::max(step, 0.02));
  text += "\n[verify]                         # largest errors of a passing run, relative\n";
  text += "energy = 1e-11\n";
  if (free) text += "linear_momentum = 1e-12\nangular_momentum = 1e-12\n";
  text +=
      "quaternion_norm = 1e-12\n\n"
      "# Things at joints, any number of them:\n"
      "# [[element]]\n# type = \"damper\"                # spring, friction, limits, force, "
      "dc_motor, controller, wheel\n"
      "# joint = \"a_joint\"\n# damping = 0.1                  # N m s/rad\n";
  return text;
}

}  // namespace

std::string starter_scene(const std::string& urdf, const std::string& shown, Base base) {
  const std::string content = read_file(urdf);
  std::string refusal;
  for (const Allowance a : allowances) {
    try {
      mechanics::UrdfOptions options;
      options.base = base;
      options.links_without_inertia = a.massless ? mechanics::UrdfOptions::NoInertia::massless
                                                 : mechanics::UrdfOptions::NoInertia::error;
      options.accept_unphysical_inertia = a.unphysical;
      const auto model = mechanics::parse_urdf(content, urdf, options);
      const auto& m = model.mechanism;
      if (m.nq() == 0)
        throw InvalidArgument(
            urdf +
            ": the model has no joint that moves and stands in the world, expected --base free");
      const std::string starts = joints(m, base);
      for (const double step :
           {0.1, 0.05, 0.02, 0.01, 0.005, 0.002, 0.001, 0.0005, 0.0002, 0.0001}) {
        const std::string text = write(m.name(), shown, base, a, starts, step);
        const Scene scene = read_scene_again("scene.toml", {text, content});
        const auto t =
            run_trial(assemble(scene), {scene.method, step},
                      {.duration = std::max(2.0, 50 * step), .cpu_limit = 2, .repeat = false});
        const bool good = t.complete() && t.report.energy.max_rel_error < good_enough;
        if (good || step == 0.0001) return text;
      }
    } catch (const InvalidArgument& e) {
      refusal = e.what();
    }
  }
  throw InvalidArgument(refusal);
}

}  // namespace porthos::scene
