#include "scene/session/run.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <hdf5.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <csignal>

#include <nlohmann/json.hpp>

#include "scene/run/checkpoint.h"
#include "tests/run/scenes.h"

namespace porthos::test::run_test {
namespace {

using integrators::Outcome;

const scene::Check* find(const scene::RunReport& r, const std::string& name) {
  for (const auto& c : r.checks)
    if (c.name == name) return &c;
  return nullptr;
}

TEST(Run, OfAFloatingArmPasses) {
  TemporaryFolder folder;
  const Case c = floating_arm(folder, 200);
  auto options = into(folder / "out");
  options.check_symmetry = true;
  const auto r = scene::run(c.scene, c.assembly, options);
  for (const auto& k : r.checks)
    EXPECT_TRUE(k.pass) << k.name << " " << k.value << " > " << k.limit;
  EXPECT_TRUE(r.passed());
  for (const char* name : {"energy", "angular_momentum", "quaternion_norm", "balance", "symmetry"})
    EXPECT_TRUE(find(r, name)) << name;
  EXPECT_FALSE(find(r, "linear_momentum")) << "zero by structure";
  EXPECT_TRUE(says(read_bytes(folder / "out" / "summary.json"),
                   "the centre of mass moved in closed form, nothing was left to check"));
  EXPECT_EQ(r.steps, 10000);
  EXPECT_EQ(r.records, 3335);  // every third step, the start and the last
  EXPECT_GT(r.energy.max_rel_error, 0);
  EXPECT_FALSE(fs::exists(folder / "out" / "checkpoint"));
}

TEST(Run, OfAMethodThatKeepsNothingFails) {
  TemporaryFolder folder;
  const Case c = floating_arm(folder, 200, "rk4");
  const auto r = scene::run(c.scene, c.assembly, into(folder / "out"));
  EXPECT_FALSE(r.passed());
  EXPECT_FALSE(find(r, "energy")->pass);
  EXPECT_EQ(r.outcome, Outcome::ok);
}

/// A body that has turned moves on along the world's axes.
TEST(Run, RatesOfAFreeBaseInTheSummaryAreTheWorlds) {
  TemporaryFolder folder;
  write_bytes(
      folder / "ball.urdf",
      "<robot name='ball'><link name='ball'><inertial><mass value='0.2'/><inertia ixx='1e-4' "
      "iyy='1e-4' izz='1e-4' ixy='0' ixz='0' iyz='0'/></inertial></link></robot>");
  write_bytes(
      folder / "scene.toml",
      "[model]\nurdf = 'ball.urdf'\nbase = 'free'\n[initial]\nbase = { attitude_wxyz = [1, 0, "
      "0, 1], linear_velocity = [1, 0, 0], angular_velocity = [0, 0, 0.5] }\n[integrator]\n"
      "method = 'gauss8'\nstep = 0.01\n[run]\nduration = 1\n");
  const auto s = scene::read_scene((folder / "scene.toml").string());
  (void)scene::run(s, scene::assemble(s), into(folder / "out"));
  const auto v = nlohmann::json::parse(
      read_bytes(folder / "out" / "summary.json"))["final_state"]["v"]["base.position"];
  const double expected[] = {1, 0, 0};
  for (size_t k = 0; k < 3; ++k) EXPECT_NEAR(v[k].get<double>(), expected[k], 1e-14);
}

TEST(Run, SummaryHasItsFields) {
  TemporaryFolder folder;
  const Case c = floating_arm(folder);
  const auto r = scene::run(c.scene, c.assembly, into(folder / "out"));
  const auto j = nlohmann::json::parse(read_bytes(folder / "out" / "summary.json"));
  for (const char* name :
       {"title",           "method",           "step_s",          "steps",           "simulated_s",
        "cpu_s",           "wall_s",           "evaluations",     "sweeps_per_step", "energy",
        "linear_momentum", "angular_momentum", "quaternion_norm", "balance",         "final_state",
        "checks",          "verdict",          "records",         "notes",           "outcome",
        "provenance"})
    EXPECT_TRUE(j.contains(name)) << name;
  EXPECT_EQ(j["energy"]["max_rel_error"], r.energy.max_rel_error);
  EXPECT_EQ(j["final_state"]["q"]["base.attitude"].size(), 4u);
  EXPECT_EQ(j["final_state"]["v"]["base.attitude"].size(), 3u);
  // The elbow is the last angle of q: a true angle, not one modulo 2π.
  const auto& last = r.final_state;
  ASSERT_NE(last.turns.back(), 0);
  EXPECT_NEAR(j["final_state"]["q"]["elbow"].get<double>(),
              last.x[last.x.size() / 2 - 1] + phs::two_pi_hi * double(last.turns.back()), 1e-13);
  EXPECT_TRUE(j["balance"]["ports"].empty()) << "nothing is supplied";
  EXPECT_NEAR(j["balance"]["storages"]["base.kinetic"].get<double>() +
                  j["balance"]["storages"]["links.kinetic"].get<double>(),
              j["balance"]["stored_J"].get<double>(), 1e-9);
  EXPECT_EQ(j["verdict"], "pass");
}

/// A dataset of run.h5 as doubles, row after row.
std::vector<double> dataset(const fs::path& h5, const std::string& name,
                            std::vector<hsize_t>& shape) {
  const hid_t f = H5Fopen(h5.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT),
              d = H5Dopen2(f, name.c_str(), H5P_DEFAULT);
  const hid_t s = H5Dget_space(d);
  shape.resize(size_t(H5Sget_simple_extent_ndims(s)));
  H5Sget_simple_extent_dims(s, shape.data(), nullptr);
  std::vector<double> v(size_t(H5Sget_simple_extent_npoints(s)));
  H5Dread(d, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, v.data());
  H5Sclose(s);
  H5Dclose(d);
  H5Fclose(f);
  return v;
}

TEST(Run, Hdf5HoldsTheSeries) {
  TemporaryFolder folder;
  const Case c = floating_arm(folder);
  const auto r = scene::run(c.scene, c.assembly, into(folder / "out"));
  const auto h5 = folder / "out" / "run.h5";
  std::vector<hsize_t> shape;
  const auto n = hsize_t(r.records);
  const auto time = dataset(h5, "time", shape);
  EXPECT_EQ(shape, std::vector<hsize_t>({n}));
  EXPECT_EQ(time.front(), 0);
  EXPECT_EQ(time.back(), 1000 * 0.02);
  const auto attitude = dataset(h5, "state/base.attitude", shape);
  EXPECT_EQ(shape, std::vector<hsize_t>({n, 4}));
  const phs::State last = scene::WorldView(c.assembly)(r.simulated_s, r.final_state);
  for (size_t k = 0; k < 4; ++k) EXPECT_EQ(attitude[4 * (n - 1) + k], last.x[3 + k]);
  const auto place = dataset(h5, "state/base.position", shape);
  EXPECT_EQ(place.front(), 0);
  for (size_t k = 0; k < 3; ++k) EXPECT_EQ(place[3 * (n - 1) + k], last.x[k]);
  const auto elbow = dataset(h5, "state/elbow", shape);
  EXPECT_EQ(elbow.front(), -0.7);
  const auto momentum = dataset(h5, "momentum/elbow", shape);
  EXPECT_EQ(momentum.back(), last.x.back());
  const auto turns = dataset(h5, "turns", shape);
  EXPECT_EQ(shape, std::vector<hsize_t>({n, 2}));
  EXPECT_EQ(turns.back(), double(r.final_state.turns.back()));
  const auto error = dataset(h5, "energy_error", shape);
  double largest = 0;
  for (const double e : error) largest = std::max(largest, std::fabs(e));
  // The report also knows the steps between records.
  EXPECT_LE(largest, r.energy.max_abs_error_J);
  EXPECT_GE(largest, 0.5 * r.energy.max_abs_error_J);
  EXPECT_EQ(dataset(h5, "angular_momentum_error", shape).size(), 3 * n);
  EXPECT_EQ(dataset(h5, "quaternion_norm_error", shape).size(), n);
}

TEST(Run, ThatStartsWithoutEnergyHasAScaleAllTheSame) {
  TemporaryFolder folder;
  Case c = pendulum(folder);
  // Release where the potential energy is zero up to rounding: the motion is the scale.
  const auto base = c.scene;
  double low = 0.5, high = 3.0;
  for (int i = 0; i < 80; ++i) {
    const double middle = 0.5 * (low + high);
    c.scene.joints["shoulder"].position = middle;
    c.assembly = scene::assemble(c.scene);
    auto system = c.assembly.model->instantiate<double>();
    (system->hamiltonian(c.assembly.initial.x) < 0 ? low : high) = middle;
  }
  const auto r = scene::run(c.scene, c.assembly, into(folder / "out"));
  EXPECT_LT(std::fabs(r.energy.initial_J), 1e-10);
  EXPECT_GT(r.energy.scale_J, 1);
  EXPECT_TRUE(r.passed()) << r.energy.max_rel_error;
}

TEST(Run, WithDampingClosesTheBalanceWhateverTheRecords) {
  TemporaryFolder folder;
  for (const double record_every : {0.01, 1.0}) {
    Case c = pendulum(folder, 0.5);
    c.scene.step = 0.01;
    c.scene.record_every = record_every;
    const auto r =
        scene::run(c.scene, c.assembly, into(folder / ("out" + std::to_string(record_every))));
    EXPECT_LT(r.stored_J, -1);
    EXPECT_GT(r.dissipated_J, 1);
    ASSERT_EQ(r.losses.size(), 1u);
    EXPECT_EQ(r.losses[0].first, "shoulder.damping");
    EXPECT_EQ(r.losses[0].second, r.dissipated_J);
    ASSERT_EQ(r.not_applicable.size(), 1u);
    EXPECT_EQ(r.not_applicable[0].name, "angular_momentum") << "the fixed base does not keep it";
    std::printf("  records every %g s: defect %.1e J (1e-13) of %.1f J turned over\n", record_every,
                r.defect_J, r.turned_over_J);
    EXPECT_LT(std::fabs(r.defect_J), 1e-13);
  }
  // Negative control: a method whose ledger is of low order.
  Case c = pendulum(folder, 0.5);
  c.scene.method = "rk4";
  c.scene.step = c.scene.record_every = 0.01;
  EXPECT_GT(std::fabs(scene::run(c.scene, c.assembly, into(folder / "rk4")).defect_J), 1e-12);
}

TEST(Run, ThatOverflowsKeepsTheLastGoodState) {
  TemporaryFolder folder;
  for (const double rate : {1e200, 1e30}) {
    Case c = floating_arm(folder);
    c.scene.joints["elbow"].velocity = rate;
    c.assembly = scene::assemble(c.scene);
    const auto out = folder / ("out" + std::to_string(rate));
    const auto r = scene::run(c.scene, c.assembly, into(out));
    EXPECT_NE(r.outcome, Outcome::ok);
    if (rate > 1e100) {
      EXPECT_EQ(r.outcome, Outcome::not_finite);
    }
    EXPECT_FALSE(r.passed());
    ASSERT_TRUE(find(r, "outcome"));
    const auto j = nlohmann::json::parse(read_bytes(out / "summary.json"));
    EXPECT_EQ(j["verdict"], "fail");
    EXPECT_TRUE(fs::exists(out / "run.h5"));
    // Without a step there is no energy error to judge. Control: with steps it is judged.
    EXPECT_EQ(bool(find(r, "energy")), r.steps > 0) << rate;
    if (r.steps == 0) {
      for (const char* key : {"max_abs_error_J", "max_rel_error", "rms_rel_error"})
        EXPECT_TRUE(j["energy"][key].is_null()) << key;
      EXPECT_EQ(j["energy"]["growth"], "is not known: nothing but the start was seen");
      const auto why = std::ranges::find(r.not_applicable, "energy", &scene::NotApplicable::name);
      ASSERT_NE(why, r.not_applicable.end());
      EXPECT_EQ(why->why, "nothing but the start was seen");
    }

    const auto saved = scene::read_checkpoint(out / "checkpoint");
    EXPECT_EQ(saved.state.step, r.steps);
    for (const double x : saved.state.x) EXPECT_TRUE(std::isfinite(x));
    // What failed is not "unfinished": a better run may take its place.
    const Case better = floating_arm(folder);
    EXPECT_TRUE(scene::run(better.scene, better.assembly, into(out)).passed());
    EXPECT_FALSE(fs::exists(out / "checkpoint"));
  }
}

TEST(Run, ReplacesAFinishedRunOnlyWhenItHasFinishedItself) {
  TemporaryFolder folder;
  const Case first = floating_arm(folder), second = floating_arm(folder, 40);
  scene::run(first.scene, first.assembly, into(folder / "out"));
  const auto before = read_bytes(folder / "out" / "run.h5");

  const std::atomic<bool> stop = true;
  auto options = into(folder / "out");
  options.stop = &stop;
  EXPECT_TRUE(scene::run(second.scene, second.assembly, options).interrupted);
  EXPECT_TRUE(before == read_bytes(folder / "out" / "run.h5"));
  scene::run(second.scene, second.assembly, into(folder / "out", true));
  EXPECT_FALSE(before == read_bytes(folder / "out" / "run.h5"));
}

TEST(Run, OfARivalThatCannotBeContinuedWritesNoCheckpoint) {
  TemporaryFolder folder;
  const Case c = floating_arm(folder, 20, "cvode_adams");
  const std::atomic<bool> stop = true;
  auto options = into(folder / "out");
  options.stop = &stop;
  const auto r = scene::run(c.scene, c.assembly, options);
  EXPECT_TRUE(r.interrupted);
  ASSERT_EQ(r.notes.size(), 1u);
  EXPECT_FALSE(scene::has_checkpoint(folder / "out" / "checkpoint"));
  EXPECT_FALSE(scene::run(c.scene, c.assembly, into(folder / "out")).interrupted);
}

TEST(Run, IntoWhatIsNoFolder) {
  TemporaryFolder folder;
  const Case c = floating_arm(folder);
  write_bytes(folder / "file", "x");
  EXPECT_TRUE(says(refusal([&] { scene::run(c.scene, c.assembly, into(folder / "file")); }),
                   "file/checkpoint: Not a directory"));
  EXPECT_TRUE(says(refusal([&] { scene::run(c.scene, c.assembly, into("/proc/porthos")); }),
                   "cannot make the folder /proc/porthos"));
}

/// Runs f in a process of its own; its exit code.
template <class F>
int in_child(F f) {
  const pid_t child = fork();
  if (child == 0) _exit(f());
  int status = 0;
  waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

/// The text of a run whose files may not grow beyond a size: what a full disk does, for every user.
/// Then continued.
std::string run_with_files_of_at_most(rlim_t bytes, const fs::path& out, const fs::path& message,
                                      const Case& c) {
  const int code = in_child([&]() -> int {
    std::signal(SIGXFSZ, SIG_IGN);
    const rlimit all = [] {
      rlimit r;
      getrlimit(RLIMIT_FSIZE, &r);
      return r;
    }();
    const rlimit few{bytes, all.rlim_max};
    setrlimit(RLIMIT_FSIZE, &few);
    const auto text = refusal([&] { scene::run(c.scene, c.assembly, into(out)); });
    setrlimit(RLIMIT_FSIZE, &all);
    write_bytes(message, text);
    // The same process goes on: what failed left nothing behind that disturbs the next file.
    const auto again =
        refusal([&] { scene::run(c.scene, c.assembly, into(out.string() + "_else")); });
    if (!again.empty()) return 2;
    std::exit(0);  // with the exit handlers: HDF5 must not stumble over a file it could not finish
  });
  EXPECT_EQ(code, 0);
  return read_bytes(message);
}

/// Tries with little room, then continues with enough: the bits of a run that had it from the
/// start.
void expect_full_disk_is_told(double duration, std::initializer_list<double> fractions_of_h5) {
  TemporaryFolder folder;
  const Case c = floating_arm(folder, duration);
  const auto whole = scene::run(c.scene, c.assembly, into(folder / "whole"));
  const auto h5 = double(fs::file_size(folder / "whole" / "run.h5"));
  int n = 0;
  for (const double fraction : fractions_of_h5) {
    const auto out = folder / ("out" + std::to_string(n++));
    const auto text = run_with_files_of_at_most(rlim_t(fraction * h5), out, folder / "message", c);
    EXPECT_TRUE(says(text, "cannot write " + out.string()));
    EXPECT_TRUE(says(text, "File too large"));
    EXPECT_FALSE(fs::exists(out / "summary.json"));
    const bool resume = scene::has_checkpoint(out / "checkpoint");
    EXPECT_TRUE(scene::run(c.scene, c.assembly, into(out, resume)).final_state ==
                whole.final_state);
    EXPECT_TRUE(read_bytes(out / "run.h5") == read_bytes(folder / "whole" / "run.h5"));
  }
}

TEST(Run, OntoADiskTooFullForTheRecordsSaysSoAndCanBeContinued) {
  expect_full_disk_is_told(400, {0.001, 0.1, 0.5});
}

/// A short run has a small log and, by its many datasets, a larger run.h5.
TEST(Run, OntoADiskTooFullForTheResultsSaysSoAndCanBeContinued) {
  expect_full_disk_is_told(2, {0.5, 0.9, 0.999});
}

long peak_memory_kB(const Case& c, const fs::path& out) {
  int ends[2];
  if (pipe(ends) != 0) return -1;
  in_child([&] {
    scene::run(c.scene, c.assembly, into(out));
    rusage u;
    getrusage(RUSAGE_SELF, &u);
    return write(ends[1], &u.ru_maxrss, sizeof u.ru_maxrss) == sizeof u.ru_maxrss ? 0 : 1;
  });
  long peak = -1;
  if (read(ends[0], &peak, sizeof peak) != sizeof peak) peak = -1;
  close(ends[0]);
  close(ends[1]);
  return peak;
}

TEST(Run, NeedsTheSameMemoryForTwentyTimesTheTime) {
  TemporaryFolder folder;
  Case brief = floating_arm(folder, 300, "rk4"), lengthy = floating_arm(folder, 6000, "rk4");
  brief.scene.record_every = lengthy.scene.record_every = 0.02;
  const long a = peak_memory_kB(brief, folder / "a"), b = peak_memory_kB(lengthy, folder / "b");
  RecordProperty("peak_kB_short", int(a));
  RecordProperty("peak_kB_long", int(b));
  EXPECT_GT(a, 0);
  EXPECT_LT(b, a + 4000);  // the records alone are 70 MB
}

/// A wrist of massless links, roll, pitch, roll, whose axes align at pitch = 0 and only there.
std::string wrist_urdf(const std::string& pitch_name = "pitch") {
  const auto turning = [](const std::string& name, const std::string& parent,
                          const std::string& child, const std::string& axis) {
    return "<joint name='" + name + "' type='continuous'><parent link='" + parent +
           "'/><child link='" + child + "'/><axis xyz='" + axis + "'/></joint>";
  };
  const std::string massless =
      "<inertial><mass value='0'/><inertia ixx='0' iyy='0' izz='0' ixy='0' ixz='0' iyz='0'/>"
      "</inertial></link>";
  return "<robot name='wrist'><link name='foot'/><link name='a'>" + massless + "<link name='b'>" +
         massless + link("hand", 2) + turning("roll", "foot", "a", "0 0 1") +
         turning(pitch_name, "a", "b", "0 1 0") + turning("yaw", "b", "hand", "0 0 1") + "</robot>";
}

TEST(Run, AWristThatIsSingularSomewhereStartsElsewhere) {
  const auto start = [](double pitch) {
    TemporaryFolder folder;
    scene::Scene s;
    s.joints["pitch"] = {.position = pitch, .velocity = 0.2};
    s.joints["roll"] = {.position = 0.3, .velocity = 0.1};
    s.method = "gauss8";
    s.step = 0.01;
    s.duration = 1;
    s.record_every = 0.1;
    s.verify.energy = 1e-12;
    const Case c = make_case(folder, s, wrist_urdf());
    EXPECT_TRUE(scene::run(c.scene, c.assembly, into(folder / "out")).passed());
  };
  EXPECT_EQ(refusal([&] { start(1.0); }), "");
  EXPECT_TRUE(
      says(refusal([&] { start(0.0); }), "moves no inertia where it starts, a singular position"));
}

TEST(Run, AJointCalledLikeTheFolderItselfIsRefused) {
  TemporaryFolder folder;
  scene::Scene s;
  EXPECT_TRUE(says(refusal([&] { make_case(folder, s, wrist_urdf(".")); }),
                   "called '.', which no dataset of a results file can be"));
}

TEST(Run, NotesWhatStartsBeyondALimitOfTheModelFile) {
  TemporaryFolder folder;
  Case c = pendulum(folder);
  scene::Scene s = c.scene;
  std::string urdf = arm_urdf("<limit lower='-1' upper='0.5' effort='0' velocity='0'/>");
  for (size_t at; (at = urdf.find("continuous")) != std::string::npos;)
    urdf.replace(at, 10, "revolute");
  const auto elbow = urdf.rfind("</joint>");
  urdf.insert(elbow, "<limit lower='-9' upper='9' effort='0' velocity='0'/>");
  s.duration = 0.1;
  const Case limited = make_case(folder, s, urdf);
  const auto r = scene::run(limited.scene, limited.assembly, into(folder / "out"));
  int notes = 0;
  for (const auto& n : r.notes)
    notes += n.find(
                 "joint 'shoulder' is at 1.2 rad at the start, beyond its upper limit of 0.5 "
                 "rad") != std::string::npos;
  EXPECT_EQ(notes, 1);
  // Between the ends: thrown at 3 rad/s, it swings through both limits.
  urdf.replace(urdf.find("upper='0.5'"), 11, "upper='1.5'");
  s.duration = 3;
  s.record_every = 0.01;
  s.urdf.base = mechanics::UrdfOptions::Base::fixed;
  s.joints["shoulder"] = {1.2, 3};
  const Case swinging = make_case(folder, s, urdf);
  const auto through = scene::run(swinging.scene, swinging.assembly, into(folder / "swings"));
  EXPECT_TRUE(std::ranges::any_of(through.notes, [](const auto& n) {
    return says(n, "joint 'shoulder' reaches -1.") && says(n, "beyond its lower limit of -1 rad") &&
           !says(n, "elbow");
  })) << fmt::format("{}", fmt::join(through.notes, "\n"));
}

TEST(Run, AStartOfManyTurnsIsAskedAbout) {
  TemporaryFolder folder;
  scene::Scene s = pendulum(folder).scene;
  s.duration = 0.1;
  const auto asked = [&](double position) {
    s.joints["elbow"].position = position;
    const auto notes = scene::run(s, scene::assemble(s), into(folder / "out")).notes;
    return std::ranges::any_of(notes, [](const auto& n) {
      return says(n, "joint 'elbow' starts at 40 rad, 6.4 turns: are they degrees?");
    });
  };
  EXPECT_TRUE(asked(40));
  EXPECT_FALSE(asked(4)) << "control";
}

TEST(Run, NotesWhatIsFasterThanTheModelFileAllows) {
  TemporaryFolder folder;
  scene::Scene s = pendulum(folder).scene;
  s.duration = 0.1;
  const auto note = [&](const std::string& velocity) -> std::string {
    const Case c =
        make_case(folder, s,
                  arm_urdf("<limit lower='-9' upper='9' effort='0' velocity='" + velocity + "'/>"));
    for (const auto& n : scene::run(c.scene, c.assembly, into(folder / "out")).notes)
      if (says(n, "velocities of the model file's limits do not act")) return n;
    return "";
  };
  EXPECT_TRUE(says(note("0.01"), "joint 'shoulder' moves at -")) << note("0.01");
  EXPECT_TRUE(says(note("0.01"), "rad/s at the end, faster than its 0.01 rad/s"));
  EXPECT_EQ(note("100"), "") << "control";
}

TEST(Run, OneNoteNamesEveryJointBeyondItsLimit) {
  TemporaryFolder folder;
  scene::Scene s = pendulum(folder).scene;
  std::string urdf = arm_urdf("<limit lower='-1' upper='0.5' effort='0' velocity='0'/>");
  for (size_t at; (at = urdf.find("continuous")) != std::string::npos;)
    urdf.replace(at, 10, "revolute");
  urdf.insert(urdf.rfind("</joint>"), "<limit lower='3' upper='9' effort='0' velocity='0'/>");
  s.duration = 0.1;
  const Case limited = make_case(folder, s, urdf);
  const auto r = scene::run(limited.scene, limited.assembly, into(folder / "out"));
  std::string at_start;
  for (const auto& n : r.notes)
    if (n.find("at the start") != std::string::npos) at_start += n + "\n";
  EXPECT_EQ(std::count(at_start.begin(), at_start.end(), '\n'), 1) << at_start;
  for (const char* part :
       {"joint 'elbow' is at 0 rad", "its lower limit of 3 rad; 'shoulder' is at 1.2 rad"})
    EXPECT_NE(at_start.find(part), std::string::npos) << at_start;
}

}  // namespace
}  // namespace porthos::test::run_test
