#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <csignal>
#include <cstdio>
#include <exception>
#include <map>
#include <new>
#include <string>

#ifdef PORTHOS_GSL_RIVALS
#include "adapters/gsl/gsl.h"
#endif
#include "apps/command_line.h"
#include "apps/commands.h"
#include "apps/ending.h"
#include "apps/usage.h"
#include "phs/error.h"
#include "scene/session/info.h"

namespace {

using namespace porthos::apps;

int dispatch(const CLI::App& app, const Arguments& a) {
  const std::map<std::string, int (*)(const Arguments&)> commands{
      {"run", run_command},
      {"verify", verify_command},
      {"judge", judge_command},
      {"compare", compare_command},
      {"ensemble", ensemble_command},
      {"plan", plan_command},
      {"sensitivity", sensitivity_command},
      {"identify", identify_command},
      {"report", report_command},
      {"film", film_command},
      {"plot", plot_command},
      {"export", export_command},
      {"new", new_command},
      {"schema", schema_command},
      {"info", info_command},
      {"methods", methods_command},
      {"actuators", actuators_command}};
  const std::string name = app.get_subcommands()[0]->get_name();
  return name == "completion" ? completion_command(app, a) : commands.at(name)(a);
}

/// The build, and the consequences of its parts for its licence.
std::string version() {
  std::string text = porthos::scene::version_text();
#ifdef PORTHOS_GSL_RIVALS
  text +=
      "  licence   GPL-3 as a whole, as this build links GSL (porthos itself is BSD-3-Clause)\n";
#endif
  return text;
}

}  // namespace

int main(int argc, char** argv) {
  std::set_terminate(terminated);
  std::signal(SIGXFSZ, SIG_IGN);  // a file at its limit (ulimit -f) is a write that fails
#ifdef PORTHOS_GSL_RIVALS
  porthos::adapters::add_gsl_methods();
#endif
  Arguments arguments;
  CLI::App app("Port-Hamiltonian symplectic toolkit for articulated mechanisms and spacecraft",
               "porthos");
  app.set_version_flag("--version", version());
  app.footer(
      "Example:\n  porthos run examples/ets_vii/scene.toml\n\n"
      "Exit codes: 0 done or passed, 1 verdict failed, 2 bad input, 3 numerical failure, 4 not "
      "judged (no check tells of the motion, or the data do not decide one), 5 the machine refused "
      "(full disk, no memory), 130 interrupted.\n");
  app.require_subcommand(1);
  add_commands(app, arguments);
  if (argc == 1) {
    fmt::print(stderr, "{}", app.help());
    return exit_bad_input;
  }
  static char help[] = "--help";
  if (argv[1] == std::string("help")) {  // porthos help run: porthos run --help
    std::rotate(argv + 1, argv + 2, argv + argc);
    argv[argc - 1] = help;
  }
  if (const std::string why = unknown_command(app, argv[1]); !why.empty()) {
    fmt::print(stderr, "porthos: {} (see porthos --help)\n", why);
    return exit_bad_input;
  }
  try {
    app.parse(argc, argv);
    return dispatch(app, arguments);
  } catch (const CLI::Success& e) {  // --help and --version
    return app.exit(e);
  } catch (const CLI::ParseError& e) {
    fmt::print(stderr, "porthos: {} (see porthos --help)\n", usage_error(app, e));
  } catch (const porthos::InvalidArgument& e) {
    fmt::print(stderr, "porthos: {}\n", e.what());
  } catch (const porthos::IoError& e) {
    fmt::print(stderr, "porthos: {}\n", e.what());
    return exit_machine;
  } catch (const std::bad_alloc&) {
    no_memory();
  } catch (const std::exception& e) {
    fmt::print(stderr, "porthos: could not run: {}\n", e.what());
    return exit_machine;
  }
  return exit_bad_input;
}
