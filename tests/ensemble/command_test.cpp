// porthos ensemble as a user meets it: the same bytes however it was run, refusals, a killed
// process, ranks of MPI.
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <thread>

#include "scene/ensemble/ensemble.h"
#include "scene/files/hdf5_reader.h"
#include "scene/read/variation.h"
#include "scene/session/run.h"
#include "tests/ensemble/rows.h"
#include "tests/places.h"
#include "tests/support/bounds.h"

namespace porthos::test::command_test {
namespace {

namespace fs = std::filesystem;
using scene::Ensemble, scene::EnsembleOptions, scene::EnsembleReport;

constexpr const char* model = R"(<robot name="arm">
  <link name="foot"/>
  <link name="upper"><inertial><origin xyz="0 0 -0.5"/><mass value="2"/>
    <inertia ixx="0.2" iyy="0.2" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="lower"><inertial><origin xyz="0 0 -0.3"/><mass value="1"/>
    <inertia ixx="0.05" iyy="0.05" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="shoulder" type="continuous"><parent link="foot"/><child link="upper"/><axis xyz="1 0 0"/></joint>
  <joint name="elbow" type="continuous"><parent link="upper"/><child link="lower"/><origin xyz="0 0 -1"/><axis xyz="1 0 0"/></joint>
</robot>)";

constexpr const char* head = R"(title = "Arms let go"
[model]
urdf = "arm.urdf"
base = "fixed"
[environment]
gravity = "uniform"
vector = [0, 0, -9.81]
[initial]
joints.shoulder = { position = 1.0 }
[integrator]
method = "gauss12"
step = 0.02
[run]
duration = 4.0
record_every = 0.5
[verify]
energy = 1e-9
)";
constexpr const char* sampled = R"([ensemble]
cases = 60
seed = 5
[ensemble.vary]
"initial.joints.*.position" = { uniform = [-2, 2] }
"initial.joints.elbow.velocity" = { normal = [0, 0.5] }
)";

std::string bytes(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

class EnsembleCommand : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(testing::TempDir()) / ("porthos_ensemble_" + std::to_string(getpid()));
    fs::create_directories(folder_);
    write("arm.urdf", model);
    write("scene.toml", std::string(head) + sampled);
  }
  void TearDown() override { fs::remove_all(folder_); }
  void write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
  }
  void write_with_cases(const std::string& number) const {
    std::string text = std::string(head) + sampled;
    write("scene.toml", text.replace(text.find("cases = 60"), 10, "cases = " + number));
  }
  std::string scene() const { return (folder_ / "scene.toml").string(); }
  EnsembleReport run(const std::string& out, EnsembleOptions o = {}) const {
    o.out = (folder_ / out).string();
    return run_ensemble(Ensemble(scene::read_scene(scene())), o);
  }
  std::string result(const std::string& out) const {
    return bytes(folder_ / out / "ensemble.h5") + bytes(folder_ / out / "ensemble.json") +
           bytes(folder_ / out / "ensemble.svg");
  }
  /// What reading the scene with this [ensemble] says, without the path in front.
  std::string said(const std::string& ensemble, const std::string& before = head) const {
    write("scene.toml", before + ensemble);
    std::string text = refusal([&] { Ensemble(scene::read_scene(scene())); });
    for (size_t at; (at = text.find(folder_.string() + "/")) != std::string::npos;)
      text.erase(at, folder_.string().size() + 1);
    return text;
  }
  fs::path folder_;
};

TEST_F(EnsembleCommand, SameBytesForAnyThreadsLanesPartsAndInterruptions) {
  const auto r = run("one", {.threads = 1});
  EXPECT_TRUE(r.complete);
  EXPECT_EQ(r.passed, 60);
  keeps("largest energy error", r.energy.quantiles[6], 1e-9);
  const std::string one = result("one");
  EXPECT_GT(one.size(), 10000u);
  run("two", {.threads = 2});
  EXPECT_TRUE(result("two") == one) << "threads";
  run("scalar", {.threads = 1, .lanes = false});
  EXPECT_TRUE(result("scalar") == one) << "lanes";

  for (const int k : {3, 1, 2}) {
    const auto part = run("parts", {.part = {k, 3}, .threads = 1});
    EXPECT_FALSE(part.complete || part.interrupted);
    EXPECT_FALSE(fs::exists(folder_ / "parts/ensemble.h5"));
    EXPECT_EQ(part.run_here, 20);
    const std::string said = refusal([&] {
      if (k != 2) run("parts", {.join = true});
    });
    EXPECT_EQ(said.find("of 60 cases (the first: ") == std::string::npos, k == 2);
  }
  run("parts", {.join = true});
  EXPECT_TRUE(result("parts") == one) << "parts";
  EXPECT_FALSE(fs::exists(folder_ / "parts/parts"));

  std::atomic<bool> stop = false;
  int times = 0;
  EnsembleReport report;
  do {
    stop = false;
    EnsembleOptions o{.resume = times > 0, .threads = 1, .stop = &stop};
    o.progress = [&](double, double, double) { stop = times < 3; };
    report = run("stopped", o);
    EXPECT_EQ(report.interrupted, times < 3);
    const std::string said = refusal([&] {
      if (times == 0) run("stopped");
    });
    EXPECT_EQ(said.find("use --resume") == std::string::npos, times > 0);
  } while (++times < 10 && report.interrupted);
  EXPECT_EQ(times, 4);
  EXPECT_TRUE(result("stopped") == one) << "interruptions";

  write("scene.toml",
        std::string(head) +
            std::string(sampled).replace(std::string(sampled).find("seed = 5"), 8, "seed = 6"));
  run("other", {.threads = 1});
  EXPECT_FALSE(result("other") == one) << "control: another seed";
}

TEST_F(EnsembleCommand, ACaseIsTheRunOfItsScene) {
  write("cases.csv",
        "initial.joints.shoulder.position,initial.joints.elbow.velocity\n# two\n0.25,1.5\n-1,0\n");
  // Every 16th step is recorded: a run looks at no others between, as a case never does.
  std::string often(head);
  often.replace(often.find("record_every = 0.5"), 18, "record_every = 0.32");
  write("scene.toml", often + "[ensemble]\ntable = \"cases.csv\"\n");
  const Ensemble e(scene::read_scene(scene()));
  const auto rows = rows_of(e, 0);
  std::string text = often;
  text.replace(text.find("{ position = 1.0 }"), 18,
               "{ position = 0.25 }\njoints.elbow = { velocity = 1.5 }");
  write("alone.toml", text);
  const auto s = scene::read_scene((folder_ / "alone.toml").string());
  const auto r = scene::run(s, assemble(s), {.out = (folder_ / "alone").string()});
  const auto& l = e.layout();
  EXPECT_EQ(rows[0][l.energy], r.energy.max_rel_error);
  for (size_t i = 0; i < l.nx; ++i) {
    EXPECT_EQ(rows[0][l.x() + i], r.final_state.x[i]);
    EXPECT_EQ(rows[0][l.low() + i], r.final_state.lo[i]);
    EXPECT_NE(rows[1][l.x() + i], r.final_state.x[i]) << "control: another case";
  }
}

/// A controller's motion begins at the start of its case; its gains differ from case to case.
TEST_F(EnsembleCommand, ACaseWithAControllerIsTheRunOfItsScene) {
  std::string text(head);
  text.replace(text.find("record_every = 0.5"), 18, "record_every = 0.32");
  text +=
      "[[controller]]\ntype = \"tracking\"\nname = \"law\"\nover = 8\n"
      "joints.shoulder = { target = 0.5, kp = 30, kd = 9 }\n"
      "joints.elbow = { target = 0.2, kp = 30, kd = 9 }\n";
  text.insert(text.find("[integrator]"), "joints.elbow = { velocity = 1 }\n");  // off the motion
  const auto changed = [&](const std::string& from, const std::string& to) {
    std::string other = text;
    other.replace(other.find(from), from.size(), to);
    return other;
  };
  const std::string start = "initial.joints.shoulder.position\n0.25\n-1\n",
                    gain = "controller[0].joints.elbow.kp\n40\n20\n";
  for (const auto& [table, alone] :
       {std::pair{start, changed("{ position = 1.0 }", "{ position = 0.25 }")},
        {gain, changed("0.2, kp = 30", "0.2, kp = 40")}}) {
    write("cases.csv", table);
    write("scene.toml", text + "[ensemble]\ntable = \"cases.csv\"\n");
    const Ensemble e(scene::read_scene(scene()));
    const auto rows = rows_of(e, 0);
    write("alone.toml", alone);
    const auto s = scene::read_scene((folder_ / "alone.toml").string());
    const auto r = scene::run(s, assemble(s), {.out = (folder_ / "alone").string()});
    const auto& l = e.layout();
    for (size_t i = 0; i < l.nx; ++i) {
      EXPECT_EQ(rows[0][l.x() + i], r.final_state.x[i]) << table;
      EXPECT_NE(rows[1][l.x() + i], r.final_state.x[i]) << "control: another case";
    }
  }
}

TEST_F(EnsembleCommand, ParametersOfTheModelAndCasesItRefuses) {
  std::string text(head);
  text += "[[element]]\ntype = \"spring\"\njoint = \"elbow\"\nstiffness = 5.0\n";
  write("cases.csv",
        "element[0].stiffness,environment.vector[2],model.mass_factor.lower\n"
        "5,-9.81,1\n8,-3.7,1.2\n-2,-9.81,1\n5,-9.81,2\n");
  write("scene.toml", text + "[ensemble]\ntable = \"cases.csv\"\n");
  const auto r = run("out");
  EXPECT_TRUE(r.complete);
  EXPECT_EQ(r.passed, 3);
  ASSERT_EQ(r.failures.size(), 1u);
  EXPECT_EQ(r.failures[0].name, "refused");
  EXPECT_EQ(r.failures[0].first, std::vector<std::int64_t>{2});
  EXPECT_EQ(r.not_passed, std::vector<std::int64_t>{2});
  const auto json = nlohmann::json::parse(bytes(folder_ / "out/ensemble.json"));
  EXPECT_EQ(json["first_not_passed"][0]["inputs"]["element[0].stiffness"], -2);
  // Twice the mass of the outer link: more energy, by what that link has at the start.
  const Ensemble e(scene::read_scene(scene()));
  std::vector<double> energy(4);
  std::int64_t next = 0;
  e.work([&] { return next < 4 ? next++ : -1; },
         [&](std::span<const double> row) {
           energy[size_t(scene::integer(row[0]))] = row[scene::CaseLayout::energy_initial];
         },
         {.threads = 1});
  EXPECT_NEAR(energy[3] - energy[0], 1 * 9.81 * -1.3 * std::cos(1.0), 1e-12);
}

// What a sampled controller holds belongs to its case: any number of threads, and a case alone has
// the same bits.
TEST_F(EnsembleCommand, SampledControllersOfEachCase) {
  const std::string servo = R"([[element]]
type = "controller"
joint = "elbow"
stiffness = 4.0
damping = 1.0
rate = 10.0
)";
  write("scene.toml", head + servo + sampled);
  run("one", {.threads = 1});
  run("two", {.threads = 2});
  EXPECT_TRUE(result("two") == result("one")) << "threads";
  // The last case, alone.
  const Ensemble e(scene::read_scene(scene()));
  const auto values = e.sampler().values(59);
  const auto s = scene::read_variation(e.scene(), e.sampler().replacements(values));
  const auto a = scene::assemble(s);
  const auto method = scene::make_integrator(s, *a.model, s.step);
  phs::State x = a.initial;
  for (int k = 0; k < 200; ++k) ASSERT_EQ(method->step(x), integrators::Outcome::ok);
  std::vector<double> row(x.x.size());
  scene::Hdf5Reader(folder_ / "one/ensemble.h5").read_rows("final/x", 59, 1, row.data());
  EXPECT_EQ(row, x.x);
}

TEST_F(EnsembleCommand, RefusesInOneSentence) {
  const std::string e = "[ensemble]\ncases = 3\n", v = "[ensemble.vary]\n";
  EXPECT_EQ(said(""),
            "scene.toml:1:1: there is no [ensemble], expected a table with the keys cases, seed, "
            "sampling and vary, or table");
  EXPECT_EQ(said("[ensemble]\ncases = 0\n"),
            "scene.toml:19:9: cases is 0, expected 1 to 1000000000");
  EXPECT_EQ(said(e + v), "scene.toml:20:1: vary is empty, expected quantities and distributions");
  EXPECT_EQ(said(e + v + "\"initial.joints.elbow.velocity\" = { uniform = [1, 1] }\n"),
            "scene.toml:21:47: vary.\"initial.joints.elbow.velocity\".uniform is no distribution: "
            "it is empty: low is 1 and high 1, expected low < high");
  EXPECT_EQ(said(e + v + "\"initial.joints.elbow.velocity\" = { normal = [1, 0] }\n"),
            "scene.toml:21:46: vary.\"initial.joints.elbow.velocity\".normal is no distribution: "
            "the standard deviation is 0, expected more than 0");
  EXPECT_NE(said(e + v + "\"initial.joints.elbow.velocity\" = {}\n")
                .find("is a table of 0 keys, expected { uniform"),
            std::string::npos);
  const std::string unit = " = { uniform = [0, 1] }\n";
  EXPECT_NE(said(e + v + "\"initial.joints.elbow.velocty\"" + unit)
                .find("with 0.5: unknown key 'velocty' in joints.elbow, the nearest known one is "
                      "'velocity'"),
            std::string::npos);
  EXPECT_NE(said(e + v + "\"initial.joints.wrist.velocity\"" + unit)
                .find("the model has no joint of this name, expected one of: shoulder, elbow"),
            std::string::npos);
  EXPECT_NE(
      said(e + v + "\"integrator.step\"" + unit)
          .find("\"integrator.step\" cannot differ from case to case, expected a key of initial, "),
      std::string::npos);
  EXPECT_NE(said(e + v + "\"environment.vector[3]\"" + unit).find("'vector' has the places 0 to 2"),
            std::string::npos);
  EXPECT_NE(said("[[element]]\ntype = \"damper\"\njoint = \"elbow\"\ndamping = 1\n" + e + v +
                 "\"element.elbow.damping\"" + unit)
                .find("expected one of element[0] (damper, elbow)"),
            std::string::npos);
  EXPECT_NE(said("[ensemble]\ncases = 3\nsampling = \"grid\"\n" + v)
                .find("expected \"random\" or \"sobol\""),
            std::string::npos);
  EXPECT_NE(said("[ensemble]\ntable = \"none.csv\"\n").find("cannot read none.csv"),
            std::string::npos);
  write("cases.csv", "initial.joints.elbow.velocity\nfast\n");
  EXPECT_EQ(said("[ensemble]\ntable = \"cases.csv\"\n"),
            "cases.csv:2: initial.joints.elbow.velocity is 'fast', expected a finite number");
  for (const char* part : {"3/2", "0/2", "2", "a/b", "1/2/3"})
    EXPECT_EQ(refusal([&] { scene::part_of(part); }).substr(0, 15), "--part: part is") << part;
  write("scene.toml", std::string(head) + sampled);
  EXPECT_EQ(refusal([&] {
              run("many", {.part = {1, 61}});
            }),
            "--part: 61 parts of 60 cases, expected at most one part per case");
  run("edited", {.part = {1, 2}, .threads = 1});
  write("scene.toml", std::string(head) + sampled + "# edited\n");
  EXPECT_NE(refusal([&] {
              run("edited", {.resume = true});
            }).find("is of another ensemble: the scene file has changed"),
            std::string::npos);
}

// A row that is damaged costs its case, not those behind it.
TEST_F(EnsembleCommand, DamagedRowsAreMadeAgain) {
  run("whole", {.threads = 1});
  run("out", {.part = {1, 2}, .threads = 1});
  run("out", {.part = {2, 2}, .threads = 1});
  const fs::path log = folder_ / "out/parts/1_of_2.bin";
  std::string damaged = bytes(log);
  for (const double at : {0.5, 0.8}) {
    char& byte = damaged[size_t(at * double(damaged.size()))];
    byte = char(byte ^ 1);
  }
  std::ofstream(log, std::ios::binary) << damaged;
  const auto r = run("out", {.resume = true, .threads = 1});
  EXPECT_EQ(r.damage, "2 rows of " + log.string() + " were damaged: their cases were run again");
  EXPECT_EQ(r.run_here, 2);
  EXPECT_TRUE(result("out") == result("whole"));
}

#ifdef PORTHOS_CLI
/// Starts a command with its own group; the shell of `mpirun` and its ranks are in it.
pid_t start(const std::vector<std::string>& words) {
  const pid_t child = fork();
  if (child != 0) return child;
  setpgid(0, 0);
  if (!freopen("/dev/null", "w", stdout) || !freopen("/dev/null", "w", stderr)) _exit(1);
  std::vector<char*> argv;
  for (const auto& w : words) argv.push_back(const_cast<char*>(w.c_str()));
  argv.push_back(nullptr);
  execvp(argv[0], argv.data());
  _exit(127);
}
int wait_for(pid_t child) {
  int status = 0;
  waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}
/// Whether the log has come so far that something was done, and not all of it.
bool begun(const fs::path& log) {
  for (int i = 0; i < 2000; ++i, std::this_thread::sleep_for(std::chrono::milliseconds(2))) {
    std::error_code none;
    if (const auto size = fs::file_size(log, none); !none && size > 20000) return true;
  }
  return false;
}

TEST_F(EnsembleCommand, KilledAndResumed) {
  write_with_cases("3000");
  run("whole");
  for (int times = 0;; ++times) {
    ASSERT_LT(times, 3) << "the run was always done before it was killed";
    const std::string out = "killed" + std::to_string(times);
    const pid_t child =
        start({PORTHOS_CLI, "ensemble", scene(), "--out", (folder_ / out).string()});
    const bool there = begun(folder_ / out / "parts/1_of_1.bin");
    kill(child, SIGKILL);
    const int code = wait_for(child);
    if (!there || code != 128 + SIGKILL || fs::exists(folder_ / out / "ensemble.h5")) continue;
    // As if the crash had torn the last row.
    const auto log = folder_ / out / "parts/1_of_1.bin";
    fs::resize_file(log, fs::file_size(log) - 13);
    const auto r = run(out, {.resume = true});
    std::printf("  killed with %lld of 3000 cases done\n", 3000 - (long long)r.run_here);
    EXPECT_LT(r.run_here, 3000);
    // The command in the tests' folder and this program are of one commit.
    EXPECT_TRUE(result(out) == result("whole"));
    break;
  }
}

#ifdef PORTHOS_MPI_CLI
std::vector<std::string> ranks(int n, const std::vector<std::string>& more,
                               const std::string& scene, const fs::path& out) {
  std::vector<std::string> words{"mpirun", "--allow-run-as-root", "--oversubscribe", "-n",
                                 std::to_string(n)};
  words.insert(words.end(), more.begin(), more.end());
  for (const std::string& w :
       {std::string(PORTHOS_MPI_CLI), std::string("ensemble"), scene, std::string("--threads"),
        std::string("1"), std::string("--out"), out.string()})
    words.push_back(w);
  return words;
}

TEST_F(EnsembleCommand, TwoRanksGiveTheSameBytes) {
  run("one", {.threads = 1});
  ASSERT_EQ(wait_for(start(ranks(2, {}, scene(), folder_ / "mpi"))), 0);
  EXPECT_TRUE(result("mpi") == result("one"));
  // A refusal ends all ranks.
  EXPECT_NE(wait_for(start(ranks(2, {}, (folder_ / "none.toml").string(), folder_ / "mpi"))), 0);
}

/// The process of a rank, by its environment.
pid_t process_of(int rank, const std::string& scene) {
  for (const auto& entry : fs::directory_iterator("/proc")) {
    const std::string name = entry.path().filename();
    if (name.find_first_not_of("0123456789") != std::string::npos) continue;
    if (bytes(entry.path() / "cmdline").find(scene) == std::string::npos) continue;
    if (bytes(entry.path() / "environ").find("OMPI_COMM_WORLD_RANK=" + std::to_string(rank)) !=
        std::string::npos)
      return pid_t(std::stol(name));
  }
  return 0;
}

TEST_F(EnsembleCommand, ADeadRankLONG) {
  if (!std::getenv("PORTHOS_LONG")) GTEST_SKIP() << "waits for a silent rank: set PORTHOS_LONG=1";
  write_with_cases("6000");
  run("whole");
  for (const bool recovery : {false, true}) {
    const fs::path out = folder_ / (recovery ? "recovered" : "aborted");
    const pid_t job = start(ranks(
        3, recovery ? std::vector<std::string>{"--enable-recovery"} : std::vector<std::string>{},
        scene(), out));
    ASSERT_TRUE(begun(out / "parts/1_of_1.bin"));
    const pid_t victim = process_of(2, scene());
    ASSERT_GT(victim, 0);
    kill(victim, SIGKILL);
    const int code = wait_for(job);
    std::printf("  %s: mpirun ends with %d\n", recovery ? "--enable-recovery" : "by default", code);
    if (recovery) {
      EXPECT_EQ(code, 0) << "the others go on, and do its cases";
    } else {
      EXPECT_NE(code, 0) << "the runtime ends the others";
      EXPECT_FALSE(fs::exists(out / "ensemble.h5"));
      const auto r = run("aborted", {.resume = true});
      EXPECT_LT(r.run_here, 6000) << "what was done is done";
    }
    EXPECT_TRUE(result(out.filename()) == result("whole"));
  }
}

/// A rank that stands still: for less than rank 0 waits, and for longer, so that its cases are done
/// again and it finds the others gone.
TEST_F(EnsembleCommand, ASlowRankLONG) {
  if (!std::getenv("PORTHOS_LONG")) GTEST_SKIP() << "waits for a slow rank: set PORTHOS_LONG=1";
  write_with_cases("6000");
  run("whole");
  for (const int seconds : {4, 20}) {
    const std::string out = "slow_" + std::to_string(seconds);
    const pid_t job = start(ranks(3, {"--enable-recovery"}, scene(), folder_ / out));
    ASSERT_TRUE(begun(folder_ / out / "parts/1_of_1.bin"));
    const pid_t slow = process_of(2, scene());
    ASSERT_GT(slow, 0);
    kill(slow, SIGSTOP);
    std::this_thread::sleep_for(std::chrono::seconds(seconds));
    kill(slow, SIGCONT);
    EXPECT_EQ(wait_for(job), 0) << seconds;
    EXPECT_TRUE(result(out) == result("whole")) << seconds;
    for (int i = 0; i < 80 && process_of(2, scene()) > 0; ++i)
      std::this_thread::sleep_for(std::chrono::seconds(1));
    EXPECT_EQ(process_of(2, scene()), 0) << "it ends too, where nobody answers it any more";
  }
}
#endif
#endif

TEST_F(EnsembleCommand, TenThousandEtsViiLONG) {
  if (!std::getenv("PORTHOS_LONG")) GTEST_SKIP() << "10 000 runs of 100 s: set PORTHOS_LONG=1";
  const Ensemble e(
      scene::read_scene(std::string(PORTHOS_SOURCE_DIR) + "/examples/ensemble/scene.toml"));
  const auto before = std::clock();
  const auto r = run_ensemble(e, {.out = (folder_ / "ets").string(), .threads = 2});
  const double cpu = double(std::clock() - before) / CLOCKS_PER_SEC;
  std::printf("  10 000 runs in %.1f s, %.1f s of CPU\n", r.wall_s, cpu);
  EXPECT_EQ(r.passed, 10000);
  keeps("largest energy error", r.energy.quantiles[6], 1e-10);
  keeps("CPU seconds of two cores", cpu, 120);
}

}  // namespace
}  // namespace porthos::test::command_test
