#pragma once
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "scene/assemble/assembly.h"

/// Scene files in a folder of their own, for the tests of the reader and of the assembly.
namespace porthos::scene {

namespace fs = std::filesystem;

inline constexpr const char* arm_urdf = R"(<robot name="arm">
  <link name="bus"><inertial><mass value="100"/>
    <inertia ixx="10" iyy="12" izz="8" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="upper"><inertial><origin xyz="0 0 0.5"/><mass value="10"/>
    <inertia ixx="1" iyy="1" izz="0.5" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="lower"/>
  <joint name="shoulder" type="revolute"><parent link="bus"/><child link="upper"/>
    <axis xyz="1 0 0"/><limit effort="1" velocity="1"/><dynamics damping="0.3"/></joint>
  <joint name="slide" type="prismatic"><origin xyz="0 0 1"/><parent link="upper"/><child link="lower"/>
    <axis xyz="0 1 0"/><limit effort="1" velocity="1"/></joint>
</robot>)";

/// Every key there is, each with a value that is not its default.
inline constexpr const char* full_scene = R"(title = "Everything"
[model]
urdf = "arm.urdf"
base = "free"
links_without_inertia = "massless"
use_damping = false
inertia.lower = { mass = 2, com = [0.1, 0, 0.2], inertia = [1, 2, 2.5, 0.1, 0.2, 0.3] }
[environment]
gravity = "uniform"
vector = [0, 0.5, -9.81]
[initial]
base = { position = [1, 2, 3], attitude_wxyz = [0, 3, 0, 4], linear_velocity = [4, 5, 6], angular_velocity = [7, 8, 9] }
joints.shoulder = { position = 0.3, velocity = -0.05 }
random = { seed = 7, joint_position = 0.5, joint_velocity = 0.25 }
[integrator]
method = "gauss8"
step = 0.25
rtol = 1e-10
step_control = "reversible"
step_control_rate = 2
step_control_length = 0.5
[run]
duration = 1000
record_every = 2.0
checkpoint_every = 30
[verify]
energy = 1e-12
linear_momentum = 1e-13
angular_momentum = 2e-13
quaternion_norm = 3e-13
balance = 4e-13
symmetry = 0
)";

class SceneFiles : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(testing::TempDir()) / ("porthos_scene_" + std::to_string(getpid()));
    fs::create_directories(folder_);
    write("arm.urdf", arm_urdf);
  }
  void TearDown() override { fs::remove_all(folder_); }

  std::string write(const std::string& name, const std::string& text) const {
    const std::string path = (folder_ / name).string();
    std::ofstream(path, std::ios::binary) << text;
    return path;
  }
  Scene read(const std::string& text) const { return read_scene(write("scene.toml", text)); }
  Assembly put_together(const std::string& text) const { return assemble(read(text)); }

  /// The message, with the folder taken out of it.
  std::string clean(std::string text) const {
    const std::string folder = folder_.string() + "/";
    for (auto at = text.find(folder); at != std::string::npos; at = text.find(folder))
      text.erase(at, folder.size());
    return text;
  }
  template <class F>
  std::string refusal(F f) const {
    try {
      f();
    } catch (const InvalidArgument& e) {
      return clean(e.what());
    }
    return "(nothing was refused)";
  }
  std::string error(const std::string& text) const {
    return refusal([&] { read(text); });
  }
  std::string assembly_error(const std::string& text) const {
    return refusal([&] { put_together(text); });
  }

  fs::path folder_;
};

/// A scene whose parts can be replaced; the numbers are their lines as long as no part before
/// grows.
struct Lines {
  std::string model = "urdf = \"arm.urdf\"\nbase = \"fixed\"";  // 2, 3
  std::string initial = "\n";                                   // 5
  std::string integrator = "method = \"gauss4\"\nstep = 0.1";   // 8, 9
  std::string run = "duration = 10.0";                          // 11
  std::string rest;                                             // 12
  operator std::string() const {
    return "[model]\n" + model + "\n[initial]\n" + initial + "\n[integrator]\n" + integrator +
           "\n[run]\n" + run + "\n" + rest;
  }
};

}  // namespace porthos::scene
