#include "scene/plot/panel_plot.h"

#include <cmath>

#include "scene/plot/plot.h"
#include "scene/plot/shown.h"
#include "scene/plot/trace_plot.h"
#include "scene/run/record_log.h"
#include "scene/run/run_report.h"

namespace porthos::scene {
namespace {

/// Indices of the coordinates of a panel's hinges in the state, root to tip.
std::vector<size_t> hinges(const mechanics::Mechanism& m, const mechanics::Panel& p) {
  std::vector<size_t> at;
  for (int i = 1; i <= p.segments; ++i)
    for (const auto& c : m.coordinates())
      if (c.name == p.name + "_" + std::to_string(i)) at.push_back(size_t(c.q));
  return at;
}

/// Height of the tip over the plane of the root: segments of l/2, l, ..., l, l/2, each rotated by
/// the sum of the previous hinge angles.
double tip(const mechanics::Panel& p, const std::vector<size_t>& at, std::span<const double> x) {
  const double l = p.length / p.segments;
  double turn = 0, z = 0;
  for (size_t i = 0; i < at.size(); ++i) {
    turn += x[at[i]];
    z -= (i + 1 < at.size() ? l : l / 2) * std::sin(turn);
  }
  return z;
}

}  // namespace

std::string panel_plot(const Scene& scene, const Assembly& assembly, const RunReport& report,
                       const std::filesystem::path& log) {
  const auto& m = *assembly.mechanism;
  std::vector<std::vector<size_t>> at;
  TracePanel tips{"tip off its plane [m]", {}}, rates{"rates of the base [rad/s]", {}};
  for (const auto& p : scene.panels) {
    at.push_back(hinges(m, p));
    tips.lines.push_back({p.name});
  }
  int base = -1;
  for (const auto& c : m.coordinates())
    if (c.joint == mechanics::base_joint_name && c.kind == phs::BlockKind::rotation) base = c.v;
  if (base >= 0) rates.lines = {{"x"}, {"y"}, {"z"}};

  const RecordLayout layout(scene, assembly);
  std::vector<std::int64_t> turns(layout.turns);
  const auto shown = Shown::bands(report.records, most_shown);
  auto next = shown.rows().begin();
  std::int64_t k = 0;
  each_record(log, layout, [&](std::span<const double> row) {
    if (next == shown.rows().end() || k++ != *next) return;
    ++next;
    const double t = row[layout.time()];
    const auto x = row.subspan(layout.x(), layout.nx);
    for (size_t p = 0; p < at.size(); ++p) {
      tips.lines[p].t.push_back(t);
      tips.lines[p].value.push_back(tip(scene.panels[p], at[p], x));
    }
    if (base < 0) return;
    turns_of(layout, row, turns);
    const auto v = assembly.mechanical->rates(x.first(size_t(2 * m.nq())), turns);
    for (size_t c = 0; c < 3; ++c) {
      rates.lines[c].t.push_back(t);
      rates.lines[c].value.push_back(v[size_t(base) + c]);
    }
  });
  std::vector<TracePanel> panels{tips};
  if (base >= 0) panels.push_back(rates);
  shown.reduce(panels);
  return trace_plot(panels, scene.title, plot_subtitle(report));
}

}  // namespace porthos::scene
