#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numeric>
#include <set>

#include "phs/scalars/pack.h"
#include "scene/assemble/assembly.h"
#include "scene/assemble/outputs.h"
#include "scene/assemble/steps.h"
#include "scene/build_info.h"
#include "scene/compare/auto_method.h"
#include "scene/files/text_table.h"
#include "scene/session/info.h"

namespace porthos::scene {
namespace {

std::string simd_text() {
  return fmt::format("{}, {} numbers at once, multiply-adds {}", phs::simd_name, phs::native_lanes,
                     phs::fuses ? "fused" : "rounded twice");
}

using mechanics::Mechanism;
using phs::BlockKind;

// --- the model -----------------------------------------------------------------------------------

struct Merging {
  int links = 0, to_world = 0, to_parent = 0;
};

Merging count_merged(const Mechanism& m) {
  Merging n;
  std::set<int> carried;
  for (const auto& b : m.bodies()) {
    ++n.links;
    if (b.node < 0)
      ++n.to_world;
    else if (!carried.insert(b.node).second)
      ++n.to_parent;
  }
  return n;
}

std::string merged_text(const Mechanism& m) {
  const Merging n = count_merged(m);
  if (n.to_parent + n.to_world == 0) return "none";
  return fmt::format("{} merged into the body that carries them, {} fixed to the world",
                     n.to_parent, n.to_world);
}

std::string model_section(const Scene& s, const Mechanism& m) {
  const bool free = s.urdf.base == mechanics::UrdfOptions::Base::free;
  return "Model\n" +
         aligned(
             {{"name", m.name()},
              {"file", s.urdf_path},
              {"base", free ? "free" : "fixed"},
              {"links", fmt::format("{}, in {} moving bodies", m.bodies().size(), m.body_count())},
              {"mass", fmt::format("{} kg (moving)", m.total_mass())},
              {"degrees of freedom", std::to_string(m.nv())}},
             "  ");
}

const char* name_of(BlockKind k) {
  return k == BlockKind::linear ? "linear" : k == BlockKind::angle ? "angle" : "rotation";
}

std::string numbers(const double* x, int n) {
  std::string text;
  for (int k = 0; k < n; ++k) text += fmt::format("{}{:.6g}", k ? " " : "", x[k] + 0.0);  // no -0
  return text;
}

std::string slice(int at, int size) {
  return size == 1 ? fmt::format("x[{}]", at) : fmt::format("x[{}..{}]", at, at + size - 1);
}

std::string states_section(const Assembly& a) {
  const auto& d = a.model->description();
  TextRows rows{
      {"name", "kind", "where", "unit", "momentum", "unit", "start", "momentum at start"}};
  WorldView view(a);
  const phs::State& s = view(0, a.initial);
  auto turns = s.turns.begin();
  for (const auto& b : d.blocks) {
    std::vector<double> start(&s.x[size_t(b.at)], &s.x[size_t(b.at)] + b.size);
    if (b.kind == BlockKind::angle) start[0] += phs::two_pi_hi * double(*turns++);
    const bool pair = b.momentum >= 0;
    rows.push_back({b.name, name_of(b.kind), slice(b.at, b.size), b.unit,
                    pair ? slice(b.momentum, b.size) : "-", b.momentum_unit,
                    numbers(start.data(), b.size),
                    pair ? numbers(&s.x[size_t(b.momentum)], b.size) : "-"});
  }
  return fmt::format("States, {} numbers\n", d.nx) + aligned(rows, "  ");
}

std::string ports_section(const phs::Description& d) {
  TextRows rows{{"name", "size", "input", "output"}};
  for (const auto& p : d.ports)
    rows.push_back({p.name, std::to_string(p.size), p.input_unit, p.output_unit});
  return "Ports\n" + aligned(rows, "  ");
}

std::string ledger_section(const phs::Description& d) {
  std::string stored;
  for (const auto& s : d.storages) add_to_list(stored, s);
  TextRows rows{{"stored", stored}};
  for (const auto& p : d.powers)
    if (p.kind != phs::PowerKind::observed)
      rows.push_back({p.kind == phs::PowerKind::supplied ? "supplied" : "dissipated", p.name});
  return "Energy accounts\n" + aligned(rows, "  ");
}

std::string invariants_section(const phs::Description& d) {
  TextRows rows{{"name", "size", "degree", "unit"}};
  rows.push_back(
      {"energy", "1", "-", d.powers.empty() ? "J" : "J (with what is supplied and dissipated)"});
  for (const auto& i : d.invariants)
    rows.push_back(
        {i.name, std::to_string(i.size), i.degree ? std::to_string(i.degree) : "-", i.unit});
  return "Invariants, without inputs\n" + aligned(rows, "  ");
}

/// The rows that close loops, and how many are independent at the start.
std::string constraints_section(const Assembly& a) {
  const auto& d = a.model->description();
  const auto system = a.model->instantiate<double>();
  const auto rows = system->constraints();
  if (!rows) return "";
  std::vector<double> g(size_t(rows->count()));
  rows->place(a.initial.x, g);
  const int rank = rows->factor(a.initial.x);
  TextRows table{{"name", "kind", "rows", "independent", "reaction"}};
  for (const auto& block : d.constraints) {
    int used = 0;
    bool unique = true;
    for (int r = block.at; r < block.at + block.size; ++r) {
      used += rows->uses(r);
      unique = unique && (rows->unique(r) || !rows->uses(r));
    }
    table.push_back({block.name, block.kind, std::to_string(block.size), std::to_string(used),
                     unique ? "unique" : "shared with others"});
  }
  return fmt::format("Constraints, {} rows of rank {} at the start, smallest pivot {:.3g}\n",
                     rows->count(), rank, rows->smallest_pivot()) +
         aligned(table, "  ");
}

// --- the plan ------------------------------------------------------------------------------------

template <class Has>
std::string joints_with(const Mechanism& m, Has has) {
  const auto& all = m.joint_properties();
  const auto n = std::count_if(all.begin(), all.end(), has);
  return n ? fmt::format("active in {} joint{}", n, n > 1 ? "s" : "") : "absent";
}

std::string gravity_text(const Scene& s, const Assembly& a) {
  if (s.orbit) return "active, of a planet, with its gradient on every link";
  const auto& g = s.urdf.gravity;
  if (mechanics::norm(g) == 0) return "absent";
  return fmt::format("{}uniform ({}, {}, {}) m/s^2",
                     a.centre ? "on the centre of mass alone, " : "active, ", g.x, g.y, g.z);
}

std::string translation_text(const Scene& s, const Assembly& a) {
  if (a.centre)
    return "none to integrate: the centre of mass moves in closed form, the motion about it is run";
  const std::string why = why_centre_stays(s);
  if (s.urdf.base != mechanics::UrdfOptions::Base::free) return "absent";
  if (s.orbit) return "none to integrate: the orbit of the centre of mass is split off";
  return "integrated with everything else: " + why;
}

std::string coordinates_text(const Assembly& a) {
  const std::string why = a.why_coordinates.empty() ? "" : "; chosen: " + a.why_coordinates;
  return (a.reduced ? "maximal: every body is free, every joint is a loop"
                    : "reduced: those of the joints") +
         why;
}

std::string plan_section(const Scene& s, const Assembly& a) {
  const Mechanism& m = *a.mechanism;
  const Steps steps = steps_of(s);
  const std::string last =
      steps.last > 0 ? fmt::format(", the last of {:g} s", steps.last) : std::string();
  return "Plan\n" +
         aligned({{"gravity", gravity_text(s, a)},
                  {"damping", joints_with(m, [](const auto& j) { return j.damping > 0; })},
                  {"springs", joints_with(m, [](const auto& j) { return j.stiffness > 0; })},
                  {"translation of the base", translation_text(s, a)},
                  {"coordinates", coordinates_text(a)},
                  {"links on fixed joints", merged_text(m)},
                  {"SIMD", simd_text()},
                  {"method", fmt::format("{}, {} steps of {} s{} = {} s", s.method, steps.total,
                                         s.step, last, steps.time(steps.total))},
                  {"chosen by", s.choice.empty() ? "the scene" : s.choice},
                  {"records", fmt::format("every {} s", double(steps.every) * s.step)}},
                 "  ");
}

std::string bound(const std::optional<double>& x, const char* none) {
  return x ? fmt::format("{}", *x) : none;
}

/// Joint properties in the file that the simulation leaves out.
std::string left_out_section(const Mechanism& m, bool friction) {
  TextRows rows;
  for (const auto& j : m.joint_properties()) {
    const bool turns = j.turn >= 0;
    if (j.lower || j.upper)
      rows.push_back(
          {j.joint, fmt::format("limits {} .. {} {}, not enforced", bound(j.lower, "-inf"),
                                bound(j.upper, "inf"), turns ? "rad" : "m")});
    if (j.friction > 0 && !friction)
      rows.push_back(
          {j.joint, fmt::format("friction {} {}, not simulated", j.friction, turns ? "N m" : "N")});
  }
  return rows.empty() ? "" : "In the URDF, not simulated\n" + aligned(rows, "  ");
}

std::string notes_section(const std::vector<mechanics::UrdfNote>& notes) {
  if (notes.empty()) return "";
  std::string text = "Notes\n";
  for (const auto& n : notes) text += fmt::format("  {}{}\n", in_file(n.where), n.text);
  return text;
}

std::string controllers_section(const Scene& scene, const Assembly& a) {
  if (a.certificates.empty()) return "";
  std::string text = "Controllers, and the conditions that were checked\n";
  for (size_t i = 0; i < a.certificates.size(); ++i) {
    const Controller& c = scene.controllers[i];
    text += fmt::format("{} ({}{}{})\n{}", c.name, c.type,
                        c.rate > 0 ? fmt::format(", at {:g} Hz", c.rate) : "",
                        c.tank ? fmt::format(", paid by a tank of {:g} J", c.tank->level) : "",
                        a.certificates[i].text());
  }
  return text;
}

std::string outputs_section(const Scene& scene, const Assembly& a) {
  if (scene.outputs.empty()) return "";
  std::vector<std::vector<std::string>> rows{{"name", "numbers", "unit"}};
  for (const OutputColumn& o : output_columns(scene, a))
    rows.push_back({o.name, std::to_string(o.size), o.unit});
  std::string text = "Outputs\n" + aligned(rows, "  ");
  for (const Stop& s : scene.stops)
    text += fmt::format("  the run ends{} where {} is {} {:g}\n", s.fails ? " and fails" : "",
                        s.output, s.above ? "above" : "below", s.limit);
  return text;
}

// --- cost ----------------------------------------------------------------------------------------

/// Median over batches of the time of one field evaluation [ns].
template <class T>
double nanoseconds_per_evaluation(const Assembly& a) {
  using Clock = std::chrono::steady_clock;
  const phs::Model& model = a.internal();
  const auto system = model.instantiate<T>();
  const auto end = a.initial.x.begin() + model.description().nx;
  std::vector<T> x(a.initial.x.begin(), end), dx(x.size());
  const auto batch = [&](int n) {
    const auto start = Clock::now();
    for (int i = 0; i < n; ++i) system->field(T(0.0), x, {}, dx);
    return std::chrono::duration<double, std::nano>(Clock::now() - start).count();
  };
  int n = 1;
  while (batch(n) < 1e6 && n < (1 << 24)) n *= 2;  // a batch takes a millisecond or more
  std::vector<double> times(31);
  for (double& t : times) t = batch(n) / n;
  std::nth_element(times.begin(), times.begin() + 15, times.end());
  return times[15];
}

std::string cost_section(const Assembly& a) {
  const double one = nanoseconds_per_evaluation<double>(a);
  const double lanes = nanoseconds_per_evaluation<phs::Pack8>(a);
  return fmt::format("Cost of one evaluation{}, measured now\n",
                     a.spacecraft ? " of the internal motion, which the split steps" : "") +
         aligned({{"one state", fmt::format("{:.0f} ns", one)},
                  {"SIMD batch of eight", fmt::format("{:.0f} ns each, {:.1f} times as fast",
                                                      lanes / 8, 8 * one / lanes)}},
                 "  ");
}

}  // namespace

std::string info_text(const Scene& asked, const Assembly& assembly) {
  const Scene scene = with_method_chosen(asked, assembly);
  (void)make_integrator(scene, *assembly.model, scene.step);  // refuses what a run would
  const Mechanism& m = *assembly.mechanism;
  const auto& d = assembly.model->description();
  std::string text = scene.title + "\n";
  for (const std::string& section :
       {model_section(scene, m), states_section(assembly), ports_section(d), ledger_section(d),
        invariants_section(d), constraints_section(assembly), plan_section(scene, assembly),
        controllers_section(scene, assembly), outputs_section(scene, assembly),
        left_out_section(m, scene.urdf.use_friction), notes_section(assembly.notes),
        cost_section(assembly)})
    if (!section.empty()) text += "\n" + section;
  return text;
}

std::string version_text() {
  return fmt::format("porthos {}\n", build::version) + aligned({{"commit", build::git_hash},
                                                                {"compiler", build::compiler},
                                                                {"flags", build::flags},
                                                                {"build", build::build_type},
                                                                {"SIMD", simd_text()}},
                                                               "  ");
}

}  // namespace porthos::scene
