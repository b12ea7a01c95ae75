// The n-th call that changes a file, asks for memory or starts a thread fails, for every n of a
// short run: the run goes on, or ends with one sentence, and what it had recorded is continued to
// the bytes of a run without a fault. So is that of a program which is killed.
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <random>
#include <sstream>

#include "tests/apps/pendulum.h"
#include "tests/places.h"
#if __has_include("tests/faults.h")
#include "tests/faults.h"
#endif

#if defined(PORTHOS_CLI) && defined(PORTHOS_FAULTS)
namespace porthos::test::faults_test {
namespace {

namespace fs = std::filesystem;

constexpr const char* text = R"(title = "Pendulum"
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
duration = 1.0
record_every = 0.1
[verify]
energy = 1e-11
[ensemble]
cases = 5
[ensemble.vary]
"initial.joints.hinge.velocity" = { uniform = [-1, 1] }
)";

/// A command and what it leaves: the results, the file with which they are complete, and what is
/// there while it is not at its end.
struct Command {
  std::string words;
  const char *results, *complete, *begun, *unfinished;
};
const Command one_run{"run scene.toml --no-report", "run.h5", "summary.json",
                      "checkpoint/state.bin", "checkpoint"};
const Command ensemble{"ensemble scene.toml --threads 1 --no-report", "ensemble.h5",
                       "ensemble.json", "parts/1_of_1.bin", "parts"};

std::string bytes_of(const fs::path& path) {
  std::ostringstream all;
  all << std::ifstream(path, std::ios::binary).rdbuf();
  return all.str();
}

/// That a results folder holds the bytes of a run without a fault, and nothing unfinished but what
/// was said to stay.
void expect_complete(const Command& c, const fs::path& out, const std::string& whole, long n,
                     bool stays = false) {
  EXPECT_TRUE(bytes_of(out / c.results) == whole) << n;
  EXPECT_TRUE(fs::exists(out / c.complete)) << n;
  EXPECT_EQ(fs::exists(out / c.unfinished), stays) << n;
}

class Faults : public testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = (fs::temp_directory_path() / "porthos_faults_XXXXXX").string();
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
    std::ofstream(folder_ / "scene.toml") << text;
    std::ofstream(folder_ / "pendulum.urdf") << pendulum;
  }
  void TearDown() override { fs::remove_all(folder_); }

  struct Answer {
    int code = 0;  ///< negative: a signal
    std::string err, out;
    /// Whether it says that a folder could not be removed which is not needed.
    bool stays() const {
      return (err + out).find("the results are complete without it") != std::string::npos;
    }
  };
  /// A command in the test's folder. before: variables of the environment.
  Answer porthos(const std::string& words, const std::string& before) const {
    const auto err = folder_ / "err", said = folder_ / "said";
    const std::string line = "cd '" + folder_.string() + "' && " + before + " '" + PORTHOS_CLI +
                             "' " + words + " >'" + said.string() + "' 2>'" + err.string() + "'";
    const int status = std::system(line.c_str());
    const int code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
    return {code > 128 ? 128 - code : code, bytes_of(err),
            bytes_of(said)};  // of a shell: 128 + signal
  }
  Answer run(const Command& c, const std::string& out, const std::string& more,
             const std::string& before) const {
    return porthos(c.words + " --out " + out + more, before);
  }
  std::string fault(long n, bool once, int error) const {
    return std::string("LD_PRELOAD='") + PORTHOS_FAULTS + "' PORTHOS_FAULT_OF=" + of_ +
           " PORTHOS_FAULT=" + std::to_string(n) + " PORTHOS_FAULT_LAST=" + (once ? "1" : "0") +
           " PORTHOS_FAULT_ERROR=" + std::to_string(error);
  }
  /// How many calls a run makes that change files.
  long calls(const Command& c) const {
    run(c, "counted", "", fault(0, false, 0) + " PORTHOS_FAULT_COUNT=count");
    return std::atol(bytes_of(folder_ / "count").c_str());
  }
  void every_fault(const Command& c, bool once, int error, long by);
  void every_kill(const Command& c, long by);
  int random_kills(const Command& c, int kills);
  void every_missing_memory(const Command& c, long by);

  fs::path folder_;
  std::string of_ = "files";  ///< which calls fail
};

void Faults::every_fault(const Command& c, bool once, int error, long by) {
  const long most = calls(c);
  const std::string whole = bytes_of(folder_ / "counted" / c.results);
  ASSERT_GT(most, 30);
  ASSERT_GT(whole.size(), 1000u);
  int went_on = 0, ended = 0, resumed = 0;
  for (long n = 1; n <= most; n += by) {
    const fs::path out = folder_ / "out";
    fs::remove_all(out);
    const Answer first = run(c, "out", "", fault(n, once, error));
    ASSERT_GE(first.code, 0) << "call " << n << ": signal " << -first.code << "\n" << first.err;
    if (first.code == 0) {
      ++went_on;
    } else {
      ++ended;
      EXPECT_EQ(first.code, 5) << n << ": " << first.err;
      EXPECT_EQ(std::count(first.err.begin(), first.err.end(), '\n'), 1) << n << ": " << first.err;
      EXPECT_NE(first.err.find("cannot "), std::string::npos) << n << ": " << first.err;
      const bool begun = fs::exists(out / c.begun);
      resumed += begun;
      const Answer second = run(c, "out", begun ? " --resume" : "", "");
      EXPECT_EQ(second.code, 0) << n << ": " << first.err << second.err;
    }
    expect_complete(c, out, whole, n, first.stays());
  }
  std::printf(
      "  %ld calls, every %ld: %d runs went on, %d ended with a sentence, %d of them were "
      "resumed\n",
      most, by, went_on, ended, resumed);
  EXPECT_GT(ended, 10);
  EXPECT_GT(resumed, 10);
}

long apart(long most) { return std::getenv("PORTHOS_LONG") ? 1 : most; }

TEST_F(Faults, OneCallFails) { every_fault(one_run, true, EIO, apart(1)); }
TEST_F(Faults, TheDiskIsFullFromACallOn) { every_fault(one_run, false, ENOSPC, apart(3)); }
TEST_F(Faults, OneCallOfAnEnsembleFails) { every_fault(ensemble, true, EIO, apart(2)); }
TEST_F(Faults, RightsAreLostFromACallOn) {
  of_ = "rights";
  every_fault(one_run, false, EACCES, apart(1));
}
TEST_F(Faults, HandlesRunOutFromACallOn) {
  of_ = "handles";
  every_fault(one_run, false, EMFILE, apart(1));
}

/// Each ends with a sentence, or does all of its work.
TEST_F(Faults, OneCallOfAnotherCommandFails) {
  ASSERT_EQ(run(one_run, "finished", "", "").code, 0);
  const auto afresh = [&](const std::string& words, const std::string& before) {
    fs::remove_all(folder_ / "of");
    fs::copy(folder_ / "finished", folder_ / "of", fs::copy_options::recursive);
    return porthos(words, before);
  };
  for (const char* words : {"report of", "plot of", "new pendulum.urdf --out of/new/scene.toml",
                            "judge of/run.h5 --model pendulum.urdf --out of/judged --no-report"}) {
    const int whole = afresh(words, fault(0, false, 0) + " PORTHOS_FAULT_COUNT=count").code;
    const long most = std::atol(bytes_of(folder_ / "count").c_str());
    int ended = 0;
    for (long n = 1; n <= most; ++n) {
      const Answer a = afresh(words, fault(n, true, ENOSPC));
      if (a.code == whole) continue;
      ++ended;
      EXPECT_EQ(a.code, 5) << words << ", call " << n << ": " << a.err;
      EXPECT_EQ(std::count(a.err.begin(), a.err.end(), '\n'), 1) << words << n << ": " << a.err;
    }
    std::printf("  %-70s %ld calls, %d ended it with a sentence\n", words, most, ended);
    EXPECT_GT(ended, 4) << words;
    EXPECT_GE(ended, most - 1) << words;
  }
}

/// Killed in every call that changes a file, a write when half of its bytes are there.
void Faults::every_kill(const Command& c, long by) {
  const long most = calls(c);
  const std::string whole = bytes_of(folder_ / "counted" / c.results);
  ASSERT_GT(whole.size(), 1000u);
  int runs = 0, killed = 0, resumed = 0, left = 0;
  for (long n = 1; n <= most; n += by, ++runs) {
    const fs::path out = folder_ / "out";
    fs::remove_all(out);
    for (const bool again : {true, true, false}) {  // killed, killed in what comes then, left alone
      const bool begun = fs::exists(out / c.begun);
      if (!begun && fs::exists(out / c.complete)) break;
      const Answer a =
          run(c, "out", begun ? " --resume" : "", again ? fault(n, true, -SIGKILL) : "");
      ASSERT_TRUE(a.code == 0 || (again && a.code == -SIGKILL)) << n << ": " << a.err;
      killed += a.code != 0;
      resumed += begun;
    }
    // Killed while the checkpoint was removed: what is left of it is none.
    const bool remains = fs::exists(out / c.unfinished) && !fs::exists(out / c.begun);
    expect_complete(c, out, whole, n, remains);
    left += remains;
  }
  EXPECT_LE(left, 7) << "the calls that remove a checkpoint";
  std::printf("  %ld calls, every %ld: %d runs were killed %d times and resumed %d times\n", most,
              by, runs, killed, resumed);
  EXPECT_GT(killed, runs);
  EXPECT_GT(resumed, runs);
}
TEST_F(Faults, KilledWhileFilesAreWritten) { every_kill(one_run, apart(2)); }
TEST_F(Faults, KilledWhileFilesOfAnEnsembleAreWritten) { every_kill(ensemble, apart(3)); }

/// Killed at random moments again and again, until it comes to its end or `kills` are reached.
int Faults::random_kills(const Command& c, int kills) {
  const auto begun = [&] { return fs::exists(folder_ / "out" / c.begun); };
  const auto started = std::chrono::steady_clock::now();
  EXPECT_EQ(run(c, "whole", "", "").code, 0);
  const double longest =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
  const std::string whole = bytes_of(folder_ / "whole" / c.results);
  int killed = 0, ends = 0;
  std::mt19937 random(7);
  while (killed < kills) {
    fs::remove_all(folder_ / "out");
    for (bool done = false; !done;) {
      const double after = longest * std::uniform_real_distribution<double>(0, 1.2)(random);
      // In the foreground it waits until what it killed has ended, and with it its lock.
      const Answer a = run(c, "out", begun() ? " --resume" : "",
                           "timeout --foreground -s KILL " + std::to_string(after));
      if (a.code == -SIGKILL) {
        ++killed;
        continue;
      }
      EXPECT_TRUE(a.code == 0 || a.code == 124) << a.err;  // 124: it ended as its time was up
      done = true;
    }
    ++ends;
    EXPECT_TRUE(bytes_of(folder_ / "out" / c.results) == whole) << "after " << killed << " kills";
    if (HasFailure()) break;
  }
  std::printf("  killed %d times, %d runs came to their end with the same bytes\n", killed, ends);
  return killed;
}

TEST_F(Faults, KilledAtRandomMomentsLONG) {
  std::string longer = text;
  longer.replace(longer.find("duration = 1.0"), 14, "duration = 100\ncheckpoint_every = 1e-3");
  std::ofstream(folder_ / "scene.toml") << longer;
  const int kills = std::getenv("PORTHOS_LONG") ? 500 : 6;
  EXPECT_GE(random_kills(one_run, kills), kills);
  longer.replace(longer.find("cases = 5"), 9, "cases = 50");
  std::ofstream(folder_ / "scene.toml") << longer;
  EXPECT_GE(random_kills(ensemble, kills), kills);
}

/// Memory that one call does not get. Before main() begins nothing can be said, and nothing is
/// lost; readers may take it for a fault of their file; JSON's destructor may die of it.
void Faults::every_missing_memory(const Command& c, long by) {
  of_ = "memory";
  const long most = calls(c);
  const std::string whole = bytes_of(folder_ / "counted" / c.results);
  ASSERT_GT(most, 4000) << "the calls are counted";
  ASSERT_GT(whole.size(), 1000u);
  int went_on = 0, ended = 0, misread = 0, died = 0, early = 0, resumed = 0;
  for (long n = 1; n <= most; n += by) {
    const fs::path out = folder_ / "out";
    fs::remove_all(out);
    const Answer first = run(c, "out", "", fault(n, true, ENOMEM));
    EXPECT_NE(first.code, 1) << n << ": a verdict made of missing memory";
    const bool begun = fs::exists(out / c.begun), there = fs::exists(out / c.complete);
    went_on += first.code == 0;
    ended += first.code == 5;
    misread += first.code == 2;
    early += first.code < 0 && !begun && !there;
    died += first.code < 0 && (begun || there);
    if (first.code > 0) {
      EXPECT_EQ(std::count(first.err.begin(), first.err.end(), '\n'), 1) << n << ": " << first.err;
    }
    if (first.code != 0) {
      resumed += begun;
      const Answer second = run(c, "out", begun ? " --resume" : "", "");
      EXPECT_EQ(second.code, 0) << n << ": " << first.err << second.err;
    }
    EXPECT_TRUE(bytes_of(out / c.results) == whole) << n;
  }
  std::printf(
      "  %ld calls, every %ld: %d runs went on, %d ended with a sentence, %d took it for a fault "
      "of "
      "a file, %d died before main(), %d later; %d were resumed\n",
      most, by, went_on, ended, misread, early, died, resumed);
  const int all = went_on + ended + misread + early + died;
  EXPECT_GT(ended, all / 2);
  EXPECT_GT(resumed, 2);
  EXPECT_LE(died, 1 + all / 500);
  EXPECT_LE(misread, 2 + all / 100);
}
TEST_F(Faults, MemoryIsMissing) { every_missing_memory(one_run, apart(61)); }
TEST_F(Faults, MemoryIsMissingInAnEnsemble) { every_missing_memory(ensemble, apart(97)); }

TEST_F(Faults, AThreadDoesNotStart) {
  of_ = "threads";
  const Command c{"ensemble scene.toml --threads 2 --no-report", "ensemble.h5", "ensemble.json",
                  "parts/1_of_1.bin", "parts"};
  ASSERT_EQ(calls(c), 1);
  const Answer a = run(c, "out", "", fault(1, true, EAGAIN));
  EXPECT_EQ(a.code, 5);
  EXPECT_NE(a.err.find("Resource temporarily unavailable"), std::string::npos) << a.err;
  EXPECT_EQ(run(c, "out", fs::exists(folder_ / "out" / c.begun) ? " --resume" : "", "").code, 0);
  EXPECT_TRUE(bytes_of(folder_ / "out/ensemble.h5") == bytes_of(folder_ / "counted/ensemble.h5"));
}

// Without the trial in a process of its own this file ends the command by a signal: HDF5 1.10 frees
// what it never set, and the C library is told to fill memory with rubbish.
TEST_F(Faults, AFileThatHdf5DiesOfIsOneSentence) {
  const std::string file =
      std::string(PORTHOS_SOURCE_DIR) + "/tests/fuzz/corpus/trajectory_h5/heap_of_names.h5";
  const Command judge{("judge '" + file + "' --model pendulum.urdf"), "", "", "", ""};
  const Answer a = run(judge, "judged", "", "MALLOC_PERTURB_=165");
  EXPECT_EQ(a.code, 2);
  EXPECT_EQ(a.err,
            "porthos: cannot read " + file + ": it is damaged: the HDF5 library dies of it\n");
}

TEST_F(Faults, AReadOnlyFolderIsOneSentence) {
  const Answer a = run(one_run, "out", "", fault(1, false, EROFS));
  EXPECT_EQ(a.code, 5);
  EXPECT_NE(a.err.find("Read-only file system"), std::string::npos) << a.err;
  EXPECT_FALSE(fs::exists(folder_ / "out" / "run.h5"));
}

// A file at the limit of ulimit -f, in steps of 512 bytes: a write that fails, not a signal.
TEST_F(Faults, FilesMayNotGrow) {
  ASSERT_EQ(run(one_run, "whole", "", "").code, 0);
  const std::string whole = bytes_of(folder_ / "whole" / one_run.results);
  int ended = 0, resumed = 0;
  for (int blocks = 1;; ++blocks) {
    const fs::path out = folder_ / "out";
    fs::remove_all(out);
    const Answer first = run(one_run, "out", "", "ulimit -f " + std::to_string(blocks) + " &&");
    if (first.code == 0) break;
    ++ended;
    ASSERT_EQ(first.code, 5) << blocks << ": " << first.err;
    EXPECT_EQ(std::count(first.err.begin(), first.err.end(), '\n'), 1) << first.err;
    EXPECT_NE(first.err.find("File too large"), std::string::npos) << first.err;
    const bool begun = fs::exists(out / one_run.begun);
    resumed += begun;
    EXPECT_EQ(run(one_run, "out", begun ? " --resume" : "", "").code, 0) << blocks;
    expect_complete(one_run, out, whole, blocks);
  }
  std::printf("  %d limits ended the run with a sentence, after %d of them it was resumed\n", ended,
              resumed);
  EXPECT_GT(ended, 10);
  EXPECT_GT(resumed, 5);
}

}  // namespace
}  // namespace porthos::test::faults_test
#endif
