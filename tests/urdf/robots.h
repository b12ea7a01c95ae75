#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "mechanics/urdf.h"

/// Small URDF texts, written so that tests know the line of everything.
namespace porthos::mechanics {

using Options = UrdfOptions;
namespace fs = std::filesystem;
using Names = std::vector<std::string>;

inline const std::string some_inertial =
    "<inertial><mass value='2'/>"
    "<inertia ixx='.3' ixy='0' ixz='0' iyy='.4' iyz='0' izz='.5'/></inertial>";

/// One line of text per element: the first of them is in line 2.
inline std::string robot(const std::vector<std::string>& lines) {
  std::string text = "<robot name=\"r\">\n";
  for (const auto& l : lines) text += l + "\n";
  return text + "</robot>\n";
}
inline std::string link(const std::string& name, const std::string& inside = some_inertial) {
  return "<link name=\"" + name + "\">" + inside + "</link>";
}
inline std::string joint(const std::string& name, const std::string& parent,
                         const std::string& child, const std::string& type = "revolute",
                         const std::string& inside = "") {
  return "<joint name=\"" + name + "\" type=\"" + type + "\"><parent link=\"" + parent +
         "\"/><child link=\"" + child + "\"/>" + inside + "</joint>";
}
/// base -- j -- arm, with the given inside of the joint in line 4.
inline std::string arm(const std::string& type, const std::string& inside = "") {
  return robot({link("base"), link("arm"), joint("j", "base", "arm", type, inside)});
}
/// The same with the given inside of the arm, in line 3.
inline std::string arm_link(const std::string& inside) {
  return robot({link("base"), link("arm", inside), joint("j", "base", "arm")});
}
inline UrdfResult parse(const std::string& text, const Options& options = {}) {
  return parse_urdf(text, "r.urdf", options);
}
inline Options massless(Options::Base base) {
  Options o;
  o.base = base;
  o.links_without_inertia = Options::NoInertia::massless;
  return o;
}
inline Options on_free_base() {
  Options o;
  o.base = Options::Base::free;
  return o;
}
inline const Options free_base = on_free_base();

}  // namespace porthos::mechanics
