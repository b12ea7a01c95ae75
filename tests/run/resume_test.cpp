#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cstdlib>
#include <nlohmann/json.hpp>

#include "scene/files/digest.h"
#include "scene/run/checkpoint.h"
#include "scene/run/growth_words.h"
#include "tests/run/killed.h"
#include "tests/run/scenes.h"

/// A run that is stopped, or killed, and continued gives the bits of the run that was not.
namespace porthos::test::resume_test {
namespace {

using scene::RunReport;

constexpr const char* results[] = {"run.h5", "summary.json", "energy_error.svg", "ledger.svg"};

/// What must agree of two runs: the files hold no times, so run.h5 is compared byte by byte.
void expect_same(const RunReport& a, const RunReport& b, const fs::path& out_a,
                 const fs::path& out_b) {
  EXPECT_TRUE(a.final_state == b.final_state);
  EXPECT_EQ(a.records, b.records);
  EXPECT_EQ(a.cost.evaluations, b.cost.evaluations);
  EXPECT_EQ(a.energy.rms_rel_error, b.energy.rms_rel_error);
  EXPECT_EQ(scene::growth_words(a), scene::growth_words(b));  // the exponent may be NaN
  EXPECT_EQ(a.angular_momentum_error, b.angular_momentum_error);
  EXPECT_TRUE(read_bytes(out_a / "run.h5") == read_bytes(out_b / "run.h5"));
  EXPECT_FALSE(fs::exists(out_b / "checkpoint"));
}

/// Runs until the progress says so, then sets the stop flag.
RunReport run_until(const Case& c, const fs::path& out, bool resume, std::atomic<bool>& stop) {
  auto options = into(out, resume);
  options.stop = &stop;
  options.progress = [&](double, double, double) { stop = true; };
  return scene::run(c.scene, c.assembly, options);
}

class Resume : public ::testing::TestWithParam<std::string> {};

TEST_P(Resume, AfterTheStopFlagAtSeveralPoints) {
  TemporaryFolder folder;
  const Case c = floating_arm(folder, std::getenv("PORTHOS_LONG") ? 1600 : 500, GetParam());
  const auto whole = scene::run(c.scene, c.assembly, into(folder / "whole"));

  std::atomic<bool> stop = true;  // at once: before the first step
  auto report = run_until(c, folder / "parts", false, stop);
  EXPECT_TRUE(report.interrupted);
  EXPECT_EQ(report.steps, 0);
  int parts = 1;
  for (; report.interrupted && parts < 200; ++parts) {
    for (const char* name : results) EXPECT_FALSE(fs::exists(folder / "parts" / name));
    stop = false;
    report = run_until(c, folder / "parts", true, stop);
  }
  EXPECT_GE(parts, 2);
  ASSERT_FALSE(report.interrupted);
  expect_same(whole, report, folder / "whole", folder / "parts");
  RecordProperty("parts", parts);
}

TEST_P(Resume, AfterBeingKilledAtRandomMoments) {
  TemporaryFolder folder;
  const bool longer = std::getenv("PORTHOS_LONG") != nullptr;
  const int kills = longer ? 20 : 3;
  Case c = floating_arm(folder, longer ? 8000 : 300, GetParam());
  RunReport whole;
  const double seconds =
      seconds_of([&] { whole = scene::run(c.scene, c.assembly, into(folder / "whole")); });
  c.scene.checkpoint_every = 0;  // as often as the clock is looked at

  std::srand(11);
  int killed = 0;
  const auto has_begun = [&] { return scene::has_checkpoint(folder / "parts" / "checkpoint"); };
  const auto part = [&](int) {
    scene::run(c.scene, c.assembly, into(folder / "parts", has_begun()));
  };
  ASSERT_NO_FATAL_FAILURE(kill_at_random(kills, (longer ? 0.06 : 0.3) * seconds, part, killed));
  std::printf("  killed %d times in a run of %.2f s\n", killed, seconds);
  EXPECT_GE(killed, longer ? kills : 1) << "the run was over before it could be killed";
  RecordProperty("killed", killed);
  const auto report = scene::run(c.scene, c.assembly, into(folder / "parts", has_begun()));
  expect_same(whole, report, folder / "whole", folder / "parts");
}

/// One method of each family that can be continued and takes a damped or undamped mechanism with a
/// rotating base.
std::vector<std::string> one_of_each_family() {
  TemporaryFolder folder;
  const Case c = floating_arm(folder);
  std::vector<std::string> names, families;
  for (const auto& d : integrators::catalogue()) {
    if (!d.resumable || d.rival || integrators::misfit(d, c.assembly.model->description()))
      continue;
    if (std::find(families.begin(), families.end(), d.family) != families.end()) continue;
    families.push_back(d.family);
    names.push_back(d.family == "Gauss collocation" ? "gauss8" : d.name);
  }
  return names;
}
INSTANTIATE_TEST_SUITE_P(Methods, Resume, ::testing::ValuesIn(one_of_each_family()),
                         [](const auto& i) { return i.param; });

TEST(Run, OfOneSceneTwiceGivesTheSameBits) {
  TemporaryFolder folder;
  const Case c = floating_arm(folder);
  const auto a = scene::run(c.scene, c.assembly, into(folder / "a"));
  const auto b = scene::run(c.scene, c.assembly, into(folder / "b"));
  expect_same(a, b, folder / "a", folder / "b");
}

/// A stopped run in folder / "out".
struct Stopped {
  TemporaryFolder folder;
  Case c = floating_arm(folder);
  fs::path out = folder / "out", state = out / "checkpoint" / "state.bin",
           log = out / "checkpoint" / "records.bin";
  Stopped() {
    const std::atomic<bool> stop = true;
    auto options = into(out);
    options.stop = &stop;
    scene::run(c.scene, c.assembly, options);
  }
  /// From the last checkpoint alone: damage_test.cpp is about the one before it.
  std::string resume() {
    fs::remove(out / "checkpoint" / "state.old");
    return refusal([&] { scene::run(c.scene, c.assembly, into(out, true)); });
  }
};

TEST(Digest, IsSha256) {  // FIPS 180-4, example "abc"
  EXPECT_EQ(scene::sha256("abc"),
            "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
}

TEST(Checkpoint, AnUnfinishedRunIsNotOverwritten) {
  Stopped s;
  const auto text = refusal([&] { scene::run(s.c.scene, s.c.assembly, into(s.out)); });
  EXPECT_EQ(text, s.out.string() +
                      " holds an unfinished run: use --resume (in Python resume=True) to continue "
                      "it, or remove "
                      "the folder");
  EXPECT_EQ(s.resume(), "");
}

TEST(Checkpoint, AFolderIsWrittenByOneRun) {
  Stopped s;
  const int other = open((s.out / "checkpoint/records.bin").c_str(), O_RDWR);
  ASSERT_EQ(flock(other, LOCK_EX | LOCK_NB), 0);
  EXPECT_EQ(s.resume(), "another run is writing into " + s.out.string());
  close(other);
  EXPECT_EQ(s.resume(), "");
}

TEST(Checkpoint, Missing) {
  TemporaryFolder folder;
  const Case c = floating_arm(folder);
  const auto text = refusal([&] { scene::run(c.scene, c.assembly, into(folder / "none", true)); });
  EXPECT_EQ(text, "there is no checkpoint in " + (folder / "none" / "checkpoint").string());
  EXPECT_FALSE(fs::exists(folder / "none"));
  scene::run(c.scene, c.assembly, into(folder / "done"));
  EXPECT_TRUE(
      says(refusal([&] { scene::run(c.scene, c.assembly, into(folder / "done", true)); }),
           "the run in " + (folder / "done").string() + " is finished, expected one that was"));
}

TEST(Checkpoint, TruncatedAtEveryLength) {
  Stopped s;
  const auto bytes = read_bytes(s.state);
  for (size_t n = 0; n < bytes.size(); n += 41) {
    write_bytes(s.state, bytes.substr(0, n));
    EXPECT_TRUE(says(s.resume(), "the checkpoint " + s.state.string() + " is truncated: it has " +
                                     std::to_string(n)));
  }
  write_bytes(s.state, bytes);
  EXPECT_EQ(s.resume(), "");
}

TEST(Checkpoint, WithOneWrongByteAnywhere) {
  Stopped s;
  const auto bytes = read_bytes(s.state);
  for (size_t at = 0; at < bytes.size(); at += 23) {
    auto wrong = bytes;
    wrong[at] = char(wrong[at] ^ 0x10);
    write_bytes(s.state, wrong);
    EXPECT_TRUE(says(s.resume(), s.state.string())) << "byte " << at;
  }
  auto wrong = bytes;
  wrong[bytes.size() / 2] ^= 1;
  write_bytes(s.state, wrong);
  EXPECT_EQ(s.resume(),
            "the checkpoint " + s.state.string() + " is damaged: its checksum does not fit");
}

TEST(Checkpoint, WithADamagedOrShortRecordLog) {
  Stopped s;
  const auto bytes = read_bytes(s.log);
  auto wrong = bytes;
  wrong[20] ^= 1;
  write_bytes(s.log, wrong);
  EXPECT_TRUE(says(s.resume(), s.log.string() + " is damaged"));
  write_bytes(s.log, bytes.substr(0, 100));
  EXPECT_TRUE(says(s.resume(), s.log.string() + " is truncated: it has 100 bytes"));
  write_bytes(s.log, bytes + std::string(1000, 'x'));  // written after the checkpoint: cut off
  EXPECT_EQ(s.resume(), "");
}

TEST(Checkpoint, OfAnotherScene) {
  Stopped s;
  const auto before = s.c.scene;
  s.c.scene.step = 0.04;
  EXPECT_EQ(s.resume(), "the checkpoint in " + (s.out / "checkpoint").string() +
                            " is of another run: the step was 0.02 s and is 0.04 s now");
  s.c.scene = before;
  s.c.scene.method = "gauss6";
  EXPECT_TRUE(says(s.resume(), "the method was gauss8 and is gauss6 now"));
  s.c.scene = before;
  s.c.scene.duration = 21;
  EXPECT_TRUE(says(s.resume(), "the duration was 20 s and is 21 s now"));
  s.c.scene = before;
  s.c.scene.text += " ";
  s.c.scene.urdf_text += " ";
  EXPECT_TRUE(says(s.resume(), "the scene file has changed; the model has changed"));
  s.c.scene = before;
  EXPECT_EQ(s.resume(), "");
}

// Every file the scene reads is part of what a checkpoint belongs to, and so is the program.
TEST(Checkpoint, WithAnEditedTableOrAnotherProgram) {
  TemporaryFolder folder;
  write_bytes(folder / "arm.urdf", arm_urdf());
  const auto table = [&](double stiffness) {
    std::string text = "deflection,sigma,torque\n";
    for (const double phi : {-1.0, -0.5, 0.0, 0.5, 1.0})
      text += std::to_string(phi) + ",0," + std::to_string(stiffness * phi) + "\n";
    write_bytes(folder / "spring.csv", text);
  };
  write_bytes(folder / "scene.toml",
              "[model]\nurdf = 'arm.urdf'\nbase = 'fixed'\n[[actuator]]\njoint = 'elbow'\ntable = "
              "'spring.csv'\n"
              "theta = { drive = 'torque', inertia = 0.1, command = { constant = 0.2 } }\n"
              "[integrator]\nmethod = 'gauss8'\nstep = 0.01\n[run]\nduration = 1.0\n");
  const auto go = [&](bool resume, bool stopped) {
    const auto s = scene::read_scene((folder / "scene.toml").string());
    const std::atomic<bool> stop = stopped;
    auto o = into(folder / "out", resume);
    o.stop = &stop;
    return scene::run(s, scene::assemble(s), o);
  };
  table(5);
  ASSERT_TRUE(go(false, true).interrupted);
  table(20);
  EXPECT_TRUE(says(refusal([&] { go(true, false); }),
                   "is of another run: the file spring.csv has changed"));
  table(5);  // as it was
  // The same checkpoint by a program of another revision.
  const auto at = folder / "out" / "checkpoint";
  auto c = scene::read_checkpoint(at);
  const auto mine = c.fingerprint;
  for (auto& [name, value] : c.fingerprint)
    if (name == "program") value = "porthos 0.0.1 (an older revision)";
  scene::write_checkpoint(at, c);
  EXPECT_TRUE(says(refusal([&] { go(true, false); }),
                   "the program was porthos 0.0.1 (an older revision) and is porthos "));
  c.fingerprint = mine;
  scene::write_checkpoint(at, c);
  EXPECT_FALSE(go(true, false).interrupted);
}

TEST(Checkpoint, AMethodThatCannotBeContinued) {
  Stopped s;
  s.c.scene.method = "cvode_adams";
  EXPECT_EQ(
      s.resume(),
      "a run by cvode_adams cannot be continued from a checkpoint: start it without --resume");
}

}  // namespace
}  // namespace porthos::test::resume_test
