#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>

#include "integrators/core/integrator.h"
#include "tests/apps/pendulum.h"
#include "tests/places.h"
#ifdef PORTHOS_GSL_RIVALS
#include "tests/support/gsl_methods.h"
#endif

/// The porthos command as a user meets it: exit codes, and what goes to stdout and to stderr.
namespace porthos::test::cli_test {
namespace {

namespace fs = std::filesystem;

constexpr const char* scene = R"(title = "Pendulum"
[model]
urdf = "pendulum.urdf"
base = "fixed"
[environment]
gravity = "uniform"
vector = [0, 0, -9.81]
[initial]
joints.hinge = { position = 1.0 }
[integrator]
method = "gauss8"
step = 0.01
[run]
duration = 2.0
[verify]
energy = 1e-11
)";

struct Answer {
  int code;
  std::string out, err;
};

std::string file_text(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

class Cli : public testing::Test {
 protected:
  void SetUp() override {
#ifndef PORTHOS_CLI
    GTEST_SKIP() << "built without the porthos command";
#endif
    folder_ = fs::path(testing::TempDir()) / ("porthos_cli_" + std::to_string(getpid()));
    fs::create_directories(folder_ / "swing");
    write("swing/scene.toml", scene);
    write("swing/pendulum.urdf", pendulum);
  }
  void TearDown() override {
    if (!folder_.empty()) fs::remove_all(folder_);
  }
  void write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
  }

  /// Runs the command in the test's folder; `before` goes in front of it.
  Answer porthos(const std::string& arguments, const std::string& before = "") const {
#ifdef PORTHOS_CLI
    const std::string command = "cd '" + folder_.string() + "' && " + before + " '" + PORTHOS_CLI +
                                "' " + arguments + " 2>stderr.txt </dev/null";
    FILE* pipe = popen(command.c_str(), "r");
    std::string out;
    char piece[4096];
    for (size_t n; (n = fread(piece, 1, sizeof piece, pipe)) > 0;) out.append(piece, n);
    const int status = pclose(pipe);
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, out, file_text(folder_ / "stderr.txt")};
#else
    return {-1, arguments, before};
#endif
  }

  fs::path folder_;
};

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

TEST_F(Cli, BadInputIsOneSentenceAndExitCode2) {
  write("bad.toml",
        "[model]\nurdf = \"swing/pendulum.urdf\"\nbase = \"fixed\"\n[integrator]\nstpe = 1\n");
  const std::pair<std::string, std::string> cases[] = {
      {"run absent.toml",
       "porthos: scene file 'absent.toml' cannot be opened: No such file or directory\n"},
      {"info absent.toml",
       "porthos: scene file 'absent.toml' cannot be opened: No such file or directory\n"},
      {"run bad.toml",
       "porthos: bad.toml:5:1: unknown key 'stpe' in [integrator], the nearest known one is 'step' "
       "(known: method, step, target_energy_error, rtol, iteration_tolerance, step_control, "
       "step_control_rate, "
       "step_control_length)\n"},
      {"run swing/scene.toml --step 0", "porthos: --step: step is 0 s, expected more than 0 s\n"},
      {"run swing/scene.toml --step -1", "porthos: --step: step is -1 s, expected more than 0 s\n"},
      {"run swing/scene.toml --step ''",
       "porthos: --step: step is '', expected a number of seconds\n"},
      {"run swing/scene.toml --duration 2m",
       "porthos: --duration: duration is '2m', expected a number of seconds\n"},
      {"run swing/scene.toml --duration nan",
       "porthos: --duration: duration is nan, expected a finite number of seconds\n"},
      {"run swing/scene.toml --duration 0.001",
       "porthos: --duration: duration is 0.001 s, expected at least one step of 0.01 s\n"},
      {"walk",
       "porthos: there is no command 'walk', expected one of run, verify, judge, compare, "
       "ensemble, plan, sensitivity, identify, report, film, plot, export, info, new, schema, "
       "completion, methods, actuators (see "
       "porthos "
       "--help)\n"},
      {"run swing/scene.toml --fast",
       "porthos: run has no option --fast, the nearest is --case (see porthos --help)\n"},
      {"run", "porthos: SCENE is required (see porthos --help)\n"},
      {"film swing --trail-of",
       "porthos: --trail-of: 1 required A,B,... missing (see porthos --help)\n"},
      {"film absent --trail --trail-of pendulum", "porthos: absent is no folder\n"},
      {"info swing/pendulum.urdf",
       "porthos: swing/pendulum.urdf is a model, expected a scene: porthos new "
       "swing/pendulum.urdf writes one\n"},
  };
  for (const auto& [arguments, message] : cases) {
    const Answer a = porthos(arguments);
    EXPECT_EQ(a.code, 2) << arguments;
    EXPECT_EQ(a.err, message) << arguments;
    EXPECT_EQ(a.out, "") << arguments;
  }
  EXPECT_FALSE(fs::exists(folder_ / "results")) << "nothing is made for bad input";
}

TEST_F(Cli, AnUnknownMethodNamesTheNearest) {
  const Answer a = porthos("run swing/scene.toml --method gauss17");
  EXPECT_EQ(a.code, 2);
  EXPECT_EQ(a.err,
            "porthos: --method: method is 'gauss17', expected 'gauss16' or another that porthos "
            "methods lists; one added by a program is known to that program alone\n");
}

TEST_F(Cli, MethodsPrintsTheCatalogue) {
  const Answer a = porthos("methods");
  EXPECT_EQ(a.code, 0);
  EXPECT_EQ(a.err, "");
  for (const auto& d : porthos::integrators::catalogue()) {
    EXPECT_TRUE(contains(a.out, "\n" + d.name + " ")) << d.name;
    EXPECT_TRUE(contains(a.out, d.title)) << d.title;
  }
}

TEST_F(Cli, ThePageOfMethodsIsTheCatalogue) {
#ifndef PORTHOS_GSL_RIVALS
  GTEST_SKIP() << "the page lists GSL's methods, which this build leaves out";
#endif
  std::ifstream page(std::string(PORTHOS_SOURCE_DIR) + "/docs/methods.md");
  const std::string text{std::istreambuf_iterator<char>(page), {}};
  EXPECT_EQ(porthos("methods --markdown").out, text)
      << "write it anew: porthos methods --markdown > docs/methods.md";
}

TEST_F(Cli, ThePageOfActuatorsIsTheCatalogue) {
  const auto read = [](const std::string& path) {
    std::ifstream file(path);
    return std::string{std::istreambuf_iterator<char>(file), {}};
  };
  const std::string docs = std::string(PORTHOS_SOURCE_DIR) + "/docs";
  EXPECT_EQ(porthos("actuators --markdown").out, read(docs + "/actuators.md"))
      << "write it anew: porthos actuators --markdown > docs/actuators.md";
  EXPECT_EQ(porthos("actuators --plots plots").code, 0);
  EXPECT_EQ(read((folder_ / "plots" / "qbmove_advanced.svg").string()),
            read(docs + "/images/actuators/qbmove_advanced.svg"))
      << "draw them anew: porthos actuators --plots docs/images/actuators";
  EXPECT_TRUE(contains(porthos("actuators").out, "\nqbmove_advanced "));
}

TEST_F(Cli, HelpHasAnExampleForEveryCommand) {
  for (const std::string command :
       {"", "run ", "verify ", "compare ", "info ", "methods ", "actuators "}) {
    const Answer a = porthos(command + "--help");
    EXPECT_EQ(a.code, 0) << command;
    EXPECT_TRUE(
        contains(a.out, "Example:\n  porthos " +
                            (command.empty() ? "run " : command.substr(0, command.size() - 1))))
        << a.out;
  }
}

TEST_F(Cli, HelpIsACommandToo) {
  EXPECT_EQ(porthos("help").out, porthos("--help").out);
  EXPECT_EQ(porthos("help export").out, porthos("export --help").out);
  EXPECT_EQ(porthos("help walk").code, 2);
}

TEST_F(Cli, VersionNamesTheBuild) {
  const Answer a = porthos("--version");
  EXPECT_EQ(a.code, 0);
  for (const char* part : {"porthos ", "commit", "compiler", "-ffp-contract=off"})
    EXPECT_TRUE(contains(a.out, part)) << part;
#ifdef PORTHOS_GSL_RIVALS
  const bool gpl = true;
#else
  const bool gpl = false;
#endif
  EXPECT_EQ(contains(a.out, "\n  licence   GPL-3 as a whole, as this build links GSL "), gpl)
      << a.out;
}

TEST_F(Cli, InfoGoesToStdout) {
  const Answer a = porthos("info swing/scene.toml");
  EXPECT_EQ(a.code, 0) << a.err;
  EXPECT_EQ(a.err, "");
  for (const char* part : {"Pendulum\n", "hinge.torque", "active, uniform (0, 0, -9.81) m/s^2",
                           "Cost of one evaluation"})
    EXPECT_TRUE(contains(a.out, part)) << part << "\n" << a.out;
}

TEST_F(Cli, PlansAndReplays) {
  Answer a = porthos("plan swing/scene.toml");
  EXPECT_EQ(a.code, 2);
  EXPECT_EQ(a.err,
            "porthos: swing/scene.toml:1:1: there is no [plan], expected a table with the key "
            "joints; see docs/planning.md\n");
  write("swing/plan.toml", std::string(scene) + "[plan.joints]\nhinge = { position = 2.0 }\n");
  a = porthos("plan swing/plan.toml --step 0.05 --out planned");
  EXPECT_EQ(a.code, 0) << a.err;
  for (const char* part : {"1 input over 2 s, 40 steps of 0.05 s by gauss8", "residual",
                           "porthos verify planned/replay.toml"})
    EXPECT_TRUE(contains(a.out, part)) << part << "\n" << a.out;
  a = porthos("plan swing/plan.toml --step 0.05 --out planned --json");
  EXPECT_TRUE(contains(a.out, "\"status\": \"optimal\"")) << a.out;
  write("swing/plan.toml", std::string(scene) + "[plan]\niterations = 1\napproach = false\n" +
                               "[plan.joints]\nhinge = { position = 2.0 }\n");
  a = porthos("plan swing/plan.toml --step 0.05 --out planned");
  EXPECT_EQ(a.code, 3) << a.err;
  EXPECT_TRUE(contains(a.out, "no plan     too many iterations: goal 'hinge")) << a.out;
  EXPECT_TRUE(contains(a.out, "is missed by ")) << a.out;
  EXPECT_FALSE(fs::exists(folder_ / "planned/replay.toml"));
}

TEST_F(Cli, TellsWhatTheEndDependsOn) {
  Answer a = porthos("sensitivity swing/scene.toml --of hinge.position,energy --uncertainty 0.01");
  EXPECT_EQ(a.code, 0) << a.err;
  EXPECT_EQ(a.err,
            "porthos: results/swing-sensitivity/: sensitivity.json, sensitivity.csv, "
            "sensitivity.txt, sensitivity.svg\n");
  for (const char* part : {"Pendulum: gauss8, 200 steps of 0.01 s, 2 s simulated", "hinge.position",
                           "energy = ", "slope x value", "standard deviation", ".mass"})
    EXPECT_TRUE(contains(a.out, part)) << part << "\n" << a.out;
  a = porthos("sensitivity swing/scene.toml --json --duration 1 --out told");
  const auto j = nlohmann::json::parse(a.out);
  EXPECT_EQ(j["of"].size(), 1U) << "the places, without any output";
  EXPECT_EQ(j["of"][0]["name"], "hinge.position");
  EXPECT_TRUE(fs::exists(folder_ / "told/sensitivity.svg"));
  const std::pair<const char*, const char*> wrong[] = {
      {"--of knee",
       "porthos: swing/scene.toml: there is no 'knee' at the end of a run, the nearest "
       "is 'energy': expected an output of places or rates, a place or rate of a joint or the "
       "base, or energy\n"},
      {"--uncertainty some",
       "porthos: --uncertainty: uncertainty is 'some', expected a number, "
       "relative to each parameter\n"},
      {"--method spark8",
       "porthos: derivatives of a run are there for Gauss collocation, Lobatto pairs, HBVM, "
       "discrete gradients, splittings, stormer_verlet, rk4, radau15, semi_implicit_euler and "
       "compositions (yoshida4 ...), not for 'spark8'; "
       "--by base.mass (by= in Python) takes differences of whole runs\n"}};
  for (const auto& [option, message] : wrong) {
    a = porthos(std::string("sensitivity swing/scene.toml --out wrong ") + option);
    EXPECT_EQ(a.code, 2) << option;
    EXPECT_EQ(a.err, message);
  }
  EXPECT_FALSE(fs::exists(folder_ / "wrong")) << "refused before the run";
  a = porthos("sensitivity swing/scene.toml --method rk4 --by hinge.velocity --json --out by_runs");
  EXPECT_EQ(a.code, 0) << a.err;
  const auto by = nlohmann::json::parse(a.out);
  EXPECT_EQ(by["runs"], 25);
  EXPECT_LT(by["of"][0]["errors"]["hinge.velocity"].get<double>(), 1e-9);
}

TEST_F(Cli, FindsParametersFromALog) {
  const Answer run = porthos("run swing/scene.toml --out seen --no-report");
  ASSERT_LE(run.code, 1) << run.err;
  Answer a =
      porthos("identify swing/scene.toml seen/run.h5 --parameters hinge.velocity --sigma 1e-4");
  EXPECT_EQ(a.code, 0) << a.err;
  EXPECT_TRUE(contains(a.err, "porthos: iteration 0, run 3: mean square ")) << a.err;
  EXPECT_TRUE(contains(a.err,
                       "porthos: results/swing-identified/: found.toml, identify.json, "
                       "identify.txt, identify.svg"))
      << a.err;
  for (const char* part : {"1 parameter from seen/run.h5", "hinge.velocity", "residual    chi^2",
                           "told        all combinations", "iterations, ", "not used: "})
    EXPECT_TRUE(contains(a.out, part)) << part << "\n" << a.out;
  a = porthos(
      "identify swing/scene.toml seen/run.h5 --parameters hinge.velocity --json --out told");
  const auto j = nlohmann::json::parse(a.out);
  EXPECT_EQ(j["parameters"][0]["name"], "hinge.velocity");
  EXPECT_TRUE(j["converged"]);
  EXPECT_TRUE(fs::exists(folder_ / "told/found.toml"));
  EXPECT_EQ(porthos("verify told/found.toml --no-report --out again").code,
            porthos("verify swing/scene.toml --no-report --out again2").code);
  const std::pair<const char*, const char*> wrong[] = {
      {"seen/none.csv --parameters hinge.velocity",
       "porthos: cannot read seen/none.csv: No such file or directory\n"},
      {"seen/run.h5 --parameters hinge.velocity --sigma hinge.position=much",
       "porthos: --sigma: sigma is 'much', expected a standard deviation in the unit of the "
       "column\n"},
      {"seen/run.h5 --parameters hinge.velocity --sigma 0",
       "porthos: sigma is 0, expected a positive number, the standard deviation of the noise in "
       "the unit of the column\n"},
      {"seen/run.h5 --parameters hinge.velocity --method rk4",
       "porthos: derivatives of a run are there for Gauss collocation (gauss2 to gauss16, "
       "midpoint), not for 'rk4'\n"}};
  for (const auto& [option, message] : wrong) {
    a = porthos(std::string("identify swing/scene.toml --out wrong ") + option);
    EXPECT_EQ(a.code, 2) << option;
    EXPECT_EQ(a.err, message);
  }
  EXPECT_FALSE(fs::exists(folder_ / "wrong")) << "refused before the run";
}

TEST_F(Cli, OutputThatCannotBeWrittenIsAnError) {
  const Answer a = porthos("methods >/dev/full");
  EXPECT_EQ(a.code, 5);
  EXPECT_EQ(a.err, "porthos: standard output cannot be written\n");
  const Answer b = porthos("run swing/scene.toml --out /proc/porthos");
  EXPECT_EQ(b.code, 5);
  EXPECT_TRUE(contains(b.err, "porthos: cannot make the folder /proc/porthos"));
}

TEST_F(Cli, RunPrintsAVerdictAndFillsTheDefaultFolder) {
  const Answer a = porthos("run swing/scene.toml");
  EXPECT_EQ(a.code, 0) << a.err;
  for (const char* part : {"Pendulum: gauss8, 200 steps of 0.01 s", "energy", "pass", "us per step",
                           "iterations per step", "results/swing/: summary.json, run.h5"})
    EXPECT_TRUE(contains(a.out, part)) << part << "\n" << a.out;
  EXPECT_TRUE(fs::exists(folder_ / "results/swing/summary.json"));
}

TEST_F(Cli, JsonIsTheSummaryAndNothingElse) {
  const Answer a = porthos(
      "run swing/scene.toml --json --out 'a folder' --method gauss4 --step 0.02 --duration 1");
  ASSERT_TRUE(a.code == 0 || a.code == 1) << a.err;
  const auto summary = nlohmann::json::parse(a.out);
  EXPECT_EQ(summary.at("method"), "gauss4");
  EXPECT_EQ(summary.at("step_s"), 0.02);
  EXPECT_EQ(summary.at("steps"), 50);
  EXPECT_EQ(a.out, file_text(folder_ / "a folder/summary.json"));
}

TEST_F(Cli, AFailedVerdictIsExitCode1) {
  const Answer a = porthos("run swing/scene.toml --method rk4 --step 0.1 --out failed");
  EXPECT_EQ(a.code, 1) << a.err;
  EXPECT_TRUE(contains(a.out, "FAIL")) << a.out;
}

TEST_F(Cli, VerifyUsesAFolderOfItsOwn) {
  const Answer a = porthos("verify swing/scene.toml");
  EXPECT_EQ(a.code, 0) << a.out << a.err;
  EXPECT_TRUE(contains(a.out, "symmetry")) << a.out;
  EXPECT_TRUE(fs::exists(folder_ / "results/swing-verify/summary.json"));
  EXPECT_FALSE(fs::exists(folder_ / "results/swing"));
}

TEST_F(Cli, NumericalFailureIsExitCode3) {
  const Answer a =
      porthos("run swing/scene.toml --method lobatto8 --step 50 --duration 5000 --out stuck");
  EXPECT_EQ(a.code, 3) << a.out << a.err;
  EXPECT_TRUE(contains(a.err, "did not converge")) << a.err;
  EXPECT_TRUE(contains(a.err, "the last good state is in stuck/checkpoint")) << a.err;
}

TEST_F(Cli, ARunThatEndedEarlySaysSoInWords) {
  const Answer a = porthos("run '" PORTHOS_SOURCE_DIR
                           "/examples/double_pendulum/scene.toml' --method rk4 --step 1.5 "
                           "--out wild");
  EXPECT_EQ(a.code, 3) << a.out << a.err;
  EXPECT_TRUE(contains(a.out, "end reached  no")) << a.out;
  EXPECT_TRUE(contains(a.out, "the error is as large as the energy itself, which overflowed"))
      << a.out;
  EXPECT_TRUE(contains(a.out, "expected a smaller step than 1.5 s")) << a.out;
  for (const char* raw : {"nan", "inf ", "outcome"}) EXPECT_FALSE(contains(a.out, raw)) << a.out;
}

/// A trajectory nearly at rest, with rows at equal intervals or not.
TEST_F(Cli, JudgeSaysWhyTheGrowthIsNotKnown) {
  const auto judged = [&](int bend) {
    std::string csv = "t,hinge,v.hinge\n";
    for (int i = 0; i < 9; ++i)
      csv += std::to_string(i + bend * i * i) + ",0.1," + (i % 2 ? "0" : "1e-6") + "\n";
    write("rows.csv", csv);
    return porthos("judge rows.csv --model swing/pendulum.urdf --no-report --out judged").out;
  };
  const std::string unequal = judged(1), equal = judged(0);
  const char* const why = "is known at unequal intervals, which do not tell how it grows";
  const char* const few = "has too few records to tell how it grows";
  EXPECT_TRUE(contains(unequal, why) && !contains(unequal, few)) << unequal;
  EXPECT_TRUE(contains(equal, few) && !contains(equal, why)) << equal;
  for (const auto& out : {unequal, equal}) EXPECT_FALSE(contains(out, "us per step")) << out;
  EXPECT_TRUE(contains(equal, "rows.csv: recorded, 9 rows, 1 s apart, 8 s\n")) << equal;
  EXPECT_TRUE(contains(unequal, "recorded, 9 rows, 9 s apart")) << unequal;
}

TEST_F(Cli, CompareEndsWithAdviceAndFillsItsFolder) {
  const Answer a = porthos("compare swing/scene.toml --methods gauss8,rk4,cvode_adams --budget 3");
  EXPECT_EQ(a.code, 0) << a.err;
  EXPECT_TRUE(contains(a.out, "\nfor an energy error of 1e-11 over 2 s: gauss8, step 0.")) << a.out;
  EXPECT_TRUE(a.out.ends_with("\n"));
  for (const char* file : {"compare.json", "compare.txt", "work_precision.svg"})
    EXPECT_TRUE(fs::exists(folder_ / "results/compare_swing" / file)) << file;
  EXPECT_EQ(a.out, file_text(folder_ / "results/compare_swing/compare.txt"));
  EXPECT_TRUE(contains(a.err, "results/compare_swing/: compare.json")) << a.err;
  const fs::path picture = folder_ / "results/compare_swing/work_precision.svg";
  const std::string drawn = file_text(picture);
  fs::remove(picture);
  EXPECT_EQ(porthos("plot results/compare_swing").out,
            "results/compare_swing/work_precision.svg\n");
  EXPECT_EQ(file_text(picture), drawn);
  EXPECT_EQ(porthos("plot results/compare_swing --what rk4").code, 2);

  const Answer json =
      porthos("compare swing/scene.toml --methods rk4 --budget 1 --duration 1 --json --out again");
  EXPECT_EQ(nlohmann::json::parse(json.out).at("duration_s"), 1);
  EXPECT_EQ(json.out, file_text(folder_ / "again/compare.json"));

  const Answer few = porthos("compare swing/scene.toml --budget 2 --duration 1 --out few");
  const Answer all = porthos("compare swing/scene.toml --budget 2 --duration 1 --all --out all");
  const char* const note = "of each method the trial nearest to the target";
  EXPECT_TRUE(contains(few.out, note) && !contains(all.out, note)) << few.out;
  EXPECT_LT(few.out.size(), file_text(folder_ / "few/compare.txt").size());
  EXPECT_EQ(all.out, file_text(folder_ / "all/compare.txt"));

  EXPECT_EQ(porthos("compare swing/scene.toml --budget 0 --out no").err,
            "porthos: budget is 0, expected more than 0 s\n");
  const Answer bad = porthos("compare swing/scene.toml --methods gauss8,gauss17 --out no");
  EXPECT_EQ(bad.code, 2);
  EXPECT_TRUE(contains(bad.err, "unknown method 'gauss17', expected one of ")) << bad.err;
  EXPECT_FALSE(fs::exists(folder_ / "no")) << "nothing is made for bad input";
}

TEST_F(Cli, CtrlCOfACompareKeepsWhatThereIs) {
  const Answer a = porthos("compare swing/scene.toml --budget 60 --duration 1000 --out cut",
                           "stopped() { \"$@\" & sleep 2; kill -INT $!; wait $!; }; stopped");
  EXPECT_EQ(a.code, 130) << a.err;
  EXPECT_TRUE(contains(a.err, "porthos: interrupted: the results are of the trials until then\n"));
  EXPECT_TRUE(nlohmann::json::parse(file_text(folder_ / "cut/compare.json")).at("interrupted"));
  EXPECT_TRUE(contains(a.out, "interrupted: trials are missing")) << a.out;
}

TEST_F(Cli, AutoSaysWhatItChose) {
  const Answer a = porthos("run swing/scene.toml --method auto --out auto");
  EXPECT_EQ(a.code, 0) << a.out << a.err;
  EXPECT_TRUE(contains(a.err, "porthos: auto chose --method gauss")) << a.err;
  EXPECT_TRUE(contains(a.out, "note        auto chose --method gauss")) << a.out;
  const Answer info = porthos("info swing/scene.toml");
  EXPECT_TRUE(contains(info.out, "chosen by  ")) << info.out;
}

TEST_F(Cli, NohupIsHeeded) {
  const Answer a = porthos("run swing/scene.toml --out on --duration 1000",
                           "trap '' HUP; heedless() { \"$@\" & while kill -HUP $!; do sleep 0.05; "
                           "done 2>/dev/null; wait $!; }; heedless");
  EXPECT_EQ(a.code, 0) << a.err;
  EXPECT_TRUE(fs::exists(folder_ / "on/run.h5"));
}
TEST_F(Cli, CtrlCSavesAndSaysHowToResume) {
  const std::string run = "run swing/scene.toml --out long --duration 1e6";
  for (const std::string signal : {"INT", "TERM", "HUP"}) {
    // Twice, as timeout and some terminals do: the second must not kill what the first asked to
    // save.
    const std::string interrupted = "twice() { \"$@\" & sleep 1; kill -" + signal +
                                    " $!; sleep 0.001; kill -" + signal + " $!; wait $!; }; twice";
    const Answer a = porthos(run + (signal == "INT" ? "" : " --resume"), interrupted);
    EXPECT_EQ(a.code, 130) << a.err;
    EXPECT_TRUE(contains(a.err,
                         "checkpoint saved; continue with: porthos run swing/scene.toml --out long "
                         "--duration 1e6 --resume\n"))
        << a.err;
    EXPECT_EQ(a.out, "");
  }
}

}  // namespace
}  // namespace porthos::test::cli_test
