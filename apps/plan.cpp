#include <fmt/ranges.h>

#include <cmath>

#include "apps/command_tools.h"
#include "apps/output.h"
#include "scene/assemble/model_notes.h"
#include "scene/files/files.h"
#include "scene/plan/plan.h"

namespace porthos::apps {
namespace {

std::string plan_text(const scene::PlanReport& r, const std::string& title,
                      const std::string& out) {
  const auto& p = r.plan;
  std::string text = fmt::format(
      "{}\n{} over {:g} s, {:.0f} steps of {} by {}\n\n"
      "cost        {:.10g}\n"
      "iterations  {}{}, {:.2f} s\n"
      "residual    {:.1e}: equations {:.1e}, stationarity {:.1e}, complementarity {:.1e}\n",
      title, r.inputs.size() == 1 ? "1 input" : fmt::format("{} inputs", r.inputs.size()),
      r.duration, r.duration / r.step, fmt::format("{:g} s", r.step), r.method, p.cost,
      p.approach > 0 ? fmt::format("{} + ", p.approach) : "", p.iterations, r.seconds, p.residual,
      p.defect, p.stationarity, p.complementarity);
  if (r.without_approach) text += "begun       at the straight line: the approach led nowhere\n";
  if (r.end_time)
    text += fmt::format("end time    {:.10g} s of free ones{}\n", r.duration,
                        r.duration == r.end_time->shortest  ? ", the shortest that is allowed"
                        : r.duration == r.end_time->longest ? ", the longest that is allowed"
                                                            : "");
  if (r.meshes.size() > 1)
    text +=
        fmt::format("meshes      {}, from steps of {:g} s; the cost changed by {:.1e} at last\n",
                    r.meshes.size(), r.meshes.front().step,
                    std::fabs(1 - r.meshes[r.meshes.size() - 2].cost / p.cost));
  if (p.active_limits > 0) text += fmt::format("limits      {} are reached\n", p.active_limits);
  for (const auto& note : r.notes) text += "note        " + note + "\n";
  if (p.status != planning::Plan::Status::optimal)
    return text + fmt::format(
                      "results     {}/: plan.json, plan.svg, motion.csv, costates.csv\n"
                      "no plan     {}{}{}\n"
                      "            may help: {}\n",
                      out, to_string(p.status), r.obstacles.empty() ? "" : ": ",
                      fmt::join(r.obstacles, "; "), scene::what_may_help);
  if (std::isfinite(r.replay))
    text += fmt::format(
        "replay      ends within {:.1e} of the plan, its energy balance closes to {:.1e}{}{}\n",
        r.replay, r.replay_energy,
        r.replay_energy > 1e-9 ? " (a shorter step or a higher order closes it better)" : "",
        r.replays() ? ": porthos verify " + r.replay_path : "");
  return text +
         fmt::format(
             "results     {}/: plan.json, plan.svg, motion.csv, costates.csv, replay.toml\n", out);
}

}  // namespace

int plan_command(const Arguments& a) {
  const scene::Scene s = read(a);
  const std::string out = a.out.value_or("results/" + name_of(a.scene) + "-plan");
  const scene::Assembly assembly = scene::assemble(s);
  scene::tell_notes(assembly, log);
  const scene::PlanReport r = scene::plan(s, assembly, out, &stop_on_signals());
  print(a.json ? scene::read_file(out + "/plan.json") : plan_text(r, s.title, out));
  if (r.plan.status == planning::Plan::Status::stopped) return exit_interrupted;
  return r.replays() ? exit_ok : exit_numerical;
}

}  // namespace porthos::apps
