#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <string>

#include "tests/apps/pendulum.h"
#include "tests/places.h"

/// porthos new, schema, completion and report, as a user types them.
namespace porthos::test::small_commands_test {
namespace {

namespace fs = std::filesystem;

#ifndef PORTHOS_CLI
#define PORTHOS_CLI "porthos"
#define PORTHOS_NOT_BUILT
#endif

struct Answer {
  int code;
  std::string out, err;
};

class SmallCommands : public testing::Test {
 protected:
  void SetUp() override {
#ifdef PORTHOS_NOT_BUILT
    GTEST_SKIP() << "built without the porthos command";
#endif
    folder_ = fs::path(testing::TempDir()) / ("porthos_new_" + std::to_string(getpid()));
    fs::create_directories(folder_);
  }
  void TearDown() override {
    if (!folder_.empty()) fs::remove_all(folder_);
  }
  std::string text(const std::string& name) const {
    std::ifstream file(folder_ / name, std::ios::binary);
    std::ostringstream all;
    all << file.rdbuf();
    return all.str();
  }
  Answer shell(const std::string& line) const {
    const std::string command =
        "cd '" + folder_.string() + "' && { " + line + "; } >out.txt 2>err.txt </dev/null";
    const int status = std::system(command.c_str());
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, text("out.txt"), text("err.txt")};
  }
  Answer porthos(const std::string& arguments) const {
    return shell("'" PORTHOS_CLI "' " + arguments);
  }
  static std::string example(const std::string& file) {
    return "'" PORTHOS_SOURCE_DIR "/examples/" + file + "'";
  }
  fs::path folder_;
};

TEST_F(SmallCommands, AnEnsembleNamesTheChecksThatFail) {
  const auto run = [&](const char* limit) {
    std::ofstream(folder_ / "scene.toml")
        << "[model]\nurdf = \"" PORTHOS_SOURCE_DIR
           "/examples/double_pendulum/double_pendulum.urdf\"\nbase = \"fixed\"\n[initial]\n"
           "joints.elbow.velocity = 1\n[integrator]\nmethod = \"gauss8\"\nstep = 0.01\n[run]\n"
           "duration = 1\n[verify]\nenergy = "
        << limit << "\nbalance = " << limit
        << "\n[ensemble]\ncases = 3\n[ensemble.vary]\n\"initial.joints.elbow.position\" = { "
           "uniform = [-1, 1] }\n";
    return porthos("ensemble scene.toml --no-report --out " + std::string(limit));
  };
  const Answer failed = run("1e-30"), passed = run("1e-9");
  for (const char* row :
       {"\nenergy      3      1e-30  0, 1, 2\n", "\nbalance     3      1e-30  0, 1, 2\n",
        "\none by itself: porthos run SCENE --case 0\n"})
    EXPECT_NE(failed.out.find(row), std::string::npos) << failed.out;
  EXPECT_EQ(passed.out.find("not passed"), std::string::npos) << passed.out << passed.err;
  EXPECT_EQ(passed.code, 0);
}

TEST_F(SmallCommands, NewScenesOfEveryExampleRunAsTheyAre) {
  int count = 0;
  for (const char* base : {"fixed", "free"})
    for (const char* urdf : {"ets_vii/ets_vii.urdf", "capture/servicer.urdf",
                             "dc_motor_arm/arm.urdf", "double_pendulum/double_pendulum.urdf",
                             "canadarm/canadarm.urdf", "throwing_arm/arms.urdf"}) {
      const std::string name = "s" + std::to_string(++count);
      const Answer made =
          porthos("new " + example(urdf) + " --base " + base + " --out " + name + "/scene.toml");
      if (made.code == 2 && std::string(base) == "free")
        continue;  // a root without mass cannot float
      ASSERT_EQ(made.code, 0) << urdf << " " << base << ": " << made.err;
      const Answer ran =
          porthos("run " + name + "/scene.toml --no-report --duration 2 --out " + name);
      EXPECT_EQ(ran.code, 0) << urdf << " " << base << ": " << ran.out << ran.err;
    }
}

/// Arms that fall and whirl, walking machines, a tree of 63 bodies: what `new` writes passes every
/// check.
TEST_F(SmallCommands, NewScenesOfEveryModelPass) {
  const fs::path data = fs::path(PORTHOS_SOURCE_DIR) / "tests/data";
  int passed = 0, count = 0;
  for (const fs::path& folder : {data / "models", data / "reference/pinocchio/urdf"})
    for (const auto& entry : fs::directory_iterator(folder))
      for (const std::string base : {"fixed", "free"}) {
        if (entry.path().extension() != ".urdf") continue;
        const std::string what = entry.path().stem().string() + " " + base,
                          name = "s" + std::to_string(++count);
        const Answer made = porthos("new '" + entry.path().string() + "' --base " + base +
                                    " --out " + name + "/scene.toml");
        if (made.code == 2 && base == "free") {  // a root that is the world, or has no mass
          EXPECT_TRUE(made.err.find("is the inertial frame") != std::string::npos ||
                      made.err.find("joint 'base' moves no inertia") != std::string::npos)
              << what << ": " << made.err;
          continue;
        }
        ASSERT_EQ(made.code, 0) << what << ": " << made.err;
        EXPECT_NE(text(name + "/scene.toml").find("# Found by pilot runs"), std::string::npos);
        const Answer ran = porthos("verify " + name + "/scene.toml --no-report --out " + name);
        EXPECT_EQ(ran.code, 0) << what << ": " << ran.out << ran.err;
        passed += ran.code == 0;
      }
  EXPECT_GE(passed, 28);
}

/// Slides that nothing stops run out of the picture, ±223 m in 20 s: they are held, and a comment
/// says so. Control: the cart of a cart-pole stays near its range and keeps its freedom.
TEST_F(SmallCommands, NewHoldsSlidesThatRunAway) {
  const std::string panda = std::string(PORTHOS_SOURCE_DIR) + "/tests/data/models/panda9.urdf";
  ASSERT_EQ(porthos("new '" + panda + "' --out panda.toml").code, 0);
  EXPECT_NE(
      text("panda.toml")
          .find(
              "# Held, as they slide far out of their limits, which only an [[element]] enforces: "
              "\"panda_finger_joint1\", \"panda_finger_joint2\"\nlock = [\"panda_finger_joint1\""),
      std::string::npos)
      << text("panda.toml");
  const Answer ran = porthos("run panda.toml --no-report --out panda");
  EXPECT_EQ(ran.code, 0) << ran.out << ran.err;
  EXPECT_EQ(ran.err.find("finger"), std::string::npos) << ran.err;
  ASSERT_EQ(porthos("new " + example("cart_pole_plan/cart_pole.urdf") + " --out cart.toml").code,
            0);
  EXPECT_EQ(text("cart.toml").find("lock = "), std::string::npos) << text("cart.toml");
}

/// Faults that every robot tool takes are taken, each with a note that run prints and the summary
/// keeps.
TEST_F(SmallCommands, NewScenesOfFaultyFilesPassAndSaySo) {
  const std::string heavy =
      "<inertial><origin xyz='0 0 0.2'/><mass value='1'/><inertia ixx='.1' iyy='.1' izz='.1' "
      "ixy='0' ixz='0' iyz='0'/></inertial>";
  const auto link = [](const std::string& name, const std::string& inside) {
    return "<link name='" + name + "'>" + inside + "</link>";
  };
  const auto joint = [](const std::string& name, const std::string& type, const std::string& parent,
                        const std::string& child, const std::string& more = "") {
    return "<joint name='" + name + "' type='" + type + "'><parent link='" + parent +
           "'/><child link='" + child + "'/>" + more + "</joint>";
  };
  const std::string arm = link("base", "") + link("arm", heavy),
                    swing = joint("j", "revolute", "base", "arm");
  struct Case {
    std::string name, text, scene_says, note;
  };
  const Case cases[] = {
      {"limits",
       "<robot name='r'>" + arm +
           joint("j", "revolute", "base", "arm", "<limit lower='1' upper='-1'/>") + "</robot>",
       "base = \"fixed\"", "taken as no limit"},
      {"unnamed", "<robot>" + arm + swing + "</robot>", "title = \"unnamed\"",
       "called like its file: 'unnamed'"},
      {"world",
       "<robot name='r'>" + arm + joint("w", "fixed", "world", "base") + swing + "</robot>",
       "base = \"fixed\"", "taken as the inertial frame"},
      {"rigid", "<robot name='r'>" + arm + joint("j", "fixed", "base", "arm") + "</robot>",
       "base = \"free\"                   # no joint of this file moves",
       "taken as frames: 'base'"},
      {"finger",
       "<robot name='r'>" + arm + link("finger", "") + swing +
           joint("g", "prismatic", "arm", "finger", "<mimic joint='j'/>") + "</robot>",
       "lock = [\"g\"]\n# inertia.finger = { mass", "<mimic> ignored"},
      {"ball", "<robot name='r'>" + arm + joint("j", "spherical", "base", "arm") + "</robot>",
       "joints.j = { attitude_wxyz", ""}};
  for (const Case& c : cases) {
    std::ofstream(folder_ / (c.name + ".urdf")) << c.text;
    const Answer made = porthos("new " + c.name + ".urdf --out " + c.name + ".toml");
    ASSERT_EQ(made.code, 0) << c.name << ": " << made.err;
    EXPECT_NE(text(c.name + ".toml").find(c.scene_says), std::string::npos)
        << text(c.name + ".toml");
    const Answer ran = porthos("run " + c.name + ".toml --no-report --out " + c.name);
    EXPECT_EQ(ran.code, 0) << c.name << ": " << ran.out << ran.err;
    EXPECT_NE(ran.err.find(c.note), std::string::npos) << c.name << ": " << ran.err;
    const std::string notes =
        nlohmann::json::parse(text(c.name + "/summary.json"))["model_notes"].dump();
    EXPECT_NE(notes.find(c.note), std::string::npos) << c.name << ": " << notes;
  }
  // What no tool can read is refused.
  for (const std::string more : {"<origin xyz='0,0,1'/>", "<axis xyz='1 0 0'/><axis xyz='0 1 0'/>",
                                 "<origin xyz='0 0 0 1'/>", "<origin xyz='${x} 0 0'/>"}) {
    std::ofstream(folder_ / "bad.urdf")
        << "<robot name='r'>" << arm << joint("j", "revolute", "base", "arm", more) << "</robot>";
    EXPECT_EQ(porthos("new bad.urdf").code, 2) << more;
  }
}

TEST_F(SmallCommands, NewWritesOverNothing) {
  std::ofstream(folder_ / "mine.toml") << "mine";
  const Answer a = porthos("new " + example("dc_motor_arm/arm.urdf") + " --out mine.toml");
  EXPECT_EQ(a.code, 2);
  EXPECT_EQ(a.err, "porthos: mine.toml is there already, expected a new file\n");
  EXPECT_EQ(text("mine.toml"), "mine");
  EXPECT_EQ(porthos("new " + example("dc_motor_arm/arm.urdf") + " --base loose").err,
            "porthos: --base: base is 'loose', expected fixed or free\n");
  EXPECT_EQ(porthos("new no.urdf").code, 2);
}

/// The path of the model in the scene is right whether or not the folder was there before.
TEST_F(SmallCommands, NewFindsItsModelFromAFolderItMakes) {
  fs::create_directories(folder_ / "models");
  fs::copy_file(fs::path(PORTHOS_SOURCE_DIR) / "examples/dc_motor_arm/arm.urdf",
                folder_ / "models/arm.urdf");
  for (const std::string name : {"deep/er/first.toml", "deep/er/second.toml"}) {
    ASSERT_EQ(porthos("new models/arm.urdf --out " + name).code, 0);
    EXPECT_NE(text(name).find("urdf = \"../../models/arm.urdf\""), std::string::npos) << text(name);
    EXPECT_EQ(porthos("info " + name).code, 0) << name;
  }
}

TEST_F(SmallCommands, WithoutACommandHelpIsPrinted) {
  const Answer bare = porthos(""), asked = porthos("--help");
  EXPECT_EQ(bare.code, 2);
  EXPECT_EQ(asked.code, 0);
  EXPECT_EQ(bare.err, asked.out);
  EXPECT_EQ(bare.out, "");
  EXPECT_NE(asked.out.find("a commented scene for a URDF file"), std::string::npos);
}

TEST_F(SmallCommands, SchemaIsJson) {
  const Answer a = porthos("schema");
  ASSERT_EQ(a.code, 0) << a.err;
  const auto j = nlohmann::json::parse(a.out);
  EXPECT_TRUE(j["properties"].contains("integrator"));
  EXPECT_EQ(j["required"], nlohmann::json({"model", "integrator", "run"}));
}

TEST_F(SmallCommands, BashCompletes) {
  if (shell("command -v bash").code != 0) GTEST_SKIP() << "no bash";
  ASSERT_EQ(porthos("completion bash").code, 0);
  fs::rename(folder_ / "out.txt", folder_ / "completion.bash");
  const auto complete = [&](const std::string& words) {
    return shell("bash -c 'source completion.bash; COMP_WORDS=(" + words +
                 "); COMP_CWORD=$((${#COMP_WORDS[@]} - 1)); _porthos; echo \"${COMPREPLY[*]}\"'")
        .out;
  };
  EXPECT_EQ(complete("porthos sche"), "schema\n");
  EXPECT_EQ(complete("porthos run --no"), "--no-report --no-meshes\n");
  EXPECT_EQ(complete("porthos run --method gauss16"), "gauss16\n");
  EXPECT_EQ(complete("porthos completion z"), "zsh\n");
  EXPECT_EQ(complete("porthos run --nothing"), "\n");
}

TEST_F(SmallCommands, ScriptsOfOtherShellsAreUnderstood) {
  for (const std::string name : {"zsh", "fish"}) {
    ASSERT_EQ(porthos("completion " + name + " >script").code, 0);
    if (shell("command -v " + name).code != 0) continue;
    const Answer a = shell(name + " -n script");
    EXPECT_EQ(a.code, 0) << name << ": " << a.err;
    EXPECT_EQ(a.err, "") << name;
  }
  const Answer a = porthos("completion tcsh");
  EXPECT_EQ(a.code, 2);
  EXPECT_EQ(a.err, "porthos: there is no completion for 'tcsh', expected bash, zsh or fish\n");
}

TEST_F(SmallCommands, EveryCommandHasAnExampleInItsHelp) {
  const std::string all = porthos("--help").out;
  std::istringstream lines(all.substr(all.find("Subcommands:") + 13));
  int count = 0;
  for (std::string line; std::getline(lines, line) && line.rfind("  ", 0) == 0;) {
    std::istringstream words(line);
    std::string command;
    words >> command;
    if (line[2] == ' ' || command.empty()) continue;
    EXPECT_NE(porthos(command + " --help").out.find("Example:\n  porthos " + command),
              std::string::npos)
        << command;
    ++count;
  }
  EXPECT_GE(count, 10);
}

TEST_F(SmallCommands, InfoAsJsonHasTheFactsOfTheText) {
  const std::string scene = example("double_pendulum/scene.toml");
  const Answer a = porthos("info --json " + scene), text = porthos("info " + scene);
  ASSERT_EQ(a.code, 0) << a.err;
  EXPECT_EQ(a.err, "");
  const auto j = nlohmann::json::parse(a.out);
  EXPECT_EQ(text.out.rfind(j["title"].get<std::string>() + "\n", 0), 0u);
  for (const char* section :
       {"model", "states", "ports", "energy_accounts", "invariants", "constraints", "integrator",
        "plan", "controllers", "outputs", "stops", "not_simulated", "notes", "evaluation_ns"})
    EXPECT_TRUE(j.contains(section)) << section;
  EXPECT_EQ(j["model"]["degrees_of_freedom"], 2);
  EXPECT_EQ(j["states"].size(), 2u);
  EXPECT_EQ(j["states"][0]["unit"], "rad");
  EXPECT_EQ(j["states"][0]["momentum"]["start"].size(), 1u);
  EXPECT_TRUE(j["constraints"].is_null());
  EXPECT_GT(j["evaluation_ns"]["one_state"], 0);
  for (const auto& [name, sentence] : j["plan"].items())
    EXPECT_NE(text.out.find(sentence.get<std::string>()), std::string::npos) << name;
  for (const auto& port : j["ports"])
    EXPECT_NE(text.out.find(port["name"].get<std::string>()), std::string::npos);
  EXPECT_NE(text.out.find(j["integrator"]["method"].get<std::string>() + ", "), std::string::npos);
  // Loops and controllers.
  const auto loop =
      nlohmann::json::parse(porthos("info --json " + example("four_bar/scene.toml")).out);
  EXPECT_GE(loop["constraints"]["rows"], loop["constraints"]["rank"]);
  EXPECT_FALSE(loop["constraints"]["blocks"].empty());
  const auto law =
      nlohmann::json::parse(porthos("info --json " + example("furuta_swing_up/scene.toml")).out);
  ASSERT_FALSE(law["controllers"].empty());
  EXPECT_TRUE(law["controllers"][0]["certificate"].contains("holds"));
  // An error is one sentence on stderr and nothing on stdout, as of run --json.
  const Answer none = porthos("info --json absent.toml");
  EXPECT_EQ(none.code, 2);
  EXPECT_EQ(none.out, "");
  EXPECT_EQ(none.err, porthos("run --json absent.toml").err);
}

TEST_F(SmallCommands, MethodsAndActuatorsAsJson) {
  const auto methods = nlohmann::json::parse(porthos("methods --json").out)["methods"];
  const std::string text = porthos("methods").out;
  std::set<std::string> names;
  for (const auto& m : methods) {
    names.insert(m["name"]);
    EXPECT_NE(text.find(m["what"].get<std::string>()), std::string::npos) << m["name"];
    if (m["name"] == "gauss8") {
      EXPECT_EQ(m["order"], 8);
      EXPECT_EQ(m["symplectic"], true);
      EXPECT_EQ(m["energy"], false);
    }
  }
  EXPECT_TRUE(names.contains("gauss8") && names.contains("spark16"));
  // The table has a heading, an empty line and four lines of explanation besides.
  EXPECT_EQ(size_t(std::ranges::count(text, '\n')), names.size() + 6) << text;

  const auto j = nlohmann::json::parse(porthos("actuators --json").out);
  const std::string table = porthos("actuators").out;
  EXPECT_GE(j["families"].size(), 10u);
  for (const auto& d : j["devices"]) {
    EXPECT_NE(table.find("\n" + d["name"].get<std::string>() + " "), std::string::npos);
    for (const auto& p : d["parameters"]) EXPECT_FALSE(p["from"].get<std::string>().empty());
  }
  EXPECT_EQ(porthos("actuators --json --markdown").code, 2);
  EXPECT_EQ(porthos("methods --json --markdown").out, "");
}

TEST_F(SmallCommands, ActuatorsDrawsTheSpringsOfAScene) {
  const Answer drawn =
      porthos("actuators " + example("qbmove_arm/scene.toml") + " --plots springs");
  EXPECT_EQ(drawn.code, 0) << drawn.err;
  for (const char* name : {"springs/shoulder_vsa.svg", "springs/elbow_vsa.svg"}) {
    const std::string picture = text(name);
    EXPECT_NE(picture.find("holding torque [N m]"), std::string::npos) << name;
    EXPECT_NE(picture.find("σ = 0.6 rad"), std::string::npos) << name;  // of the device's limits
  }
  EXPECT_EQ(porthos("actuators " + example("qbmove_arm/scene.toml")).code, 2) << "without --plots";
  const Answer none = porthos("actuators " + example("ets_vii/scene.toml") + " --plots springs");
  EXPECT_EQ(none.code, 2);
  EXPECT_NE(none.err.find("ets_vii/scene.toml has no [[actuator]], expected one"),
            std::string::npos)
      << none.err;
}

TEST_F(SmallCommands, ReportWithoutTemplateSaysWhatToDo) {
  std::ofstream(folder_ / "empty.html") << "nothing";
  fs::create_directories(folder_ / "none");
  const Answer named = shell("PORTHOS_REPORT_TEMPLATE=empty.html '" PORTHOS_CLI "' report none");
  EXPECT_EQ(named.code, 2);
  EXPECT_EQ(named.err,
            "porthos: empty.html is no template of a report: expected @PORTHOS_DATA@ once\n");
  std::ofstream(folder_ / "page.html") << "@PORTHOS_DATA@";
  const Answer empty = shell("PORTHOS_REPORT_TEMPLATE=page.html '" PORTHOS_CLI "' report none");
  EXPECT_EQ(empty.code, 2);
  EXPECT_EQ(empty.err,
            "porthos: none holds no results: expected summary.json, run.h5, compare.json or "
            "checkpoint/ of a run\n");
  EXPECT_EQ(shell("PORTHOS_REPORT_TEMPLATE=page.html '" PORTHOS_CLI "' report away").err,
            "porthos: away is no folder\n");
}

TEST_F(SmallCommands, RunWritesItsReportUnlessToldNotTo) {
  std::ofstream(folder_ / "page.html") << "<p>@PORTHOS_DATA@</p>";
  const std::string run = "PORTHOS_REPORT_TEMPLATE=page.html '" PORTHOS_CLI "' run " +
                          example("ets_vii/scene.toml") + " --duration 5 ";
  EXPECT_EQ(shell(run + "--out a").code, 0);
  EXPECT_TRUE(fs::exists(folder_ / "a/report.html"));
  EXPECT_EQ(shell(run + "--no-report --out b").code, 0);
  EXPECT_FALSE(fs::exists(folder_ / "b/report.html"));
  EXPECT_EQ(shell(run + "--no-report --out a").code, 0);
  EXPECT_FALSE(fs::exists(folder_ / "a/report.html")) << "one of other results goes";
  // A page that cannot be made costs no run its verdict.
  const Answer bad = shell("PORTHOS_REPORT_TEMPLATE=no.html '" PORTHOS_CLI "' run " +
                           example("ets_vii/scene.toml") + " --duration 5 --out c");
  EXPECT_EQ(bad.code, 0);
  EXPECT_NE(bad.err.find("porthos: no report: cannot read no.html"), std::string::npos) << bad.err;
}

TEST_F(SmallCommands, MeshesThatAreNotThereAreToldBesideTheRun) {
  std::string urdf = pendulum;
  const auto told = [&](const std::string& more = "") {
    std::ofstream(folder_ / "rod.urdf") << urdf;
    return shell("PORTHOS_REPORT_TEMPLATE=page.html '" PORTHOS_CLI "' run scene.toml --out a" +
                 more)
        .err;
  };
  std::ofstream(folder_ / "page.html") << "@PORTHOS_DATA@";
  std::ofstream(folder_ / "scene.toml")
      << "[model]\nurdf = \"rod.urdf\"\nbase = \"fixed\"\n[integrator]\nmethod = \"gauss8\"\n"
         "step = 0.01\n[run]\nduration = 0.1\n";
  EXPECT_EQ(told().find("meshes"), std::string::npos);
  const std::string rod = "<link name=\"rod\">";
  urdf.insert(urdf.find(rod) + rod.size(),
              "<visual><geometry><mesh filename=\"lost.stl\"/></geometry></visual>");
  const std::string all = told();
  EXPECT_NE(all.find("porthos: playback: 1 of 1 meshes of the model are not shown: 'lost.stl' was "
                     "not found\n"),
            std::string::npos)
      << all;
  EXPECT_EQ(told(" --no-meshes").find("meshes"), std::string::npos);
  EXPECT_NE(text("a/report.html").find("\"meshes\":[]"), std::string::npos);
}

TEST_F(SmallCommands, PlotDrawsOnePanelForPrint) {
  ASSERT_EQ(
      porthos("run " + example("ets_vii/scene.toml") + " --duration 5 --no-report --out a").code,
      0);
  const Answer svg = porthos("plot a --what 'rates of joints'");
  EXPECT_EQ(svg.code, 0) << svg.err;
  EXPECT_EQ(svg.out, "a/figure_rates_of_joints.svg\n");
  EXPECT_NE(text("a/figure_rates_of_joints.svg").find("joint_3"), std::string::npos);
  const auto refused = [&](const std::string& arguments) {
    const Answer a = porthos("plot " + arguments);
    EXPECT_EQ(a.code, 2) << arguments;
    return a.err;
  };
  EXPECT_NE(refused("a --what rates").find("what is 'rates', the nearest is"), std::string::npos);
  EXPECT_EQ(refused("a --out x.svg"),
            "porthos: --out is the file of one panel, expected --what as well\n");
  EXPECT_EQ(refused("a --from 2"),
            "porthos: --from and --to are of one panel, expected --what as well\n");
  EXPECT_EQ(refused("a --what energies --from 3 --to 2"),
            "porthos: --to is 2 s, expected more than --from 3 s\n");
  EXPECT_EQ(porthos("plot a --what energies --from 2 --to 4 --out part.svg").code, 0);
  const Answer nowhere = porthos("plot a --what energies --out no/b.png");
  EXPECT_EQ(nowhere.code, 5);
  EXPECT_EQ(nowhere.err, "porthos: cannot write no/b.png: there is no folder no\n");
  EXPECT_EQ(refused("a --what works"),
            "porthos: a has no panel 'works': nothing is supplied or lost\n");
  EXPECT_EQ(refused("a --what energies --out x.gif"),
            "porthos: x.gif: expected a name that ends with .svg, .pdf or .png\n");
  const Answer none =
      shell("PORTHOS_CHROMIUM= PATH=/nowhere '" PORTHOS_CLI "' plot a --what energies --out x.pdf");
  EXPECT_EQ(none.code, 2);
  EXPECT_EQ(none.err,
            "porthos: x.pdf: no Chromium or Chrome was found in PATH, expected one, or its path in "
            "PORTHOS_CHROMIUM; a name that ends with .svg needs none\n");
  EXPECT_FALSE(fs::exists(folder_ / "x.pdf"));
  if (shell("command -v chromium || command -v google-chrome").code != 0)
    GTEST_SKIP() << "no Chromium";
  for (const auto& [name, head] : {std::pair{"x.pdf", "%PDF"}, {"x.png", "\x89PNG"}}) {
    const Answer a = porthos(std::string("plot a --what energies --out ") + name);
    EXPECT_EQ(a.code, 0) << a.err;
    EXPECT_EQ(text(name).substr(0, 4), head);
    EXPECT_FALSE(fs::exists(folder_ / (std::string(name) + ".svg"))) << "nothing is left over";
  }
  const auto number = [&](size_t at) {  // of the head of a PNG
    const std::string png = text("x.png");
    return (unsigned(png.at(at) & 0xff) << 8) + unsigned(png.at(at + 1) & 0xff);
  };
  EXPECT_EQ(number(18), 1004u) << "85 mm of 300 pixels an inch";
  EXPECT_EQ(number(22), 709u) << "60 mm";
}

}  // namespace
}  // namespace porthos::test::small_commands_test
