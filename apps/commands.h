#pragma once
#include <optional>
#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace porthos::apps {

enum ExitCode {
  exit_ok = 0,
  exit_verdict_failed = 1,
  exit_bad_input = 2,
  exit_numerical = 3,
  exit_not_judged = 4,
  exit_machine = 5,  ///< a file that cannot be written, no memory
  exit_interrupted = 130
};

/// The arguments of all commands, as typed.
struct Arguments {
  std::string scene, model, log;
  std::optional<std::string> map, out, method, step, duration, extend, budget, plots, part, base,
      of_case, uncertainty, from, to, speed, size, camera, follow, what;
  std::vector<std::string> methods, models, of, by, parameters, sigma;
  bool resume = false, json = false, markdown = false, join = false, no_report = false,
       orbit = false, arrows = false, dark = false, trail = false, no_text = false, all = false,
       no_meshes = false;
  int threads = 0;
  std::optional<size_t> top;
};

/// Each prints its results to stdout, everything else to stderr, and returns the exit code.
/// @throws InvalidArgument for bad input
int run_command(const Arguments& arguments);
int verify_command(const Arguments& arguments);
int judge_command(const Arguments& arguments);
int compare_command(const Arguments& arguments);
int ensemble_command(const Arguments& arguments);
int plan_command(const Arguments& arguments);
int sensitivity_command(const Arguments& arguments);
int identify_command(const Arguments& arguments);
int report_command(const Arguments& arguments);
int film_command(const Arguments& arguments);
int plot_command(const Arguments& arguments);
int export_command(const Arguments& arguments);
int new_command(const Arguments& arguments);
int schema_command(const Arguments& arguments);
/// A script for a shell, made from the commands and options of `app` itself.
int completion_command(const CLI::App& app, const Arguments& arguments);
int info_command(const Arguments& arguments);
int methods_command(const Arguments& arguments);
int actuators_command(const Arguments& arguments);

}  // namespace porthos::apps
