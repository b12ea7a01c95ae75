#include "scene/plot/ledger_plot.h"

#include <fmt/format.h>

namespace porthos::scene {

std::vector<TracePanel> ledger_panels(const LedgerSeries& s) {
  std::vector<TracePanel> panels;
  TracePanel energies{"energies [J]", {}}, works{"works [J]", {}};
  energies.stacked = true;
  for (const LedgerLine& l : s.stored) energies.lines.push_back({l.name, s.t, l.value});
  for (const LedgerLine& l : s.supplied) works.lines.push_back({l.name + " (in)", s.t, l.value});
  for (const LedgerLine& l : s.dissipated)
    works.lines.push_back({l.name + " (lost)", s.t, l.value});
  panels.push_back(std::move(energies));
  if (!works.lines.empty()) panels.push_back(std::move(works));
  for (TracePanel& panel : panels) panel.holes = s.holes;
  return panels;
}

std::optional<TracePanel> row_panel(const LedgerSeries& s, const std::string& name) {
  for (const auto* rows : {&s.stored, &s.supplied, &s.dissipated})
    for (const LedgerLine& l : *rows)
      if (l.name == name) {
        TracePanel p{name + " [J]", {{name, s.t, l.value}}};
        p.holes = s.holes;
        return p;
      }
  return {};
}

void count_anew(TracePanel& works) {
  works.what = fmt::format("works since {:.6g} s [J]", works.lines.front().t.front());
  for (TraceLine& l : works.lines) {
    const double before = l.value.front();
    for (double& w : l.value) w -= before;
  }
}

std::string ledger_plot(const LedgerSeries& series, const std::string& title,
                        const std::string& subtitle) {
  auto panels = ledger_panels(series);
  panels.push_back({"residual [J]", {{"residual of the balance", series.t, series.defect}}});
  panels.back().holes = series.holes;
  return trace_plot(panels, title, subtitle);
}

}  // namespace porthos::scene
