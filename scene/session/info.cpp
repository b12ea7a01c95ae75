#include <fmt/format.h>
#include <fmt/ranges.h>

#include "scene/assemble/assembly.h"
#include "scene/assemble/outputs.h"
#include "scene/build_info.h"
#include "scene/compare/auto_method.h"
#include "scene/files/text_table.h"
#include "scene/session/detail/info_facts.h"
#include "scene/session/info.h"

namespace porthos::scene {
namespace {

using mechanics::Mechanism;

// --- the model -----------------------------------------------------------------------------------

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

std::string numbers(const std::vector<double>& x) {
  return fmt::format("{:.6g}", fmt::join(x, " "));
}

std::string slice(int at, int size) {
  return size == 1 ? fmt::format("x[{}]", at) : fmt::format("x[{}..{}]", at, at + size - 1);
}

std::string states_section(const Assembly& a) {
  const auto& d = a.model->description();
  TextRows rows{
      {"name", "kind", "where", "unit", "momentum", "unit", "start", "momentum at start"}};
  for (const StateFacts& b : state_facts(a)) {
    const bool pair = b.block->momentum >= 0;
    rows.push_back({b.block->name, b.kind, slice(b.block->at, b.block->size), b.block->unit,
                    pair ? slice(b.block->momentum, b.block->size) : "-", b.block->momentum_unit,
                    numbers(b.start), pair ? numbers(b.momentum) : "-"});
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
  const auto facts = constraint_facts(a);
  if (!facts) return "";
  TextRows table{{"name", "kind", "rows", "independent", "reaction"}};
  for (const auto& b : facts->blocks)
    table.push_back({b.name, b.kind, std::to_string(b.rows), std::to_string(b.independent),
                     b.unique ? "unique" : "shared with others"});
  return fmt::format("Constraints, {} rows of rank {} at the start, smallest pivot {:.3g}\n",
                     facts->rows, facts->rank, facts->pivot) +
         aligned(table, "  ");
}

std::string bound(const std::optional<double>& x, const char* none) {
  return x ? fmt::format("{}", *x) : none;
}

/// Joint properties in the file that the simulation leaves out.
std::string left_out_section(const Mechanism& m, bool friction) {
  TextRows rows;
  for (const LeftOut& j : left_out_facts(m, friction)) {
    if (j.lower || j.upper)
      rows.push_back({j.joint, fmt::format("limits {} .. {} {}, not enforced",
                                           bound(j.lower, "-inf"), bound(j.upper, "inf"), j.unit)});
    if (j.friction > 0)
      rows.push_back(
          {j.joint, fmt::format("friction {} {}, not simulated", j.friction, j.friction_unit)});
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
    text += fmt::format("  the run {} where {} is {} {:g}\n",
                        !s.ends   ? "fails at its end"
                        : s.fails ? "ends and fails"
                                  : "ends",
                        s.output, s.above ? "above" : "below", s.limit);
  return text;
}

std::string events_section(const Scene& scene, const Assembly& a) {
  TextRows rows;
  for (const EventFacts& e : event_facts(scene, a))
    rows.push_back({e.what, e.when,
                    (e.apart ? fmt::format("{:.4g} m apart at the start", *e.apart) : "") +
                        (e.reach ? fmt::format(", reach {:g} m", *e.reach) : "")});
  return rows.empty() ? "" : "Events\n" + aligned(rows, "  ");
}

// --- cost ----------------------------------------------------------------------------------------

std::string cost_section(const Assembly& a) {
  const EvaluationCost ns = evaluation_cost(a);
  return fmt::format("Cost of one evaluation{}, measured now\n",
                     a.spacecraft ? " of the internal motion, which the split steps" : "") +
         aligned({{"one state", fmt::format("{:.0f} ns", ns.one)},
                  {"SIMD batch of eight", fmt::format("{:.0f} ns each, {:.1f} times as fast",
                                                      ns.of_eight, ns.one / ns.of_eight)}},
                 "  ");
}

}  // namespace

std::string info_text(const Scene& asked, const Assembly& assembly) {
  const Scene scene = with_method_chosen(asked, assembly);
  refuse_as_run(scene, assembly);
  const Mechanism& m = *assembly.mechanism;
  const auto& d = assembly.model->description();
  std::string text = scene.title + "\n";
  for (const std::string& section :
       {model_section(scene, m), states_section(assembly), ports_section(d), ledger_section(d),
        invariants_section(d), constraints_section(assembly),
        "Plan\n" + aligned(plan_rows(scene, assembly), "  "), controllers_section(scene, assembly),
        events_section(scene, assembly), outputs_section(scene, assembly),
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
