#include "apps/commands.h"

#include <fmt/format.h>

#include <cmath>

#ifdef PORTHOS_MPI
#include "adapters/mpi/mpi.h"
#endif
#include "apps/command_tools.h"
#include "apps/ensemble.h"
#include "apps/output.h"
#include "apps/progress.h"
#include "apps/report.h"
#include "apps/verdict.h"
#include "report/report.h"
#include "scene/assemble/model_notes.h"
#include "scene/compare/auto_method.h"
#include "scene/compare/compare.h"
#include "scene/files/files.h"
#include "scene/run/verdict.h"
#include "scene/session/export.h"
#include "scene/session/extension.h"
#include "scene/session/info.h"
#include "scene/session/run.h"

namespace porthos::apps {
namespace {

std::string resume_line(const Arguments& a, const scene::RunOptions& o) {
  std::string line = fmt::format("porthos {} {} --out {}", o.check_symmetry ? "verify" : "run",
                                 quoted(a.scene), quoted(o.out));
  if (a.of_case) line += " --case " + quoted(*a.of_case);
  if (a.method) line += " --method " + quoted(*a.method);
  if (a.step) line += " --step " + quoted(*a.step);
  if (a.duration) line += " --duration " + quoted(*a.duration);
  return line + (a.extend ? " --extend " + quoted(*a.extend) : " --resume");
}

bool resumable(const std::string& method) {
  for (const auto& d : integrators::catalogue())
    if (d.name == method) return d.resumable;
  return false;
}

scene::RunReport run_with_progress(const scene::Scene& s, const scene::Assembly& assembly,
                                   scene::RunOptions options) {
  Progress progress;
  options.stop = &stop_on_signals();
  options.progress = [&](double fraction, double spent, double left) {
    progress.update(fraction, spent, left);
  };
  return scene::run(s, assembly, options);
}

int finish(const Arguments& a, const scene::RunOptions& options, const scene::RunReport& r) {
  if (r.interrupted) {
    log(resumable(r.method)
            ? fmt::format("interrupted after {} steps, checkpoint saved; continue with: {}",
                          r.steps, resume_line(a, options))
            : fmt::format("interrupted after {} steps; {} cannot resume, run it again", r.steps,
                          r.method));
    return exit_interrupted;
  }
  if (r.outcome != integrators::Outcome::ok) {
    log(fmt::format(
        "stopped after {} steps at t = {} s: {}; the last good state is in {}/checkpoint", r.steps,
        r.simulated_s, scene::ending(r), options.out));
    return exit_numerical;
  }
  return exit_code(r.verdict());
}

int run_and_judge(const Arguments& a, scene::RunOptions options) {
  scene::Scene s = read(a);
  const auto end = seconds("extend", a.extend);
  if (end) scene::extend_to(s, options.out, *end);
  const scene::Assembly assembly = scene::assemble(s);
  if (end) {
    scene::reopen(options.out, s, assembly);
    options.resume = true;
  }
  scene::tell_notes(assembly, log);
  options.say = log;
  const scene::RunReport r = run_with_progress(s, assembly, options);
  const bool report = !r.interrupted && make_report(a, options.out, report::model_folders(s));
  if (!r.interrupted)
    print(a.json ? scene::read_file(options.out + "/summary.json")
                 : verdict_text(r, options.out, report));
  return finish(a, options, r);
}

}  // namespace

int run_command(const Arguments& a) {
  scene::RunOptions options;
  options.out = a.out.value_or(default_out(a));
  options.resume = a.resume;
  return run_and_judge(a, options);
}

int verify_command(const Arguments& a) {
  scene::RunOptions options;
  options.out = a.out.value_or(default_out(a) + "-verify");
  options.resume = a.resume;
  options.check_symmetry = true;
  return run_and_judge(a, options);
}

int compare_command(const Arguments& a) {
  const scene::Scene s = scene_of(a.scene);
  const scene::Assembly assembly = scene::assemble(s);
  const std::string out = a.out.value_or("results/compare_" + name_of(a.scene));
  scene::CompareOptions options;
  options.methods = a.methods;
  options.duration = seconds("duration", a.duration);
  options.budget_s = seconds("budget", a.budget).value_or(options.budget_s);
  scene::check(options);
  scene::make_folder(out);  // finds a folder that cannot be written before the run
  options.stop = &stop_on_signals();
  Progress progress;
  options.progress = [&](double fraction, double spent, double left) {
    progress.update(fraction, spent, left);
  };
  const scene::Comparison c = scene::compare(s, assembly, options);
  progress.finish();
  scene::write_comparison(out, s, c);
  const bool report = make_report(a, out);
  log(fmt::format("{}/: compare.json, compare.txt, work_precision.svg{}", out,
                  report ? ", report.html" : ""));
  const bool whole = a.all || !a.methods.empty();
  const auto rows = whole ? scene::TrialRows::all : scene::TrialRows::nearest;
  print(a.json ? scene::comparison_json(s, c) : scene::comparison_table(s, c, rows));
  if (!c.interrupted) return exit_ok;
  log("interrupted: the results are of the trials until then");
  return exit_interrupted;
}

int ensemble_command(const Arguments& a) {
#ifdef PORTHOS_MPI
  const adapters::MpiRank rank;  // only rank 0 prints
#endif
  scene::EnsembleOptions options;
  options.out = a.out.value_or("results/" + name_of(a.scene));
  if (a.part) options.part = scene::part_of(*a.part);
  options.resume = a.resume;
  options.join = a.join;
  if (a.join && (a.part || a.resume))
    throw InvalidArgument("--join runs nothing: expected neither --part nor --resume with it");
  if (a.threads < 0)
    throw InvalidArgument(
        fmt::format("--threads: threads is {}, expected 1 or more, or 0", a.threads));
  options.threads = a.threads;
  const scene::Scene given = read(a);
#ifdef PORTHOS_MPI
  if (given.method == scene::auto_method)
    throw InvalidArgument(
        "method = \"auto\" with mpirun: ranks share no folder to keep a choice in, expected the "
        "method that porthos run chose");
#endif
  const scene::Ensemble ensemble(scene::with_method_kept(given, options.out));
  options.stop = &stop_on_signals();
  Progress progress;
  options.progress = [&](double fraction, double spent, double left) {
    progress.update(fraction, spent, left);
  };
#ifdef PORTHOS_MPI
  const auto report = adapters::run_ensemble(rank, ensemble, options);
  if (!report) return exit_ok;
  const scene::EnsembleReport& r = *report;
#else
  const scene::EnsembleReport r = scene::run_ensemble(ensemble, options);
#endif
  progress.finish();
  if (r.interrupted) {
    log(fmt::format("interrupted with {} of {} cases done; continue with --resume", r.done,
                    r.cases));
    return exit_interrupted;
  }
  const bool page = r.complete && make_report(a, options.out);
  if (a.json && r.complete)
    print(scene::read_file(options.out + "/ensemble.json"));
  else
    print(ensemble_text(ensemble, r, options.out, page));
  return r.complete ? exit_code(r.verdict()) : exit_ok;
}

int export_command(const Arguments& a) {
  const std::string to = a.out.value_or(a.scene + "/run.csv");
  scene::export_csv(a.scene, to, a.of);
  print(to + "\n");
  return exit_ok;
}

int info_command(const Arguments& a) {
  const scene::Scene s = read(a);
  const scene::Assembly assembly = scene::assemble(s);
  print(a.json ? scene::info_json(s, assembly) : scene::info_text(s, assembly));
  return exit_ok;
}

}  // namespace porthos::apps
