#include "apps/ensemble.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "apps/verdict.h"
#include "scene/files/text_table.h"
#include "scene/run/stop_values.h"

namespace porthos::apps {
namespace {

/// Of each requirement its limit, the worst number at the records and in how many cases it fails.
std::string requirements_text(const scene::Ensemble& e, const scene::EnsembleReport& r) {
  scene::TextRows rows{
      {"requirement", "limit", "at the records", "in case", "fails", "not judged"}};
  for (const scene::Stop& stop : e.scene().stops) {
    if (!stop.is_requirement()) continue;
    const std::string name = scene::name_of_check(stop);
    const auto* failed = scene::find_kind(r.failed_checks, name);
    const auto* open = scene::find_kind(r.not_judged_checks, name);
    const auto worst = std::ranges::find(r.requirements, name, &scene::RequirementWorst::check);
    const bool known = worst != r.requirements.end();
    rows.push_back(
        {name, scene::limit_text(e, name),
         known ? fmt::format("{} {} {}", worst->above ? "largest" : "least", worst->output,
                             scene::with_unit(fmt::format("{:.4g}", worst->value), worst->unit))
               : "-",
         known ? std::to_string(worst->of_case) : "-",
         fmt::format("{} of {}", failed ? failed->count : 0, r.cases),
         std::to_string(open ? open->count : 0)});
  }
  return rows.size() > 1 ? scene::aligned(rows) + "\n" : "";
}

/// Why cases did not pass: of each kind the limit and the first cases.
std::string kinds_text(const scene::Ensemble& e, const scene::EnsembleReport& r) {
  scene::TextRows rows{{"not passed", "cases", "limit", "first of them"}};
  const auto add = [&](const std::vector<scene::CaseKind>& kinds, const char* what) {
    for (const scene::CaseKind& kind : kinds) {
      const std::string limit = scene::limit_text(e, kind.name);
      rows.push_back({kind.name + what, std::to_string(kind.count), limit.empty() ? "-" : limit,
                      fmt::format("{}{}", fmt::join(kind.first, ", "),
                                  kind.count > std::int64_t(kind.first.size()) ? ", ..." : "")});
    }
  };
  add(r.failures, "");
  add(r.failed_checks, "");
  add(r.not_judged_checks, ": not judged");
  if (rows.size() == 1) return "";
  std::string text = scene::aligned(rows);
  if (!r.not_passed.empty())
    text += fmt::format("one by itself: porthos run SCENE --case {}\n", r.not_passed[0]);
  return text + "\n";
}

/// When an event happened: once where it is the same in every case.
std::string event_text(const scene::EventSpread& event, std::int64_t cases) {
  const auto& at = event.time.quantiles;
  if (event.happened == cases && scene::same_in_every_case(at[0], at[6]))
    return fmt::format("in every case: {} at {:g} s\n", event.name, at[0]);
  if (event.happened == 0) return fmt::format("{}: in 0 of {} cases\n", event.name, cases);
  return fmt::format("{}: in {} of {} cases, from {:g} to {:g} s, median {:g} s\n", event.name,
                     event.happened, cases, at[0], at[6], at[3]);
}

}  // namespace

std::string ensemble_text(const scene::Ensemble& e, const scene::EnsembleReport& r,
                          const std::string& out, bool page) {
  std::string text = fmt::format("{}\n{} cases of {:g} s by {}, step {:g} s\n\n", e.scene().title,
                                 r.cases, e.scene().duration, e.scene().method, e.scene().step);
  if (!r.complete)
    return text +
           fmt::format("{} of {} cases are done; they wait in {}/parts\n", r.done, r.cases, out);
  scene::TextRows rows{{"relative error", "median", "95 % below", "largest", "limit", "case"}};
  const auto add = [&](const char* name, const scene::Spread& s,
                       const std::optional<double>& limit) {
    rows.push_back({name, fmt::format("{:.3g}", s.quantiles[3]),
                    fmt::format("{:.3g}", s.quantiles[5]), fmt::format("{:.3g}", s.quantiles[6]),
                    limit ? fmt::format("{:.3g}", *limit) : "-", std::to_string(s.worst)});
  };
  const auto& limits = e.scene().verify;
  add("energy", r.energy, limits.energy);
  const bool exact = scene::linear_momentum_is_structure(e.assembly());
  for (const auto& i : e.assembly().model->description().invariants) {
    if (i.name == "linear_momentum" && !exact)
      add("linear momentum", r.linear, limits.linear_momentum);
    if (i.name == "angular_momentum") add("angular momentum", r.angular, limits.angular_momentum);
  }
  text += scene::aligned(rows) + "\n";
  for (const std::string& note : {r.damage, r.left_over})
    if (!note.empty()) text += note + "\n";
  if (exact) text += "linear momentum: the centre of mass moved in closed form\n";
  for (const scene::EventSpread& event : r.events) text += event_text(event, r.cases);
  if (!r.events.empty()) text += "\n";
  text += requirements_text(e, r) + kinds_text(e, r);
  if (r.run_here > 0) text += fmt::format("{} cases in {:.1f} s\n", r.run_here, r.wall_s);
  text += fmt::format("results     {}/: ensemble.h5, ensemble.json, ensemble.svg{}\n", out,
                      page ? ", report.html" : "");
  if (r.not_judged > 0)
    text += fmt::format("{} cases are not judged: no check tells of their motion\n", r.not_judged);
  return text + fmt::format("verdict     {}: {} of {} cases passed\n", verdict_word(r.verdict()),
                            r.passed, r.cases);
}

}  // namespace porthos::apps
