// Laws in Python as the porthos command runs them: killed and continued, in ensembles, and without
// the library that has the interpreter.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "scene/files/hdf5_reader.h"
#include "tests/places.h"

#if defined(PORTHOS_CLI) && defined(PORTHOS_PYTHON_LAW)
namespace porthos::test::laws_test {

namespace fs = std::filesystem;

class Laws : public testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = (fs::temp_directory_path() / "porthos_laws_XXXXXX").string();
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
    write("law.py",
          "class Law:\n    def __init__(self, joints, settings):\n"
          "        self.most, self.sum = settings['most'], 0.0\n"
          "    def __call__(self, t, q, v):\n        self.sum += 0.01 * (0.4 - q[0])\n"
          "        if t > 0.9 and q[0] > self.most:\n            raise ValueError('too far')\n"
          "        return 30 * (0.4 - q[0]) - 8 * v[0] + 20 * self.sum\n");
  }
  void TearDown() override {
    std::error_code ignored;
    if (!folder_.empty()) fs::remove_all(folder_, ignored);
  }
  void write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name, std::ios::binary) << text;
  }
  std::string read(const std::string& name) const {
    std::ifstream file(folder_ / name, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  void write_scene(const std::string& duration, const std::string& most,
                   const std::string& more = "") const {
    write("scene.toml",
          "[model]\nurdf = \"" PORTHOS_SOURCE_DIR
          "/examples/double_pendulum/double_pendulum.urdf\"\nbase = \"fixed\"\n[environment]\n"
          "gravity = \"uniform\"\nvector = [0, 0, -9.81]\n[initial]\njoints.shoulder.position = "
          "0.3\n[integrator]\nmethod = \"gauss8\"\nstep = 0.005\n[run]\nduration = " +
              duration +
              "\nrecord_every = 0.1\ncheckpoint_every = 0.001\n[[controller]]\ntype = "
              "\"python\"\nname "
              "= \"law\"\npython = \"law.py:Law\"\njoints = [\"shoulder\"]\nrate = 100\nsettings = "
              "{ most = " +
              most + " }\nnoise = { rate = 1e-3 }\n" + more);
  }
  /// @return the exit code; the output is in out.txt, errors in err.txt
  int shell(const std::string& line) const {
    const std::string command =
        "cd '" + folder_.string() + "' && { " + line + "; } >out.txt 2>err.txt </dev/null";
    const int status = std::system(command.c_str());
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }
  int porthos(const std::string& arguments, const std::string& before = "") const {
    return shell(before + "'" PORTHOS_CLI "' " + arguments);
  }
  fs::path folder_;
};

TEST_F(Laws, ARunThatIsKilledAndContinuedHasTheSameBytes) {
  write_scene("150", "100");
  const auto begin = std::chrono::steady_clock::now();
  ASSERT_EQ(porthos("run scene.toml --no-report --out whole"), 0) << read("err.txt");
  const std::chrono::duration<double> whole = std::chrono::steady_clock::now() - begin;
  // Killed ever later, so that a busy machine comes on, too.
  int killed = 0;
  double seconds = 0.2 * whole.count();
  for (; !fs::exists(folder_ / "parts/run.h5") && seconds < 100; seconds *= 1.4) {
    const bool begun = fs::exists(folder_ / "parts/checkpoint");
    const int code =
        porthos(std::string("run scene.toml --no-report --out parts") + (begun ? " --resume" : ""),
                "timeout -s KILL " + std::to_string(seconds) + " ");
    killed += code == 137;
    if (code == 2) fs::remove_all(folder_ / "parts");  // killed before its first checkpoint
  }
  std::printf("  killed %d times\n", killed);
  EXPECT_GE(killed, 1);
  EXPECT_TRUE(read("whole/run.h5") == read("parts/run.h5"));
  EXPECT_GT(read("whole/run.h5").size(), 10000u);
}

TEST_F(Laws, AnEnsembleHasTheSameBytesForAnyNumberOfThreadsAndNoiseOfItsOwnForEachCase) {
  const std::string cases =
      "[ensemble]\ncases = 6\nseed = 3\n[ensemble.vary]\n\"initial.joints.shoulder.velocity\" = { "
      "uniform = [-1e-300, 1e-300] }\n";
  write_scene("2", "100", cases);
  ASSERT_EQ(porthos("ensemble scene.toml --threads 1 --out one"), 0) << read("err.txt");
  ASSERT_EQ(porthos("ensemble scene.toml --threads 3 --out three"), 0) << read("err.txt");
  EXPECT_TRUE(read("one/ensemble.h5") == read("three/ensemble.h5"));
  // Cases that start alike end apart: each has a noise of its own.
  const scene::Hdf5Reader file(folder_ / "one/ensemble.h5");
  std::vector<double> x(size_t(file.dataset("final/x").size()));
  file.read("final/x", x.data());
  const size_t nx = x.size() / 6;
  for (size_t k = 1; k < 6; ++k) EXPECT_GT(std::fabs(x[k * nx] - x[0]), 1e-7) << k;
  for (size_t k = 1; k < 6; ++k) EXPECT_LT(std::fabs(x[k * nx] - x[0]), 1e-2) << k;
  write_scene("2", "0.35", cases);
  EXPECT_EQ(porthos("ensemble scene.toml --threads 1 --out fails"), 2);
  EXPECT_EQ(read("err.txt").rfind("porthos: case 0: controller 'law' at t = ", 0), 0u)
      << read("err.txt");
}

TEST_F(Laws, WithoutItsLibraryTheCommandSaysSoInASentence) {
  write_scene("1", "100");
  fs::create_directories(folder_ / "bin");
  fs::copy(PORTHOS_CLI, folder_ / "bin/porthos");
  EXPECT_EQ(shell("bin/porthos run scene.toml --no-report --out out"), 2);
  const std::string said = read("err.txt");
  EXPECT_NE(said.find("scene.toml:16:1: laws in Python need the library porthos_python_law.so"),
            said.npos)
      << said;
  // Negative control, and where an installed one is.
  fs::create_directories(folder_ / "lib/porthos");
  fs::copy(PORTHOS_PYTHON_LAW, folder_ / "lib/porthos/porthos_python_law.so");
  EXPECT_EQ(shell("bin/porthos run scene.toml --no-report --out out"), 0) << read("err.txt");
}

}  // namespace porthos::test::laws_test
#endif
