#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "apps/command_tools.h"
#include "apps/output.h"
#include "phs/error.h"
#include "scene/files/files.h"
#include "scene/files/hdf5_file.h"
#include "scene/files/text_table.h"
#include "scene/plot/actuator_plot.h"
#include "vsa/catalogue.h"

namespace porthos::apps {
namespace {

std::string numbers(const vsa::Quantity& q) {
  if (q.value.size() == 1) return fmt::format("{:.7g}", q.value[0]);
  if (q.value.size() <= 4) return fmt::format("{:.7g}", fmt::join(q.value, ", "));
  return fmt::format("{} numbers, {:.4g} to {:.4g}", q.value.size(),
                     *std::min_element(q.value.begin(), q.value.end()),
                     *std::max_element(q.value.begin(), q.value.end()));
}

std::string rows(const char* heading, const std::vector<vsa::Quantity>& list) {
  if (list.empty()) return "";
  std::string text =
      fmt::format("\n| {} | value | unit | from | source |\n|---|---|---|---|---|\n", heading);
  for (const auto& q : list)
    text += fmt::format("| {} | {} | {} | {} | {} |\n", q.name, numbers(q), q.unit,
                        vsa::to_string(q.provenance), q.source);
  return text;
}

vsa::Provenance least_certain(const vsa::Device& d) {
  auto worst = vsa::Provenance::published;
  for (const auto& p : d.parameters) worst = std::max(worst, p.provenance);
  return worst;
}

nlohmann::ordered_json quantities(const std::vector<vsa::Quantity>& list) {
  auto j = nlohmann::ordered_json::array();
  for (const auto& q : list)
    j.push_back({{"name", q.name},
                 {"value", q.value},
                 {"unit", q.unit},
                 {"from", vsa::to_string(q.provenance)},
                 {"source", q.source}});
  return j;
}

constexpr const char* own_energy =
    "\n## An energy of your own\n"
    "`family = \"formula\"` takes any energy E(φ, σ) as a text. Its parameters have names "
    "of your choice:\n\n"
    "```toml\n[[actuator]]\njoint = \"elbow\"\nfamily = \"formula\"\n"
    "energy = \"0.5*(k0 + k1*sigma^2)*phi^2 + a*phi^4\"     # J, of phi and sigma\n"
    "parameters = { k0 = 5.0, k1 = 20.0, a = 3.0 }\nlimits = { sigma = [0, 1] }\n"
    "theta = { drive = \"fixed\" }\nsigma = { drive = \"fixed\", start = 0.5 }\n```\n\n"
    "* A formula has numbers, names, `pi`, brackets, `+ - * / ^` with constant exponents, and "
    "`sqrt exp log sin cos tan sinh cosh tanh atan abs min max`.\n"
    "* Porthos differentiates it exactly: torque, stiffness and effort of the stiffness port are "
    "those of this energy, in every method. A step allocates nothing.\n"
    "* `limits` state where it holds: the range of σ (required where the energy depends on σ) "
    "and the deflection (±π without a limit; with one a stop begins there, and `stop_stiffness` is "
    "its constant [N m/rad²], above 0). There the energy, its slopes and second "
    "derivatives must be finite, and the stiffness 0 or more. Porthos checks this at 201 "
    "deflections times 21 σ, and refuses an energy with a place that fails or with a pole between "
    "them. An energy that is odd "
    "in φ is likely a torque: state its integral over φ.\n"
    "* `abs`, `min` and `max` have kinks. Raise them to a power of 3 or more, as "
    "`max(sigma - phi, 0)^3` of a slack tendon: the stiffness then has no jump. At a power of "
    "3 the third derivative jumps still, which costs the order too, and so on to a power of 6: a "
    "run whose energy fails for it says so. A torque "
    "that jumps is refused, a stiffness that jumps is told in a note: steps over a kink lose their "
    "order, so take small steps, `method = \"gonzalez\"`, which keeps the energy whatever its "
    "shape, or `\"auto\"`; or round the corner, `sqrt(x^2 + d^2)` for `abs(x)`.\n\n"
    "Python takes a text or a function: `porthos.vsa.formula` "
    "([python.md](python.md#controllers-and-actuators)). Tutorial: "
    "[tutorials/actuator.md](tutorials/actuator.md#your-energy).\n";

constexpr const char* creeping_motors =
    "`coulomb` of a drive is smoothed friction, which holds no load: under a torque T "
    "below it the motor creeps at `smoothing` · artanh(T / `coulomb`), 0.55 `smoothing` "
    "at half of it. Steps resolve its slope up to 2 n² J `smoothing` / `coulomb`; a run "
    "that fails by longer ones names this step. A motor that must stick is a link of the "
    "model with n² J about its joint and "
    "[`dry_friction`](contact.md#joints-with-dry-friction) there; the joint behind it "
    "has the spring, an `[[element]]`. A joint that is to stay where it is can be locked "
    "by an [`[[event]]`](scene.md#event).\n\n";

constexpr const char* ledger_rows =
    "Rows of the ledger, as `<name>.theta.torque`; an [`[[output]]`](scene.md#output) of "
    "`quantity = \"power\"` or `\"energy\"` takes them:\n\n"
    "| drive of `theta` | stored | supplied | dissipated |\n|---|---|---|---|\n"
    "| `fixed` | - | - | - |\n"
    "| `torque` | `rotor` | `theta.torque` | `theta.viscous`, `theta.friction`, `theta.brake` |\n"
    "| `position` | `rotor` | `theta.controller` | the same |\n"
    "| `rate` | - | `theta.rate` | - |\n"
    "| `servo` | - | `theta.servo` | - |\n\n"
    "Those of σ are `sigma_rotor` and `sigma.torque` ... `sigma.brake`. `viscous`, `friction` "
    "and `brake` are there if `viscous`, `coulomb` and `rate_limit` are given. Besides: `spring` "
    "(stored, with its limits), `damping` (dissipated) and `damper`: it is commanded, so it "
    "is among the supplied, with work of 0 or less.\n\n";

std::string actuators_text() {
  scene::TextRows table{{"name", "family", "parameters", "what"}};
  for (const auto& d : vsa::devices())
    table.push_back({d.name, d.family.empty() ? "-" : d.family,
                     d.family.empty() ? "not public" : vsa::to_string(least_certain(d)), d.title});
  return scene::aligned(table) +
         "\nparameters: the least certain of them. Details and sources: porthos actuators "
         "--markdown\n";
}

std::string actuators_json() {
  using Json = nlohmann::ordered_json;
  Json families = Json::array(), devices = Json::array();
  for (const auto& f : vsa::families()) {
    Json keys = Json::array();
    for (const auto& k : f.keys)
      keys.push_back(
          {{"name", k.name}, {"unit", k.unit}, {"list", k.list}, {"optional", k.optional}});
    families.push_back({{"name", f.name}, {"parameters", keys}});
  }
  for (const auto& d : vsa::devices()) {
    const bool known = !d.family.empty();
    devices.push_back({{"name", d.name},
                       {"what", d.title},
                       {"family", known ? Json(d.family) : Json()},
                       {"least_certain", known ? Json(vsa::to_string(least_certain(d))) : Json()},
                       {"parameters", quantities(d.parameters)},
                       {"limits", quantities(d.stops)},
                       {"datasheet", quantities(d.datasheet)},
                       {"remark", d.remark}});
  }
  return Json{{"families", families}, {"devices", devices}}.dump(2) + "\n";
}

std::string actuators_markdown() {
  std::string text =
      "# Actuators\n\n"
      "Generated by `porthos actuators --markdown` (pictures: `porthos actuators --plots "
      "docs/images/actuators`); a test keeps "
      "it so.\n\n"
      "A joint with a qbmove whose motors follow a torque and whose stiffness is wound by a worm "
      "gear:\n\n"
      "```toml\n[[actuator]]\njoint = \"elbow\"\ndevice = \"qbmove_advanced\"\n"
      "theta = { drive = \"torque\", command = { sine = { amplitude = 0.5, frequency = 0.4 } }, "
      "inertia = 0.003 }\n"
      "sigma = { drive = \"rate\", command = { constant = 0.05 }, start = 0.1 }\n```\n\n"
      "All keys: [scene.md](scene.md). `porthos actuators SCENE --plots DIR` draws the springs of "
      "a scene "
      "as the pictures here. Examples: `examples/vsa_cycle`, `examples/qbmove_arm`, "
      "`examples/throwing_arm`.\n\n"
      "## How it works\n"
      "One elastic energy E(q, θ, σ) per actuator: q the joint, θ the equilibrium a motor sets, σ "
      "what sets the stiffness; φ = q - θ. "
      "The torque on the link is -∂E/∂q, on the motor -∂E/∂θ, and\nthe drive that moves σ works "
      "against the torque ∂E/∂σ: the **stiffness port**. "
      "Stiffening a loaded spring takes work, and the ledger shows it. A model in which a signal "
      "changes k creates that energy from "
      "nothing, ∮ ½ k' φ² dθ a cycle\n(`tests/vsa/actuator_test.cpp` measures both). Limits of "
      "deflection are energies too, "
      "⅓ k d³ beyond: nothing is clipped.\n\n"
      "Rotors count by ½ n² J θ'² (Spong 1987). The gyroscopic moment of a rotor on a moving link "
      "is neglected, except for rotors that are bodies of the mechanism (`vsa/rotor_body.h`). "
      "Two equal motors "
      "at θ ± σ are one of 2 J at θ and one of 2 J at σ.\n\n";
  text += creeping_motors;
  text += ledger_rows;
  text +=
      "Planning in C++: constant-energy paths and resonance tuning (`vsa/planning.h`), changes of "
      "stiffness that take the least electrical energy, with the torque that runs them "
      "(`vsa/minimum_energy.h`).\n\n"
      "## Families\n`family = \"...\"` with `parameters = { ... }`. Formulas and sources: "
      "`vsa/families.h`, `vsa/table.h`.\n\n"
      "| family | parameters [unit] |\n|---|---|\n";
  for (const auto& f : vsa::families()) {
    std::string keys;
    for (const auto& k : f.keys)
      keys += fmt::format("{}`{}` [{}]{}", keys.empty() ? "" : ", ", k.name, k.unit,
                          k.optional ? " (optional)" : "");
    text += fmt::format("| `{}` | {} |\n", f.name, keys);
  }
  text += own_energy;
  text +=
      "\n## Devices\n`device = \"...\"`. Where each number comes from:\n\n"
      "* **published**: read in the source that is named.  **derived**: computed from such numbers "
      "by the model.\n"
      "* **from memory, unverified**: as remembered from the literature; unverified: do not use "
      "in design.\n"
      "* **chosen here**: no published number is known to us; a value to run the model with.\n";
  for (const auto& d : vsa::devices()) {
    text += fmt::format("\n### {}\n", d.title);
    if (d.family.empty()) {
      text += "No model: its parameters are not public.\n";
    } else {
      const auto e = vsa::elastic_of(d);
      text += fmt::format("`device = \"{}\"`, family `{}`{}. {}\n", d.name, d.family,
                          e->traits().sigma.empty() ? ""
                                                    : fmt::format("; σ: {} [{}]", e->traits().sigma,
                                                                  e->traits().sigma_unit),
                          d.remark);
      text += fmt::format(
          "\n![Torque and stiffness of {} against deflection](images/actuators/{}.svg)\n", d.title,
          d.name);
    }
    text +=
        rows("parameter", d.parameters) + rows("limit", d.stops) + rows("datasheet", d.datasheet);
  }
  return text;
}

void write_spring_plots(const scene::Scene& s, const std::string& folder) {
  if (s.actuators.empty())
    throw InvalidArgument(fmt::format("{} has no [[actuator]], expected one", s.path));
  scene::make_folder(folder);
  for (const auto& a : s.actuators)
    scene::write_file(folder + "/" + scene::link_name(a.name) + ".svg", scene::spring_plot(a));
}

void write_actuator_plots(const std::string& folder) {
  scene::make_folder(folder);
  for (const auto& d : vsa::devices())
    if (!d.family.empty())
      scene::write_file(folder + "/" + d.name + ".svg", scene::datasheet_plot(d));
}

}  // namespace

int actuators_command(const Arguments& a) {
  if (!a.scene.empty())
    write_spring_plots(read(a), *a.plots);
  else if (a.plots)
    write_actuator_plots(*a.plots);
  if (a.plots) return exit_ok;
  print(a.markdown ? actuators_markdown() : a.json ? actuators_json() : actuators_text());
  return exit_ok;
}

}  // namespace porthos::apps
