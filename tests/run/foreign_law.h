#pragma once
#include <fmt/format.h>

#include <cstdlib>

#include "energy_shaping/foreign_law.h"
#include "tests/places.h"
#include "tests/run/scenes.h"

/// Laws of a user's own, in Python and in C, over the joints of an arm.
namespace porthos::test {

/// Two rods under gravity with a controller; `keys` of [[controller]], after type, name and rate.
inline scene::Scene arm_with_law(const TemporaryFolder& folder, const std::string& type,
                                 const std::string& keys, double duration = 2,
                                 const std::string& more = "", const char* rate = "20") {
  write_bytes(folder / "arm.urdf", arm_urdf());
  write_bytes(
      folder / "scene.toml",
      fmt::format("[model]\nurdf = \"arm.urdf\"\nbase = \"fixed\"\n[environment]\ngravity = "
                  "\"uniform\"\nvector = [0, 0, -9.81]\n[initial]\njoints.shoulder.position = "
                  "0.5\njoints.elbow.position = 0.6\n[integrator]\nmethod = \"gauss8\"\nstep = "
                  "0.01\n[run]\nduration = {}\nrecord_every = 0.05\n[[controller]]\ntype = "
                  "\"{}\"\nname = \"law\"\nrate = {}\n{}\n{}",
                  duration, type, rate, keys, more));
  return scene::read_scene((folder / "scene.toml").string());
}
const std::string both_joints = "joints = [\"shoulder\", \"elbow\"]\n",
                  settings = "settings = { target = [1.0, -0.4], gain = 30, loss = 8 }\n",
                  in_python = "python = \"law.py:Law\"\n" + both_joints + settings,
                  in_c = "library = \"law.so\"\n" + both_joints;

/// PI and damping: it remembers the integral of the error.
inline std::string python_law(const std::string& members = "", const std::string& before = "") {
  return "import numpy as np\n\nclass Law:\n    def __init__(self, joints, settings):\n"
         "        assert joints == ['shoulder', 'elbow']\n"
         "        self.target, self.gain, self.loss = (settings[k] for k in ('target', 'gain', "
         "'loss'))\n        self.sum = [0.0, 0.0]\n" +
         members + "\n    def __call__(self, t, q, v):\n" + before +
         "        tau = np.zeros(2)\n        for k in range(2):\n"
         "            self.sum[k] += 0.05 * (self.target[k] - q[k])\n"
         "            tau[k] = self.gain * (self.target[k] - q[k]) - self.loss * v[k] + 20.0 * "
         "self.sum[k]\n        return tau\n";
}
/// The same in C99, with the settings as constants.
constexpr const char* c_law = R"(
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "energy_shaping/porthos_law.h"
static const double target[2] = {1.0, -0.4};
static void* create(int n, const char* const* names, int inputs, const char* settings,
                    char* message) {
  if (n != 2 || inputs != 0 || strcmp(names[0], "shoulder") != 0 || strcmp(settings, "{}") != 0) {
    sprintf(message, "it is for a shoulder and an elbow");
    return NULL;
  }
  return calloc(2, sizeof(double));
}
static int torques(void* law, double t, const double* q, const double* v, const double* inputs,
                   double* tau, char* message) {
  double* sum = law;
  (void)inputs;
  if (t > 1e3) return sprintf(message, "it is too late");
  for (int k = 0; k < 2; ++k) {
    sum[k] += 0.05 * (target[k] - q[k]);
    tau[k] = 30 * (target[k] - q[k]) - 8 * v[k] + 20.0 * sum[k];
  }
  return 0;
}
static int save(void* law, void* bytes, int size, char* message) {
  (void)message;
  if (size >= 16) memcpy(bytes, law, 16);
  return 16;
}
static int restore(void* law, const void* bytes, int size, char* message) {
  if (size != 16) return sprintf(message, "%d bytes", size);
  memcpy(law, bytes, 16);
  return 0;
}
const porthos_law* porthos_law_functions(void) {
  static const porthos_law all = {PORTHOS_LAW_VERSION, create, torques, save, restore, free};
  return &all;
}
)";
/// Compiles a law in C99 without a warning into folder / "law.so".
inline void compile_law(const TemporaryFolder& folder, const std::string& text) {
  write_bytes(folder / "law.c", text);
  const std::string command =
      "'" PORTHOS_COMPILER
      "' -x c -std=c99 -O1 -ffp-contract=off -Wall -Wextra -Wpedantic -Werror -shared -fPIC "
      "-I '" PORTHOS_SOURCE_DIR "' -o '" +
      (folder / "law.so").string() + "' '" + (folder / "law.c").string() + "'";
  ASSERT_EQ(std::system(command.c_str()), 0) << command;
}

/// Laws in Python by the library that the command uses, once.
inline bool have_python() {
#ifdef PORTHOS_PYTHON_LAW
  static const bool opened = [] {
    scene::use_python_laws(energy_shaping::open_law_library(PORTHOS_PYTHON_LAW, true));
    return true;
  }();
  return opened;
#else
  return false;
#endif
}

inline scene::RunReport run_into(const scene::Scene& s, const fs::path& out,
                                 std::int64_t stop_at = -1, bool resume = false) {
  auto o = into(out, resume);
  o.stop_at = stop_at;
  return scene::run(s, scene::assemble(s), o);
}
template <class F>
std::string refused(F f) {
  try {
    f();
  } catch (const InvalidArgument& e) {
    return e.what();
  }
  return "";
}

}  // namespace porthos::test
