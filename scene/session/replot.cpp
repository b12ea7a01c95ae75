#include "scene/session/replot.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>

#include "phs/error.h"
#include "phs/nearest.h"
#include "scene/assemble/outputs.h"
#include "scene/files/files.h"
#include "scene/plot/apart_by_size.h"
#include "scene/plot/plot.h"
#include "scene/run/columns.h"
#include "scene/session/detail/span.h"
#include "scene/session/detail/summary-inl.h"

namespace porthos::scene {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

/// The report as far as the pictures need it. Null figures (not finite) become 0.
RunReport report_of(const Json& s) {
  const auto number = [](const Json& j) { return j.is_number() ? j.get<double>() : 0.0; };
  RunReport r;
  r.title = s.at("title");
  r.method = s.at("method");
  if (s.contains("step_control"))
    r.step_control = integrators::step_control_of(s.at("step_control").get<std::string>());
  r.step_s = number(s.at("step_s"));
  r.simulated_s = number(s.at("simulated_s"));
  r.steps = std::int64_t(std::clamp(number(s.at("steps")), 0.0, 0x1p53));
  r.cpu_s = number(s.at("cpu_s"));
  r.energy.scale_J = number(s.at("energy").at("scale_J"));
  const Json& balance = s.at("balance");
  for (const auto& [key, list] :
       {std::pair{"storages", &r.storages}, {"ports", &r.ports}, {"losses", &r.losses}})
    for (const auto& [name, joule] : balance.at(key).items())
      list->emplace_back(name, number(joule));
  for (const auto& c : s.at("checks"))
    r.checks.push_back({c.at("name"), number(c.at("value")), number(c.at("limit")), c.at("pass"),
                        c.value("telling", true)});
  for (const auto& n : s.value("not_applicable", Json::array()))
    r.not_applicable.push_back(
        {n.value("name", ""), n.value("why", ""), n.value("undecided", false)});
  return r;
}

/// The series of a group, first those named in the report, in its order.
std::vector<LedgerLine> lines(const Records& records, const std::string& group,
                              const RunReport::Named& order, const std::vector<size_t>& shown) {
  std::vector<LedgerLine> all;
  std::set<std::string> taken;
  const auto add = [&](const std::string& name, const std::string& link) {
    if (!records.has(group + "/" + link) || !taken.insert(link).second) return;
    const auto v = records.column(group + "/" + link);
    LedgerLine line{name, {}};
    for (const size_t i : shown) line.value.push_back(v.at(i));
    all.push_back(std::move(line));
  };
  for (const auto& [name, joule] : order) add(name, link_name(name));
  for (const auto& name : records.names(group)) add(name, name);
  return all;
}

/// The span, or the whole if it has next to no records.
TimeSpan span_of(const std::vector<double>& t, const TimeSpan& span) {
  const auto inside = [&](double at) { return at >= span.from && at <= span.to; };
  return std::ranges::count_if(t, inside) < 2 ? TimeSpan{} : span;
}

TracePanel residual_of(const Records& records, const RunReport& r, const TimeSpan& asked = {}) {
  const auto t = records.column("time"), error = records.column("energy_error");
  const TimeSpan span = span_of(t, asked);
  // The distance of the records: a phase does not begin at 0.
  Envelope envelope(t.size() > 1 ? t[1] - t[0] : 1, std::fmin(r.simulated_s, span.to), span.from);
  for (size_t i = 0; i < t.size() && t[i] <= span.to; ++i)
    envelope.add(t[i], error[i] / r.energy.scale_J);
  std::optional<double> limit;
  for (const auto& c : r.checks)
    if (c.name == "energy") limit = c.limit;
  return residual_panel(envelope, limit);
}

/// Records in a span, thinned if it has many.
std::vector<size_t> shown_of(const std::vector<double>& t, const TimeSpan& span) {
  std::vector<size_t> inside, shown;
  for (size_t i = 0; i < t.size(); ++i)
    if (t[i] >= span.from && t[i] <= span.to) inside.push_back(i);
  for (const auto k : thinned(std::int64_t(inside.size()), most_of_ledger))
    shown.push_back(inside[size_t(k)]);
  return shown;
}

std::vector<std::string> replot_one(const fs::path& folder, const Json& summary,
                                    const mechanics::Mechanism* mechanism,
                                    const std::vector<Spring>& springs) {
  const RunReport r = report_of(summary);
  const auto records = open_run_file(folder / "run.h5");
  const auto draw = [&](const std::vector<TracePanel>& panels) {
    return trace_plot(panels, r.title, plot_subtitle(r));
  };
  const LedgerSeries series = ledger_of(*records, r);
  std::vector<std::pair<std::string, std::string>> pictures{
      {"energy_error.svg", draw({residual_of(*records, r)})},
      {"ledger.svg", ledger_plot(series, r.title, plot_subtitle(r))}};
  if (auto panels = mechanism ? apart_by_size(panels_of(*records, *mechanism, springs,
                                                        Shown::bands(records->count(), most_shown)))
                              : std::vector<TracePanel>();
      !panels.empty()) {
    for (TracePanel& p : panels) p.holes = series.holes;
    pictures.emplace_back("motion.svg", draw(panels));
  }
  write_together(folder, pictures);
  std::vector<std::string> files;
  for (const auto& [name, svg] : pictures) files.push_back((folder / name).string());
  return files;
}

/// None where the scene was made in code, or names tables that the results do not hold: then the
/// plot of the motion stays as the run has drawn it.
Moved moved_if_known(const fs::path& folder) {
  try {
    return moved_in(folder);
  } catch (const InvalidArgument&) {
    return {};
  }
}

/// "joints" of "joints [rad]"
std::string without_unit(const std::string& what) { return what.substr(0, what.find(" [")); }

/// Those of energies, works and residual in a run.h5, or a row of the ledger.
TracePanel balance_panel(const fs::path& part, const Json& summary, const std::string& what,
                         const TimeSpan& span) {
  const auto records = open_run_file(part / "run.h5");
  if (what == "residual") return residual_of(*records, report_of(summary), span);
  const LedgerSeries series = ledger_of(*records, report_of(summary), span);
  if (auto row = row_panel(series, what)) return std::move(*row);
  for (TracePanel& p : ledger_panels(series))
    if (without_unit(p.what) == what) {
      if (what == "works" && !p.lines.front().t.empty() && span.from > 0) count_anew(p);
      return std::move(p);
    }
  throw InvalidArgument(
      fmt::format("{} has no panel '{}': nothing is supplied or lost", part.string(), what));
}

bool has_row(const fs::path& part, const std::string& name) {
  const auto records = open_run_file(part / "run.h5");
  return std::ranges::any_of(std::array{"stored/", "supplied/", "dissipated/"},
                             [&](const char* of) { return records->has(of + link_name(name)); });
}

/// Whether the name is that of a panel or of a line.
bool is_in(const Motion& motion, const std::string& what) {
  return std::ranges::any_of(motion.panels, [&](const TracePanel& p) {
    return without_unit(p.what) == without_unit(what) ||
           std::ranges::find(p.lines, what, &TraceLine::name) != p.lines.end();
  });
}

/// A name in a list: in quotes if it has a comma of its own.
std::string in_list(const std::string& name) {
  return name.find(',') == name.npos ? name : "'" + name + "'";
}

/// The panel whose name alone begins so, or null.
const TracePanel* only_that_begins(const std::vector<TracePanel>& panels, const std::string& with) {
  const TracePanel* only = nullptr;
  for (const TracePanel& p : panels) {
    if (with.empty() || !p.what.starts_with(with)) continue;
    if (only) return nullptr;
    only = &p;
  }
  return only;
}

/// A panel found by its name; joints that turn often are in another.
TracePanel told(TracePanel p, const std::vector<TracePanel>& all) {
  const std::string name = without_unit(p.what);
  if (name != "joints" && name != "rates of joints") return p;
  std::string turning = p.what;
  turning.insert(turning.find("joints"), "turning ");
  for (const TracePanel& q : all)
    if (q.what == turning)
      p.others =
          fmt::format("{} {} in '{}'", q.lines.size(),
                      q.lines.size() == 1 ? "other is" : "others are", without_unit(turning));
  return p;
}

/// What a name means of the motion, or of the states: panels, the only one whose name begins so, or
/// a line alone. whole: the name of all. @throws InvalidArgument if nothing
std::vector<TracePanel> named(const Motion& motion, const std::string& what,
                              const std::string& whole) {
  if (what == whole) return motion.panels;
  std::string list = whole + ", energies, works, residual";
  std::vector<std::string> known{whole, "energies", "works", "residual"};
  std::vector<TracePanel> found;
  std::string full;  // names of what was found
  for (const TracePanel& p : motion.panels) {
    if (p.what == what) return {told(p, motion.panels)};
    if (without_unit(p.what) != without_unit(what)) continue;
    found.push_back(told(p, motion.panels));
    add_to_list(full, p.what);
  }
  if (found.size() > 1)
    throw InvalidArgument(
        fmt::format("what is '{}', the name of several panels, expected one of: {}", what, full));
  if (!found.empty()) return found;
  for (const TracePanel& p : motion.panels) {
    const std::string name = without_unit(p.what);
    const auto in_unit = [&](const std::string& title, const std::string& line) {
      const auto inside = p.what.substr(name.size() + 2, p.what.size() - name.size() - 3);
      return fmt::format("{} [{}]", title, unit_of_number(inside, line));
    };
    const bool twice = std::ranges::count_if(motion.panels, [&](const TracePanel& other) {
                         return without_unit(other.what) == name;
                       }) > 1;
    if (twice || std::ranges::find(known, name) == known.end())
      add_to_list(list, in_list(twice ? p.what : name));
    known.push_back(name);
    for (const TraceLine& l : p.lines) {
      if (name + "." + l.name == what) return {{in_unit(what, l.name), {l}}};
      known.push_back(l.name);
      if (l.name != what) continue;
      found.push_back({in_unit(l.name, l.name), {l}});
      add_to_list(full, name + "." + l.name);
    }
  }
  // joint_1 is the place, not the rate, as its panel comes first; x is of anything, and an actuator
  // has a line in each panel of springs.
  const auto parts = component_suffixes(6), four = component_suffixes(4);
  const bool of_any = std::ranges::count(parts, what) + std::ranges::count(four, what) > 0 ||
                      full.starts_with("deflections of springs.");
  if (found.size() == 1 || (!found.empty() && !of_any)) return {found[0]};
  if (!found.empty())
    throw InvalidArgument(
        fmt::format("what is '{}', a line of several panels, expected one of: {}", what, full));
  if (const TracePanel* only = only_that_begins(motion.panels, what))
    return {told(*only, motion.panels)};
  throw InvalidArgument(fmt::format("what is '{}', the nearest is '{}', expected {} or a line",
                                    what, nearest(what, Names(known.begin(), known.end())), list));
}

/// Panels of many lines as several below each other, as readable as the screen's.
std::vector<TracePanel> split(const std::vector<TracePanel>& panels) {
  std::vector<TracePanel> all;
  for (const TracePanel& p : panels)
    for (size_t from = 0; from < p.lines.size(); from += most_lines) {
      const size_t to = std::min(from + most_lines, p.lines.size());
      all.push_back(p);
      all.back().lines = {p.lines.begin() + long(from), p.lines.begin() + long(to)};
      if (to < p.lines.size()) all.back().others = "";
    }
  return all;
}

std::string motion_figure(const Motion& motion, const std::string& what, const std::string& whole,
                          const TimeSpan& span) {
  InSpan found;
  auto panels = cut(named(motion, what, whole), span, most_shown, found);
  for (TracePanel& p : panels) {
    p.holes = motion.holes;
    for (const TimeMark& m : motion.marks)
      if (m.t >= span.from && m.t <= span.to) p.marks.push_back(m);
  }
  refuse_fewer_than_two(found, span);
  return figure(split(panels));
}

}  // namespace

LedgerSeries ledger_of(const Records& records, const RunReport& r, const TimeSpan& span) {
  const auto t = records.column("time"), error = records.column("energy_error");
  const auto shown = shown_of(t, span_of(t, span));
  LedgerSeries s;
  s.holes = holes_in(records, r.method);
  for (const size_t i : shown) {
    s.t.push_back(t[i]);
    s.defect.push_back(error.at(i));
  }
  s.stored = lines(records, "stored", r.storages, shown);
  s.supplied = lines(records, "supplied", r.ports, shown);
  s.dissipated = lines(records, "dissipated", r.losses, shown);
  return s;
}

std::vector<std::string> replot(const fs::path& folder) {
  return of_summary(folder, [&](const Json& whole) {
    const Moved moved = moved_if_known(folder);
    const auto parts = parts_of(folder);
    std::vector<std::string> files;
    for (size_t k = 0; k < parts.size(); ++k) {
      const auto redraw = [&](const Json& summary) {
        return replot_one(parts[k], summary,
                          k < moved.mechanisms.size() ? moved.mechanisms[k].get() : nullptr,
                          moved.springs);
      };
      for (auto& f : parts[k] == folder ? redraw(whole) : of_summary(parts[k], redraw))
        files.push_back(std::move(f));
    }
    return files;
  });
}

std::vector<std::string> figures(const fs::path& folder, const std::string& what,
                                 const TimeSpan& span) {
  const std::int64_t most = span.whole() ? most_shown : std::numeric_limits<std::int64_t>::max();
  const std::string title = without_unit(what);
  require_finished(folder);
  const auto parts = parts_of(folder);
  const auto of_row = [&](const fs::path& part) { return has_row(part, what); };
  const bool panel = title == "energies" || title == "works" || title == "residual";
  if (!panel) {
    const bool states =
        title == "states" || title == "momenta" || (what != "motion" && !has_scene(folder));
    const Motion motion = states ? states_in(folder, most) : motion_in(folder, most);
    if (is_in(motion, what) || std::ranges::none_of(parts, of_row))
      return {motion_figure(motion, what, states ? "states" : "motion", span)};
  }
  std::vector<std::string> all;
  InSpan found;  // in all phases
  for (const fs::path& part : parts)
    all.push_back(of_summary(part, [&](const Json& s) {
      InSpan here;
      if (!panel && !of_row(part)) return std::string();
      const auto panels =
          cut({balance_panel(part, s, panel ? title : what, span)}, span, most_shown, here);
      found = {std::min(found.first, here.first), std::max(found.last, here.last),
               std::max(found.most, here.most)};
      return here.most > 1 ? figure(panels) : std::string();
    }));
  refuse_fewer_than_two(found, span);
  return all;
}

}  // namespace porthos::scene
