#include "scene/read/schema.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "phs/error.h"
#include "scene/ensemble/ensemble.h"
#include "scene/plan/plan_scene.h"
#include "scene/read/scene_texts.h"
#include "tests/places.h"

/// The schema says what the reader says: each table is given a key the reader does not know, which
/// names those it knows.
namespace porthos::scene::schema_test {
namespace {

constexpr const char* urdf =
    R"(<robot name="arm"><link name="base"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="rod"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="j" type="continuous"><parent link="base"/><child link="rod"/><axis xyz="0 0 1"/></joint></robot>)";

const std::string theta = "theta = { drive = \"fixed\" }\n";
const std::string actuator =
    "[[actuator]]\njoint = \"j\"\nfamily = \"series_elastic\"\nparameters = { k = 1 }\n";
const std::string motor =
    "[[element]]\ntype = \"dc_motor\"\njoint = \"j\"\ninductance = 1\nresistance = 1\nconstant = "
    "1\n";
const std::string law = "[[controller]]\ntype = \"{}\"\nname = \"c\"\n";
const std::string wrench = "[[element]]\ntype = \"wrench\"\nname = \"w\"\nlink = \"rod\"\n";
const std::string force = "[[element]]\ntype = \"force\"\njoint = \"j\"\n";

/// Scene texts with @ where a key of each table may stand, by id; the tables every scene has are
/// put in where they miss.
std::map<std::string, std::string> places() {
  std::map<std::string, std::string> p{
      {"scene", "@"},
      {"model", "[model]\nurdf = \"a\"\nbase = \"free\"\n@"},
      {"model.inertia", "[model]\nurdf = \"a\"\nbase = \"free\"\n[model.inertia.rod]\nmass = 1\n@"},
      {"environment", "[environment]\n@"},
      {"initial", "[initial]\n@"},
      {"initial.base", "[initial.base]\n@"},
      {"initial.joints", "[initial.joints.j]\n@"},
      {"initial.random", "[initial.random]\n@"},
      {"integrator", "[integrator]\nmethod = \"gauss4\"\nstep = 1\n@"},
      {"monitor", "[monitor]\nlimit = 1\n@"},
      {"run", "[run]\nduration = 10\n@"},
      {"verify", "[verify]\n@"},
      {"ensemble", "[ensemble]\n@"},
      {"robot", "[[robot]]\nname = \"r\"\nbase = \"free\"\n@"},
      {"plan", "[plan]\n@[plan.joints]\nj = {}\n"},
      {"plan.joints", "[plan.joints.j]\n@"},
      {"plan.outputs", "[plan]\njoints = { j = {} }\n[plan.outputs.c]\n@"},
      {"plan.base", "[plan]\njoints = { j = {} }\n[plan.base]\n@"},
      {"pieces", force + "[element.pieces]\nperiod = 1\nvalues = [0]\n@"},
      {"body", "[[body]]\nname = \"b\"\nmass = 1\ninertia = [1, 1, 1, 0, 0, 0]\n@"},
      {"actuator", actuator + theta + "@"},
      {"actuator.limits", actuator + theta + "[actuator.limits]\n@"},
      {"actuator.drive", actuator + "[actuator.theta]\ndrive = \"torque\"\n@"},
      {"signal_file", force + "[element.file]\npath = \"w.csv\"\nvalue = \"x\"\n@"},
      {"vector_signal", wrench + "[element.force]\ndirection = [1, 0, 0]\nconstant = 1\n@"},
      {"signal_columns", wrench + "[element.force.components]\npath = \"w.csv\"\nx = \"x\"\n@"},
      {"signal", motor + "[element.voltage]\n@"},
      {"sine", force + "[element.sine]\namplitude = 1\nfrequency = 1\n@"},
      {"profile", force + "[element.profile]\ntimes = [0, 1]\nvalues = [0, 1]\n@"},
      {"planet.magnetic", "[orbit]\naltitude = 5e5\n[planet.magnetic]\nequator = 3e-5\n@"},
      {"orbit.plates",
       "[orbit]\naltitude = 5e5\n[[orbit.plates]]\nlink = \"rod\"\narea = 1\nnormal = [1, 0, "
       "0]\n@"},
      {"panel",
       "[[panel]]\nname = \"p\"\nlink = \"rod\"\nlength = 1\nmass = 1\nbending_stiffness = 1\n@"},
      {"loop",
       "[[loop]]\nname = \"l\"\ntype = \"revolute\"\na = { link = \"rod\" }\nb = { link = "
       "\"base\" }\n@"},
      {"loop.frame",
       "[[loop]]\nname = \"l\"\ntype = \"revolute\"\nb = { link = \"base\" }\n[loop.a]\nlink = "
       "\"rod\"\n@"},
      {"contact", "[[contact]]\nname = \"c\"\nlinks = [\"rod\"]\n@"},
      {"contact.shape",
       "[[contact]]\nname = \"c\"\nlinks = [\"rod\"]\n[contact.shape]\nkind = \"plane\"\n@"},
      {"coupling", "[[coupling]]\nname = \"c\"\nfactors = { j = 1 }\n@"},
      {"rolling", "[[rolling]]\nname = \"r\"\ntype = \"blade\"\nwheel = { link = \"rod\" }\n@"},
      {"motion", "[[motion]]\nname = \"m\"\njoint = \"j\"\n@"},
      {"motion.moves",
       "[[motion]]\nname = \"m\"\njoint = \"j\"\n[motion.moves]\nat = [0]\nduration = [1]\nto = "
       "[1]\n@"},
      {"motion.steady", "[[motion]]\nname = \"m\"\njoint = \"j\"\n[motion.steady]\nrate = 1\n@"},
      {"motion.swing",
       "[[motion]]\nname = \"m\"\njoint = \"j\"\n[motion.swing]\namplitude = 1\nfrequency = "
       "1\n@"},
      {"pulses",
       "[[element]]\ntype = \"thruster\"\nname = \"t\"\nlink = \"rod\"\ndirection = [1, 0, "
       "0]\nthrust = "
       "1\n[element.pulses]\nperiod = 1\nwidth = 0.5\ncount = 1\n@"},
      {"planet", "[orbit]\naltitude = 5e5\n[planet]\n@"},
      {"orbit", "[orbit]\naltitude = 5e5\n@"},
      {"orbit.drag",
       "[orbit]\naltitude = 5e5\n[orbit.drag]\ndensity = 1\naltitude = 1e5\nscale_height = "
       "1e4\narea_coefficient = 1\n@"},
      {"controller.potential.joint",
       fmt::format(fmt::runtime(law), "potential") + "[controller.joints.j]\n@"},
      {"controller.potential.pose",
       fmt::format(fmt::runtime(law), "potential") +
           "joints = { j = { damping = 1 } }\n[controller.poses.rod]\n@"},
      {"controller.tank", fmt::format(fmt::runtime(law), "potential") +
                              "joints = { j = { damping = 1 } }\n[controller.tank]\nlevel = 1\n@"},
      {"controller.null_space.joint",
       fmt::format(fmt::runtime(law), "null_space") +
           "tank = { level = 1 }\ntask = { link = \"rod\", attitude_stiffness = [1, 1, 1] }\n"
           "[controller.joints.j]\nstiffness = 1\ndamping = 1\n@"},
      {"controller.null_space.task",
       fmt::format(fmt::runtime(law), "null_space") +
           "tank = { level = 1 }\njoints = { j = { stiffness = 1, damping = 1 } }\n"
           "[controller.task]\nlink = \"rod\"\n@"},
      {"controller.whole_body.limit",
       fmt::format(fmt::runtime(law), "whole_body") + "rate = 1\n[controller.limits.j]\n@"},
      {"controller.whole_body.lift",
       fmt::format(fmt::runtime(law), "whole_body") +
           "rate = 1\ncontacts = [\"f\"]\n[controller.lifted.f]\nwhen = [[0, 1]]\n@"},
      {"controller.whole_body.gait",
       fmt::format(fmt::runtime(law), "whole_body") +
           "rate = 1\ncontacts = [\"f\"]\n[controller.gait]\nperiod = 1\nswing = [0]\n@"},
      {"controller.whole_body.joint",
       fmt::format(fmt::runtime(law), "whole_body") +
           "rate = 1\n[[controller.task]]\nquantity = \"posture\"\nbandwidth = 1\n"
           "[controller.task.joints.j]\ntarget = 0\n@"},
      {"controller.esp.joint",
       fmt::format(fmt::runtime(law), "esp") + "[controller.joints.j]\nstiffness = 1\n@"},
      {"controller.tracking.joint",
       fmt::format(fmt::runtime(law), "tracking") + "[controller.joints.j]\nkp = 1\nkd = 1\n@"},
      {"controller.lqr.joint", fmt::format(fmt::runtime(law), "lqr") + "[controller.joints.j]\n@"},
      {"sensing.resolution",
       fmt::format(fmt::runtime(law), "potential") +
           "rate = 1\njoints = { j = { damping = 1 } }\n[controller.resolution]\n@"},
      {"sensing.noise", fmt::format(fmt::runtime(law), "potential") +
                            "rate = 1\njoints = { j = { damping = 1 } }\n[controller.noise]\n@"},
      {"controller.ida_pbc.joint",
       fmt::format(fmt::runtime(law), "ida_pbc") +
           "design = \"ball_and_beam\"\ndrives = \"j\"\ngains = { kp = 1, kv = 1 }\n"
           "[controller.joints.j]\ntarget = 0\n@"},
      {"controller.ida_pbc.engine", fmt::format(fmt::runtime(law), "ida_pbc") +
                                        "design = \"vtol\"\njoints = { j = { target = 0 } }\ngains "
                                        "= { k1 = 1, k2 = 1, k3 = 1, P "
                                        "= 1, kv = 1 }\n[controller.engine]\nlink = \"rod\"\n@"},
      {"controller.ida_pbc.gains",
       fmt::format(fmt::runtime(law), "ida_pbc") +
           "design = \"ball_and_beam\"\ndrives = \"j\"\n[controller.gains]\nkp = 1\nkv = 1\n@"},
      {"controller.motor_side.joint", fmt::format(fmt::runtime(law), "motor_side") +
                                          "[controller.joints.j]\nstiffness = 1\ndamping = 1\n@"},
      {"controller.swing_up.joint",
       fmt::format(fmt::runtime(law), "swing_up") +
           "drives = \"j\"\nenergy = 1\n[controller.joints.j]\ntarget = 0\n@"},
      {"orbit.sunlight", "[orbit]\naltitude = 5e5\n[orbit.sunlight]\narea_coefficient = 1\n@"}};
  const std::map<std::string, std::string> besides{
      // so that what is read first is there
      {"controller.potential", "name = \"c\"\nrate = 1\njoints = { j = { damping = 1 } }\n"},
      {"controller.wheel_attitude",
       "name = \"c\"\nrate = 1\nlink = \"base\"\nwheels = []\nstiffness = [1, 1, 1]\ndamping = [1, "
       "1, "
       "1]\n"},
      {"controller.null_space",
       "name = \"c\"\nrate = 1\ntask = { link = \"rod\", attitude_stiffness = [1, 1, 1] }\n"
       "joints = { j = { stiffness = 1, damping = 1 } }\ntank = { level = 1 }\n"},
      {"controller.whole_body",
       "name = \"c\"\nrate = 1\ntask = [{ quantity = \"posture\", bandwidth = 1 }]\n"},
      {"controller.esp", "name = \"c\"\nrate = 1\njoints = { j = { stiffness = 1 } }\n"},
      {"controller.tracking", "name = \"c\"\nrate = 1\njoints = { j = { kp = 1, kd = 1 } }\n"},
      {"controller.lqr", "name = \"c\"\nrate = 1\njoints = { j = { position = 1 } }\n"},
      {"controller.python",
       "name = \"c\"\nrate = 1\njoints = [\"j\"]\npython = \"" PORTHOS_SOURCE_DIR
       "/python/make_stubs.py:Law\"\n"},
      {"controller.shared_library",
       "name = \"c\"\nrate = 1\njoints = [\"j\"]\nlibrary = \"" PORTHOS_SOURCE_DIR "/LICENSE\"\n"},
      {"controller.swing_up", "name = \"c\"\nrate = 1\ndrives = \"j\"\nenergy = 1\n"},
      {"controller.ida_pbc",
       "name = \"c\"\nrate = 1\ndesign = \"ball_and_beam\"\ndrives = \"j\"\ngains = { kp = 1, kv = "
       "1 }\n"},
      {"controller.motor_side",
       "name = \"c\"\nrate = 1\njoints = { j = { stiffness = 1, damping = 1 } }\n"},
      {"element.controller", "joint = \"j\"\nstiffness = 1\n"},
      {"element.thruster", "name = \"t\"\nlink = \"rod\"\ndirection = [1, 0, 0]\nthrust = 1\n"},
      {"element.wrench",
       "name = \"t\"\nlink = \"rod\"\nforce = { direction = [1, 0, 0], constant = 1 }\n"},
      {"element.torquer", "name = \"t\"\ndirection = [1, 0, 0]\n"},
      {"element.soft_latch", "name = \"t\"\nlink = \"rod\"\nbody = \"base\"\n"},
      {"element.line_spring", "name = \"t\"\nlink = \"rod\"\n"}};
  for (const auto& t : schema())
    if (const auto type = t.heading.find("type = \""); type != t.heading.npos)
      p[t.id] = t.heading.substr(0, type - 1) + "\n" + t.heading.substr(type) + "\n" +
                (besides.count(t.id) ? besides.at(t.id) : "joint = \"j\"\n") + "@";
  const auto has_link = [](const auto& t) {
    return std::ranges::any_of(t.keys, [](const auto& key) { return key.name == "link"; });
  };
  const std::string task_of = "controller.whole_body.task.";
  for (const auto& t : schema())
    if (t.id.starts_with(task_of))
      p[t.id] = fmt::format(fmt::runtime(law), "whole_body") +
                "rate = 1\n[[controller.task]]\nquantity = \"" + t.id.substr(task_of.size()) +
                "\"\nbandwidth = 1\n" + (has_link(t) ? "link = \"rod\"\n@" : "@");
  for (const auto& t : schema())
    if (t.id.rfind("output.", 0) == 0) {
      const auto word = t.id.substr(7);
      p[t.id] = "[[output]]\nquantity = \"" + word + "\"\nname = \"o\"\nlink = \"rod\"\n@";
      if (!has_link(t)) p[t.id] = "[[output]]\nquantity = \"" + word + "\"\nname = \"o\"\n@";
    }
  p["stop"] =
      "[[output]]\nquantity = \"centre_of_mass\"\nname = \"c\"\n[[stop]]\noutput = "
      "\"c.x\"\nabove = 1\n@";
  for (const char* e :
       {"capture", "release", "lock", "unlock", "engage", "disengage", "close", "open"})
    p[fmt::format("event.{}", e)] = fmt::format("[[event]]\ntype = \"{}\"\nat = 5\n@", e);
  return p;
}

std::string whole(std::string text) {
  std::string before;
  if (text.find("[model]") == text.npos) before = "[model]\nurdf = \"a\"\nbase = \"free\"\n";
  if (text.find("[integrator]") == text.npos)
    before += "[integrator]\nmethod = \"gauss4\"\nstep = 1\n";
  if (text.find("[run]") == text.npos) before += "[run]\nduration = 10\n";
  return text.rfind("@", 0) == 0 || text.rfind("zzz", 0) == 0 ? text + before : before + text;
}

std::string refusal(const std::string& text) {
  try {
    const Scene s = read_scene_again("s.toml", {text, urdf, {{"w.csv", "t,x\n0,1\n1,2\n"}}});
    if (text.find("[ensemble]") != text.npos) Ensemble{s};
    if (text.find("[plan") != text.npos) (void)read_plan(s);
    return "";
  } catch (const InvalidArgument& e) {
    return e.what();
  }
}

std::string with(std::string text, const std::string& key) {
  text.replace(text.find('@'), 1, key + "\n");
  return whole(text);
}

TEST(Schema, TablesHaveTheKeysTheReaderKnows) {
  const auto place = places();
  for (const auto& t : schema()) {
    ASSERT_TRUE(place.count(t.id)) << "no scene of this test has the table " << t.id;
    const std::string said = refusal(with(place.at(t.id), "zzz = 1"));
    const auto known = said.find("(known: ");
    ASSERT_NE(known, said.npos) << t.id << ": " << said;
    std::set<std::string> reader, ours;
    std::istringstream list(said.substr(known + 8, said.rfind(')') - known - 8));
    for (std::string key; std::getline(list, key, ',');)
      reader.insert(key.substr(key.find_first_not_of(' ')));
    for (const auto& k : t.keys) ours.insert(k.name);
    EXPECT_EQ(ours, reader) << t.id;
  }
}

/// Every value of a wrong kind is refused in words of the right one.
TEST(Schema, KeysAreOfTheKindTheReaderExpects) {
  using Kind = SchemaKey::Kind;
  const auto place = places();
  int tested = 0, all = 0;
  for (const auto& t : schema())
    for (const auto& k : t.keys) {
      ++all;
      std::string text = place.at(t.id);
      // A key that is there already gives way.
      const auto there = text.rfind("\n" + k.name + " = ");
      if (there != text.npos && there > text.rfind('[', text.find('@')))
        text.erase(there, text.find('\n', there + 1) - there);
      const std::string said = refusal(with(text, k.name + " = 1979-05-27"));
      EXPECT_NE(said, "") << t.id << "." << k.name << " is never looked at";
      if (said.find("is a date") == said.npos && said.find("of a date") == said.npos)
        continue;  // something else misses first
      const std::map<Kind, const char*> words{{Kind::number, "a number"},
                                              {Kind::whole, "whole number"},
                                              {Kind::boolean, "true or false"},
                                              {Kind::numbers, "numbers"},
                                              {Kind::axes, "numbers"},
                                              {Kind::list, "array"},
                                              {Kind::rows, "rows"},
                                              {Kind::table, "table"},
                                              {Kind::named, "table"},
                                              {Kind::tables, "tables"}};
      const auto expected = words.find(k.kind);
      if (expected == words.end())  // text: neither of them
        EXPECT_EQ(said.find("numbers"), said.npos) << said;
      else
        EXPECT_NE(said.find(expected->second), said.npos) << t.id << "." << k.name << ": " << said;
      ++tested;
    }
  std::printf("%d of %d keys were refused by their kind, at least 120 expected\n", tested, all);
  EXPECT_GE(tested, 120);
}

TEST(Schema, WordsAreThoseOfTheReader) {
  const auto place = places();
  for (const auto& t : schema())
    for (const auto& k : t.keys) {
      if (k.kind != SchemaKey::Kind::word || k.name == "type" || t.id == "ensemble" ||
          t.id == "plan")
        continue;
      std::string text = place.at(t.id);
      const auto there = text.rfind("\n" + k.name + " = ");
      if (there != text.npos) text.erase(there, text.find('\n', there + 1) - there);
      const std::string said = refusal(with(text, k.name + " = \"zzz\""));
      if (k.name ==
          "method") {  // of results any, as programs add some; SceneReader has the sentence
        std::vector<std::string> known{auto_method};
        for (const auto& d : integrators::catalogue()) known.push_back(d.name);
        EXPECT_TRUE(
            std::is_permutation(k.words.begin(), k.words.end(), known.begin(), known.end()));
        EXPECT_EQ(said, "");
        continue;
      }
      for (const auto& word : k.words)
        EXPECT_NE(said.find(word), said.npos) << t.id << "." << k.name << ": " << said;
    }
}

TEST(Schema, ReferenceIsInTheDocumentation) {
  std::ifstream file(std::string(PORTHOS_SOURCE_DIR) + "/docs/scene_reference.md");
  std::ostringstream text;
  text << file.rdbuf();
  EXPECT_EQ(text.str(), schema_markdown()) << "porthos schema --markdown > docs/scene_reference.md";
}

TEST(Schema, EveryReferenceLeadsSomewhere) {
  const auto j = nlohmann::json::parse(schema_json());
  const std::string text = j.dump();
  size_t count = 0;
  for (size_t at = 0; (at = text.find("#/definitions/", at)) != text.npos; ++at, ++count) {
    const auto id = text.substr(at + 14, text.find('"', at) - at - 14);
    EXPECT_TRUE(j["definitions"].contains(id)) << id;
  }
  EXPECT_GT(count, 20u);
}

}  // namespace
}  // namespace porthos::scene::schema_test
