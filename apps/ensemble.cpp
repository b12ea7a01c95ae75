#include "apps/ensemble.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "apps/verdict.h"
#include "scene/files/text_table.h"
#include "scene/run/stop_values.h"

namespace porthos::apps {
namespace {

/// How many cases of a check a list tells.
std::int64_t cases_of(const std::string& check,
                      const std::vector<std::pair<std::string, std::int64_t>>& counts) {
  const auto known = std::ranges::find(counts, check, &std::pair<std::string, std::int64_t>::first);
  return known == counts.end() ? 0 : known->second;
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
  for (const scene::EventSpread& event : r.events)
    text += fmt::format(
        "{}: in {} of {} cases{}\n", event.name, event.happened, r.cases,
        event.happened == 0
            ? ""
            : fmt::format(", from {:g} to {:g} s, median {:g} s", event.time.quantiles[0],
                          event.time.quantiles[6], event.time.quantiles[3]));
  for (const auto& [why, count] : r.failures) text += fmt::format("{} cases: {}\n", count, why);
  std::vector<std::string> failed;
  for (const scene::Stop& stop : e.scene().stops) {
    if (!stop.is_requirement()) continue;
    const std::string name = scene::name_of_check(stop);
    const auto open = cases_of(name, r.not_judged_checks);
    text += fmt::format(
        "{}: does not hold in {} of {} cases{}{}\n", name, cases_of(name, r.failed_checks), r.cases,
        open > 0 ? fmt::format("; not judged: {} cases", open) : "", scene::worst_text(r, name));
  }
  for (const auto& [check, count] : r.failed_checks)
    failed.push_back(fmt::format("{} {}", check, count));
  if (!failed.empty()) text += fmt::format("failed: {}\n", fmt::join(failed, ", "));
  if (!r.not_passed.empty())
    text += fmt::format("not passed: {}{}\n", fmt::join(r.not_passed, ", "),
                        r.cases - r.passed > std::int64_t(r.not_passed.size()) ? ", ..." : "") +
            fmt::format("            their checks: porthos run SCENE --case {}\n", r.not_passed[0]);
  if (r.run_here > 0) text += fmt::format("{} cases in {:.1f} s\n", r.run_here, r.wall_s);
  text += fmt::format("results     {}/: ensemble.h5, ensemble.json, ensemble.svg{}\n", out,
                      page ? ", report.html" : "");
  if (r.not_judged > 0)
    text += fmt::format("{} cases are not judged: no check tells of their motion\n", r.not_judged);
  return text + fmt::format("verdict     {}: {} of {} cases passed\n", verdict_word(r.verdict()),
                            r.passed, r.cases);
}

}  // namespace porthos::apps
