#include <tinyxml2.h>

#include <cstdio>
#include <string_view>

#include "mechanics/urdf.h"
#include "mechanics/urdf_file-inl.h"

namespace porthos::mechanics {
namespace {

using tinyxml2::XMLElement;

const XMLElement& robot_in(tinyxml2::XMLDocument& d, const std::string& text,
                           const std::string& file) {
  if (d.Parse(text.c_str(), text.size()) != tinyxml2::XML_SUCCESS)
    throw InvalidArgument(file + ":" + std::to_string(d.ErrorLineNum()) + ": broken XML");
  const XMLElement* robot = d.FirstChildElement("robot");
  if (!robot) throw InvalidArgument(file + ": there is no <robot>");
  return *robot;
}

/// Puts the robot's name before every name of a link, joint or material in an element.
void rename(XMLElement& e, const std::string& prefix) {
  const std::string_view tag = e.Name();
  const auto set = [&](const char* attribute) {
    if (const char* own = e.Attribute(attribute)) e.SetAttribute(attribute, (prefix + own).c_str());
  };
  if (tag == "link" || tag == "joint" || tag == "material") set("name");
  if (tag == "parent" || tag == "child") set("link");
  if (tag == "mimic") set("joint");
  for (auto* child = e.FirstChildElement(); child; child = child->NextSiblingElement())
    rename(*child, prefix);
}

/// The link that is no joint's child.
std::string root_of(const XMLElement& robot) {
  for (auto* l = robot.FirstChildElement("link"); l; l = l->NextSiblingElement("link")) {
    const std::string_view name = l->Attribute("name") ? l->Attribute("name") : "";
    bool child = false;
    for (auto* j = robot.FirstChildElement("joint"); j; j = j->NextSiblingElement("joint"))
      if (const auto* c = j->FirstChildElement("child"))
        child = child || (c->Attribute("link") && name == c->Attribute("link"));
    if (!child) return std::string(name);
  }
  return "";
}

std::string three(const Vec3d& v) {
  char text[96];
  std::snprintf(text, sizeof text, "%.17g %.17g %.17g", v.x, v.y, v.z);
  return text;
}

/// Without line breaks, so that the text stands in one line.
void print(const XMLElement& e, std::string& out) {
  tinyxml2::XMLPrinter printer(nullptr, true);
  e.Accept(&printer);
  out += printer.CStr();
}

}  // namespace

std::string with_robot(const std::string& urdf, const std::string& other,
                       const std::string& other_file, const OtherRobot& robot) {
  tinyxml2::XMLDocument first, second, made;
  if (first.Parse(urdf.c_str(), urdf.size()) != tinyxml2::XML_SUCCESS ||
      !first.FirstChildElement("robot"))
    return urdf;  // its own reader says what is wrong
  const XMLElement& main = *first.FirstChildElement("robot");
  const XMLElement& more = robot_in(second, other, other_file);
  const std::string prefix = robot.name + ".";
  std::string text;
  bool has_world = false;
  for (auto* l = main.FirstChildElement("link"); l; l = l->NextSiblingElement("link"))
    has_world =
        has_world || (l->Attribute("name") && std::string_view(l->Attribute("name")) == "world");
  if (!has_world) text += "<link name=\"world\"/>";
  for (auto* e = more.FirstChildElement(); e; e = e->NextSiblingElement()) {
    const std::string_view tag = e->Name();
    if (tag != "link" && tag != "joint" && tag != "material") continue;
    auto* own = e->DeepClone(&made)->ToElement();
    made.InsertEndChild(own);
    rename(*own, prefix);
    print(*own, text);
  }
  auto* joint = made.NewElement("joint");
  made.InsertEndChild(joint);
  joint->SetAttribute("name", robot.name.c_str());
  joint->SetAttribute("type", robot.free ? "floating" : "fixed");
  auto* parent = joint->InsertNewChildElement("parent");
  parent->SetAttribute("link", "world");
  auto* child = joint->InsertNewChildElement("child");
  child->SetAttribute("link", (prefix + root_of(more)).c_str());
  if (!robot.free) {
    auto* origin = joint->InsertNewChildElement("origin");
    origin->SetAttribute("xyz", three(robot.at).c_str());
    origin->SetAttribute("rpy", three(robot.rpy).c_str());
  }
  print(*joint, text);
  const auto end = urdf.rfind("</robot");
  if (end == urdf.npos) return urdf;  // <robot/>
  return urdf.substr(0, end) + text + urdf.substr(end);
}

}  // namespace porthos::mechanics
