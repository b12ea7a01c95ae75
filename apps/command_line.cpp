#include "apps/command_line.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>

namespace porthos::apps {
namespace {

CLI::App* add_command(CLI::App& app, const char* name, const char* what, const char* examples) {
  CLI::App* c = app.add_subcommand(name, what);
  c->footer(fmt::format("Example:\n  {}\n", examples));
  return c;
}

CLI::App* add_scene_command(CLI::App& app, Arguments& a, const char* name, const char* what,
                            const char* examples) {
  CLI::App* c = add_command(app, name, what, examples);
  c->add_option("SCENE", a.scene, "scene file (TOML)")->required();
  return c;
}

/// An option with a value, which the help calls `type`.
CLI::Option* value(CLI::App* c, const char* name, auto& to, const std::string& what,
                   const char* type) {
  return c->add_option(name, to, what)->type_name(type);
}

/// An option with a list, separated by commas.
CLI::Option* add_list(CLI::App* c, const char* name, std::vector<std::string>& to, const char* what,
                      const char* type = "A,B,...") {
  return value(c, name, to, what, type)->delimiter(',')->allow_extra_args(false);
}

void add_results(CLI::App* c, Arguments& a, const char* default_out,
                 const char* json = "summary.json") {
  value(c, "--out", a.out, fmt::format("results folder [{}]", default_out), "DIR");
  c->add_flag("--json", a.json, fmt::format("print {} instead of the table", json));
  c->add_flag("--no-report", a.no_report, "do not write report.html");
}

void add_no_meshes(CLI::App* c, Arguments& a) {
  c->add_flag("--no-meshes", a.no_meshes, "report.html without the meshes of the model, smaller");
}

void add_numbers(CLI::App* c, Arguments& a) {
  value(c, "--method", a.method, "instead of the scene's, see: porthos methods", "M");
  value(c, "--step", a.step, "instead of the scene's [s]", "H");
  value(c, "--duration", a.duration, "instead of the scene's [s]", "T");
}

void add_overrides(CLI::App* c, Arguments& a) {
  c->add_flag("--resume", a.resume, "continue from the checkpoint in the results folder");
  add_numbers(c, a);
}

void add_case(CLI::App* c, Arguments& a) {
  value(c, "--case", a.of_case,
        "of the scene's [ensemble], or of its results in place of SCENE, from 0", "N");
}

/// Commands that take steps.
void add_runs(CLI::App& app, Arguments& a) {
  auto* run = add_scene_command(
      app, a, "run", "run a scene, record it and judge it",
      "porthos run examples/ets_vii/scene.toml --out results/ets_vii --step 0.1\n"
      "  porthos run examples/ets_vii/scene.toml --out results/ets_vii --step 0.1 --resume");
  add_results(run, a, "results/<name of the scene>");
  add_no_meshes(run, a);
  add_overrides(run, a);
  add_case(run, a);
  value(run, "--extend", a.extend, "continue the finished run in the folder to this time [s]", "T")
      ->excludes("--resume")
      ->excludes("--duration");

  auto* verify = add_scene_command(
      app, a, "verify", "run a scene with every check: energy, momenta, balance, symmetry",
      "porthos verify examples/ets_vii/scene.toml --duration 100");
  add_results(verify, a, "results/<name of the scene>-verify");
  add_no_meshes(verify, a);
  add_overrides(verify, a);
  add_case(verify, a);

  auto* judge = add_command(app, "judge", "judge a trajectory that another program made",
                            "porthos judge run.csv --model arm.urdf --map map.toml");
  judge->add_option("FILE", a.scene, "CSV with names in its first line, or HDF5")->required();
  value(judge, "--model", a.model, "URDF file", "M")->required();
  value(judge, "--map", a.map, "what the columns mean (TOML), see docs/judge.md", "FILE");
  add_results(judge, a, "results/<name of the file>-judge");

  auto* compare = add_scene_command(
      app, a, "compare", "speed against error of every applicable method, as table and plot",
      "porthos compare examples/ets_vii/scene.toml --methods gauss8,rk4");
  add_results(compare, a, "results/compare_<name of the run's folder>", "compare.json");
  value(compare, "--methods", a.methods, "some only, see: porthos methods", "A,B,...")
      ->delimiter(',');
  compare->add_flag("--all", a.all, "print every trial, as with --methods")->excludes("--json");
  value(compare, "--budget", a.budget, "CPU seconds for everything [120]", "S");
  value(compare, "--duration", a.duration, "instead of the scene's [s]", "T");

  auto* ensemble = add_scene_command(
      app, a, "ensemble", "the runs of a scene's [ensemble], in SIMD batches and threads",
      "porthos ensemble examples/ensemble/scene.toml --threads 2");
  value(ensemble, "--out", a.out, "results folder [results/<name of the scene>]", "DIR");
  add_numbers(ensemble, a);
  ensemble->add_flag("--json", a.json, "print ensemble.json instead of the table");
  ensemble->add_flag("--no-report", a.no_report, "do not write report.html");
  value(ensemble, "--threads", a.threads, "as many as the machine has [0]", "N");
  value(ensemble, "--part", a.part, "one part of a job array, 1/8 to 8/8", "K/N");
  ensemble->add_flag("--join", a.join, "put together what the parts have left in the folder");
  ensemble->add_flag("--resume", a.resume, "run the cases that are missing in the folder");
}

void add_plan_and_sensitivity(CLI::App& app, Arguments& a) {
  auto* plan = add_scene_command(
      app, a, "plan", "the joint torques of a scene's [plan], and a scene to replay them",
      "porthos plan examples/ets_vii_reorientation/scene.toml");
  value(plan, "--out", a.out, "results folder [results/<name of the scene>-plan]", "DIR");
  add_numbers(plan, a);
  plan->add_flag("--json", a.json, "print plan.json instead of the summary");
  auto* sensitivity = add_scene_command(
      app, a, "sensitivity", "on which parameters and start values the end of a run depends",
      "porthos sensitivity examples/ets_vii/scene.toml --duration 50 --of base.attitude.z");
  add_list(sensitivity, "--of", a.of,
           "outputs, joint_1.position, base.attitude.x, energy, ... [the outputs, or the places]");
  add_list(sensitivity, "--by", a.by,
           "inputs by name, by differences of whole runs: base (its ten numbers), link_2.mass, "
           "spring.stiffness, controller[0].kp, joint_1.velocity, ... [all, by the adjoint]");
  value(sensitivity, "--threads", a.threads, "of differences, as many as the machine has [0]", "N");
  value(sensitivity, "--uncertainty", a.uncertainty,
        "relative standard deviation of every parameter: 0.01 for 1 %", "R");
  value(sensitivity, "--out", a.out, "results folder [results/<name of the scene>-sensitivity]",
        "DIR");
  value(sensitivity, "--top", a.top, "rows of each kind in the table [6]", "N");
  add_numbers(sensitivity, a);
  add_case(sensitivity, a);
  sensitivity->add_flag("--json", a.json, "print sensitivity.json instead of the table");
}

void add_film(CLI::App& app, Arguments& a) {
  auto* film =
      add_command(app, "film", "a film or a picture of the playback, by Chromium or Chrome",
                  "porthos film results/capture --from 20 --to 40 --speed 2");
  film->add_option("DIR", a.scene, "results folder of run or verify, or a report.html")->required();
  value(film, "--out", a.out, "FILE.mp4, or FILE.png: a picture at --from [DIR/film.mp4]", "FILE");
  value(film, "--from", a.from, "simulated time [the beginning]", "T");
  value(film, "--to", a.to, "simulated time [the end]", "T");
  value(film, "--speed", a.speed, "simulated seconds per second [the whole in 20 s]", "R");
  value(film, "--size", a.size, "pixels [1280x720]", "WxH");
  film->add_option("--camera", a.camera, "from the side and above, or along an axis [iso]")
      ->check(CLI::IsMember({"iso", "x", "y", "z"}));
  film->add_option("--follow", a.follow,
                   "the base's place, the base, or the world [place; with --trail, and where "
                   "contacts touch the world, the world]")
      ->check(CLI::IsMember({"place", "base", "world"}));
  film->add_flag("--orbit", a.orbit, "planet and orbit in place of the mechanism");
  film->add_flag("--arrows", a.arrows, "of momenta, and of forces that outputs record");
  film->add_flag("--dark", a.dark, "on a dark ground");
  film->add_flag("--trail", a.trail, "whole paths, not their last part");
  add_list(film, "--trail-of", a.of,
           "links, the paths of whose origins are drawn [centres of mass of the last links]");
  film->add_flag("--no-text", a.no_text, "without the time in the corner");
  value(film, "--models", a.models, "where the model files are, to show their meshes", "FOLDER");
}

void add_identify(CLI::App& app, Arguments& a) {
  auto* identify = add_scene_command(
      app, a, "identify",
      "parameters of a scene from a log of its motion, and how well it tells them",
      "porthos identify examples/identification/scene.toml examples/identification/log.csv "
      "--parameters spring.stiffness,bearing.coulomb --sigma 1e-3");
  identify->add_option("LOG", a.log, "CSV with names in its first line, or HDF5")->required();
  add_list(identify, "--parameters", a.parameters,
           "what to find: link_6 (its ten numbers), link_6.mass, spring.stiffness, "
           "joint_1.velocity, ...")
      ->required();
  add_list(identify, "--sigma", a.sigma,
           "noise of the log, 1e-4 of all columns or joint_1.velocity=1e-4,... [from the residual]",
           "S");
  value(identify, "--out", a.out, "results folder [results/<name of the scene>-identified]", "DIR");
  value(identify, "--method", a.method, "instead of the scene's: gauss2 to gauss16, midpoint", "M");
  value(identify, "--step", a.step, "instead of the scene's [s]", "H");
  identify->add_flag("--json", a.json, "print identify.json instead of the table");
  identify->add_flag("--no-report", a.no_report, "do not write report.html");
}

/// Commands that show what a run left, what a scene holds or what the program can do.
void add_pages(CLI::App& app, Arguments& a) {
  auto* report = add_command(app, "report", "report.html of a results folder, finished or not",
                             "porthos report results/ets_vii");
  report->add_option("DIR", a.scene, "results folder of run, verify, compare or ensemble")
      ->required();
  value(report, "--out", a.out, "the page [DIR/report.html]", "FILE");
  add_no_meshes(report, a);
  value(report, "--models", a.models, "where the model files are, to show their meshes", "FOLDER")
      ->excludes("--no-meshes");
  add_film(app, a);
  auto* plot =
      add_command(app, "plot", "redraw the plots of results, or draw one panel for print",
                  "porthos plot results/ets_vii\n"
                  "  porthos plot results/ets_vii --what \"rates of joints\" --out rates.pdf");
  plot->add_option("DIR", a.scene, "results folder of a finished run, ensemble or comparison")
      ->required();
  value(plot, "--what", a.what, "energies, works, residual, motion, a panel or a line of it",
        "NAME");
  value(plot, "--from", a.from, "with --what: simulated time [the beginning]", "T");
  value(plot, "--to", a.to, "with --what: simulated time [the end]", "T");
  value(plot, "--out", a.out, "its file: .svg, .pdf or .png [DIR/figure_NAME.svg]", "FILE");
  auto* table = add_command(app, "export", "the time series of a finished run as a CSV table",
                            "porthos export results/ets_vii --columns state,energy_error");
  table->add_option("DIR", a.scene, "results folder of a finished run")->required();
  value(table, "--out", a.out, "the table [DIR/run.csv]", "FILE");
  add_list(table, "--columns", a.of, "series of run.h5 or groups of them [all]");

  add_scene_command(app, a, "info",
                    "what was assembled from a scene: states, ports, invariants, plan, cost",
                    "porthos info examples/ets_vii/scene.toml")
      ->add_flag("--json", a.json, "as one JSON object");
  auto* starter = add_command(app, "new", "a commented scene for a URDF file, which runs as it is",
                              "porthos new satellite.urdf --base free --out satellite/scene.toml");
  starter->add_option("URDF", a.scene, "model file")->required();
  value(starter, "--out", a.out, "the scene file [printed]", "FILE");
  value(starter, "--base", a.base,
        "fixed: stands in the world; free: floats [fixed, or free if no joint moves]", "B");
  add_command(app, "schema", "JSON schema of scene files, for editors",
              "porthos schema > scene.schema.json")
      ->add_flag("--markdown", a.markdown, "docs/scene_reference.md instead");
  add_command(app, "completion", "completion script for a shell",
              "porthos completion bash > ~/.local/share/bash-completion/completions/porthos")
      ->add_option("SHELL", a.scene, "bash, zsh or fish")
      ->required();
  auto* list = add_command(app, "methods", "the integrators and what they keep", "porthos methods");
  list->add_flag("--markdown", a.markdown, "as a page of the documentation");
  list->add_flag("--json", a.json, "as one JSON object")->excludes("--markdown");
  auto* actuators =
      add_command(app, "actuators", "the actuators of the catalogue, or the springs of a scene",
                  "porthos actuators scene.toml --plots springs");
  actuators->add_flag("--markdown", a.markdown, "as a page of the documentation");
  actuators->add_flag("--json", a.json, "as one JSON object")->excludes("--markdown");
  auto* plots = value(actuators, "--plots", a.plots, "write a plot of each into a folder", "DIR");
  actuators->add_option("SCENE", a.scene, "torque and stiffness of its actuators are drawn")
      ->needs(plots);
}

}  // namespace

void add_commands(CLI::App& app, Arguments& a) {
  add_runs(app, a);
  add_plan_and_sensitivity(app, a);
  add_identify(app, a);
  add_pages(app, a);
}

}  // namespace porthos::apps
