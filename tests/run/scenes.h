#pragma once
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "scene/session/run.h"
#include "tests/support/bounds.h"

/// Small scenes, made here, in a temporary folder of their own.
namespace porthos::test {
namespace fs = std::filesystem;

/// A folder that is gone when the test is over.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string pattern = (fs::temp_directory_path() / "porthos_run_XXXXXX").string();
    if (!mkdtemp(pattern.data())) throw std::runtime_error("no temporary folder");
    path_ = pattern;
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  ~TemporaryFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  fs::path operator/(const std::string& name) const { return path_ / name; }

 private:
  fs::path path_;
};

inline std::string read_bytes(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}
inline void write_bytes(const fs::path& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

inline std::string link(const std::string& name, double mass) {
  const std::string m = std::to_string(mass), i = std::to_string(0.1 * mass);
  return "<link name='" + name + "'><inertial><origin xyz='0.1 0.05 -0.4'/><mass value='" + m +
         "'/><inertia ixx='" + i + "' iyy='" + i + "' izz='" + i +
         "' ixy='0' ixz='0' iyz='0'/></inertial></link>";
}
inline std::string joint(const std::string& name, const std::string& parent,
                         const std::string& child, const std::string& axis,
                         const std::string& more = "") {
  return "<joint name='" + name + "' type='continuous'><parent link='" + parent +
         "'/><child link='" + child + "'/><origin xyz='0 0 -0.5'/><axis xyz='" + axis + "'/>" +
         more + "</joint>";
}

/// A body and two links. `more`: further elements of the first joint.
inline std::string arm_urdf(const std::string& more = "") {
  return "<robot name='arm'>" + link("body", 20) + link("upper", 3) + link("lower", 2) +
         joint("shoulder", "body", "upper", "0 1 0", more) +
         joint("elbow", "upper", "lower", "1 0 0") + "</robot>";
}

/// Two arms on a fixed foot that do not feel each other.
inline std::string two_arms_urdf() {
  return "<robot name='two'><link name='foot'/>" + link("a", 2) + link("b", 3) +
         joint("ja", "foot", "a", "0 1 0") + joint("jb", "foot", "b", "0 1 0") + "</robot>";
}

struct Case {
  scene::Scene scene;
  scene::Assembly assembly;
};

/// Completes a scene: the text tells apart scenes that differ in what a checkpoint must notice.
inline Case make_case(const TemporaryFolder& folder, scene::Scene s, const std::string& urdf) {
  s.urdf_path = (folder / "model.urdf").string();
  s.urdf_text = urdf;
  write_bytes(s.urdf_path, urdf);
  if (s.text.empty()) s.text = "# " + s.title + "\n";
  return {s, scene::assemble(s)};
}

/// A free-floating arm.
inline Case floating_arm(const TemporaryFolder& folder, double duration = 20,
                         const std::string& method = "gauss8") {
  scene::Scene s;
  s.title = "floating arm";
  s.urdf.base = mechanics::UrdfOptions::Base::free;
  s.base.angular_velocity = {0.02, -0.05, 0.1};
  s.base.linear_velocity = {0.01, 0.02, 0};
  s.joints["shoulder"] = {0.4, 1.5};
  s.joints["elbow"] = {-0.7, -2.5};  // turns many times
  s.method = method;
  s.step = 0.02;
  s.duration = duration;
  s.record_every = 0.06;
  s.verify.energy = 1e-12;
  s.verify.linear_momentum = 1e-13;
  s.verify.angular_momentum = 1e-13;
  s.verify.quaternion_norm = 1e-13;
  s.verify.balance = 1e-12;
  s.verify.symmetry = 1e-11;
  return make_case(folder, s, arm_urdf());
}

/// A swinging double pendulum on a fixed base; damped where `damping` is not 0.
inline Case pendulum(const TemporaryFolder& folder, double damping = 0) {
  scene::Scene s;
  s.title = "double pendulum";
  s.urdf.gravity = {0, 0, -9.81};
  s.joints["shoulder"] = {1.2, 0};
  s.method = "gauss8";
  s.step = 0.01;
  s.duration = 10;
  s.record_every = 0.01;
  s.verify.energy = 1e-11;
  s.verify.angular_momentum = 1e-13;
  return make_case(folder, s, arm_urdf("<dynamics damping='" + std::to_string(damping) + "'/>"));
}

inline scene::RunOptions into(const fs::path& out, bool resume = false) {
  scene::RunOptions o;
  o.out = out.string();
  o.resume = resume;
  return o;
}

inline ::testing::AssertionResult says(const std::string& text, const std::string& words) {
  if (text.find(words) != std::string::npos) return ::testing::AssertionSuccess();
  return ::testing::AssertionFailure() << "\"" << text << "\" does not say \"" << words << "\"";
}

}  // namespace porthos::test
