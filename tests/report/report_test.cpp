#include "report/report.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <thread>
#include <vector>

#include "mechanics/builder.h"
#include "mechanics/kinematics.h"
#include "mechanics/rotation.h"
#include "phs/error.h"
#include "report/detail/series.h"
#include "report/detail/shapes.h"
#include "report/detail/stage_page.h"
#include "scene/files/files.h"
#include "scene/session/moved.h"
#include "scene/session/run.h"
#include "tests/places.h"

/// What a results folder becomes as data of the page.
namespace porthos::report::report_test {
namespace {

namespace fs = std::filesystem;

class Report : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(testing::TempDir()) / ("porthos_report_" + std::to_string(getpid()));
    fs::create_directories(folder_);
    std::ofstream(folder_ / "arm.urdf") << R"(<robot name="arm"><!-- made up for a test -->
      <link name="base"><inertial><mass value="12"/><inertia ixx="5" iyy="10" izz="13" ixy="0" ixz="0" iyz="0"/></inertial></link>
      <link name="rod"><inertial><origin xyz="0 0 -0.5"/><mass value="2"/><inertia ixx="0.2" iyy="0.2" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>
        <visual><origin xyz="0 0 -0.5"/><geometry><cylinder radius="0.05" length="1"/></geometry></visual></link>
      <joint name="hinge" type="continuous"><origin xyz="1 0 0"/><parent link="base"/><child link="rod"/><axis xyz="1 0 0"/></joint></robot>)";
    std::ofstream(folder_ / "scene.toml") << R"(title = "A </script><b>bold</b> title"
[model]
urdf = "arm.urdf"
base = "free"
[initial]
base.angular_velocity = [0.1, 0.2, 0.3]
joints.hinge = { position = 1.0, velocity = 0.5 }
[integrator]
method = "gauss8"
step = 0.05
[run]
duration = 5
)";
    const auto scene = scene::read_scene((folder_ / "scene.toml").string());
    scene::RunOptions options;
    options.out = out();
    report_ = scene::run(scene, scene::assemble(scene), options);
  }
  void TearDown() override { fs::remove_all(folder_); }
  std::string out() const { return (folder_ / "out").string(); }

  fs::path folder_;
  scene::RunReport report_;
};

TEST_F(Report, OfAFinishedRun) {
  const Json j = Json::parse(report_json(out()));
  EXPECT_EQ(j["status"]["state"], "complete") << j["missing"].dump();
  EXPECT_EQ(j["summary"]["verdict"], "pass");
  EXPECT_EQ(j["phases"].size(), 1u);
  const Json& play = j["phases"][0]["playback"];
  EXPECT_EQ(play["nodes"], 2);
  EXPECT_EQ(play["clips"].size(), 1u);
  EXPECT_EQ(play["bodies"][1]["visuals"][0]["kind"], "cylinder");
  EXPECT_TRUE(j["texts"]["model"].get<std::string>().find("<robot") == 0);
  EXPECT_EQ(j["credibility"].size(), 8u);
  EXPECT_NE(j["credibility"][0]["text"].get<std::string>().find("made up for a test"),
            std::string::npos);
}

/// Places count from the world where a link stands in it. Control: in a scene without one they
/// count from the base.
TEST_F(Report, DrawsWhatTouchesWhereItIs) {
  const auto playback_of = [&](const std::string& example) {
    auto s = scene::read_scene(fs::path(PORTHOS_SOURCE_DIR) / "examples" / example / "scene.toml");
    scene::apply(s, {.duration = 0.02});
    scene::RunOptions options;
    options.out = (folder_ / example).string();
    scene::run(s, scene::assemble(s), options);
    return Json::parse(report_json(options.out))["phases"][0]["playback"];
  };
  const auto counts_from_world = [](const Json& play) {
    const auto origin = play["clips"][0]["origin"].get<std::string>();
    return origin.find_first_not_of("A=") == origin.npos;  // zeros in base64
  };
  const Json box = playback_of("box_of_balls"), pile = playback_of("pile");
  std::map<std::string, Json> drawn;
  for (const Json& b : box["bodies"]) drawn[b["name"]] = b;
  EXPECT_EQ(drawn["box"]["visuals"].size(), 5u);
  const Json& ball = drawn["b07"];
  ASSERT_EQ(ball["contacts"].size(), 1u);
  EXPECT_EQ(ball["contacts"][0]["kind"], "sphere");
  EXPECT_EQ(ball["contacts"][0]["size"], Json({0.1}));
  EXPECT_TRUE(ball["box"].is_null()) << "the sphere stands for the whole ball";
  EXPECT_TRUE(box["world"].empty());
  EXPECT_EQ(pile["world"][0]["kind"], "plane");
  EXPECT_TRUE(counts_from_world(box));
  EXPECT_FALSE(counts_from_world(pile));
}

/// Every contact's shape of a link is drawn beside the box or the <visual>s it has without
/// contacts, and every shape of the world, each once. Control: without contacts there are none.
TEST_F(Report, DrawsEveryShapeOfContacts) {
  const std::string scene = scene::read_file(folder_ / "scene.toml");
  const auto playback_with = [&](const char* name, const std::string& contacts) {
    std::ofstream(folder_ / name) << scene + contacts;
    auto s = scene::read_scene(folder_ / name);
    scene::apply(s, {.duration = 0.1});
    scene::RunOptions options;
    options.out = (folder_ / "contacts").string();
    scene::run(s, scene::assemble(s), options);
    return Json::parse(report_json(options.out))["phases"][0]["playback"];
  };
  std::string contacts = R"(
[[contact]]
name = "shaft"
links = ["rod"]
shape = { kind = "cylinder", radius = 0.06, length = 1, at = [0, 0, -0.5] }
against_shape = { kind = "sphere", radius = 3, at = [20, 0, 0] }
law = "power"
stiffness = 1e3
)";
  for (const int foot : {0, 1, 2})
    contacts += fmt::format(R"(
[[contact]]
name = "foot_{}"
links = ["base"]
shape = {{ kind = "sphere", radius = 0.1, at = [{}, 1, -2] }}
against_shape = {{ kind = "plane", at = [0, 0, -9] }}
law = "power"
stiffness = 1e3
)",
                            foot, foot);
  const Json with = playback_with("with.toml", contacts), none = playback_with("none.toml", "");
  const Json &base = with["bodies"][0], &rod = with["bodies"][1];
  ASSERT_EQ(base["contacts"].size(), 3u);
  EXPECT_EQ(base["contacts"][2]["p"], Json({2.0, 1.0, -2.0}));
  EXPECT_FALSE(base["box"].is_null());
  ASSERT_EQ(rod["contacts"].size(), 1u);
  EXPECT_EQ(rod["contacts"][0]["size"], Json({0.06, 1.0}));
  EXPECT_EQ(rod["visuals"].size(), 1u);
  ASSERT_EQ(with["world"].size(), 2u);
  EXPECT_EQ(with["world"][0]["size"], Json({3.0}));
  EXPECT_EQ(with["world"][1]["kind"], "plane");
  EXPECT_EQ(with["world"][1]["p"], Json({0.0, 0.0, -9.0}));
  EXPECT_TRUE(none["world"].empty());
  for (const Json& b : none["bodies"]) EXPECT_TRUE(b["contacts"].empty());
  EXPECT_EQ(none["bodies"][0]["box"], base["box"]);
}

// The HDF5 library of Debian has no locks of its own. Without ours some of these end by a signal.
TEST_F(Report, RunsAndReportsInSeveralThreads) {
  const auto scene = scene::read_scene((folder_ / "scene.toml").string());
  const auto assembly = scene::assemble(scene);
  std::vector<std::string> pages(4);
  std::vector<std::jthread> threads;
  for (size_t k = 0; k < pages.size(); ++k)
    threads.emplace_back([&, k] {
      for (int times = 0; times < 5; ++times) {
        scene::RunOptions options;
        options.out = (folder_ / ("out_" + std::to_string(5 * k + size_t(times)))).string();
        scene::run(scene, assembly, options);
        const std::string page = Json::parse(report_json(options.out))["phases"].dump();
        EXPECT_TRUE(pages[k].empty() || pages[k] == page);
        pages[k] = page;
      }
    });
  threads.clear();
  const std::string alone = Json::parse(report_json(out()))["phases"].dump();
  EXPECT_GT(alone.size(), 1000u);
  for (const auto& page : pages) EXPECT_TRUE(page == alone);
}

TEST_F(Report, HasTheMotion) {
  const Json j = Json::parse(report_json(out()));
  const Json& panels = j["phases"][0]["motion"]["panels"];
  std::vector<std::string> what;
  for (const auto& p : panels) what.push_back(p["what"]);
  EXPECT_EQ(what,
            (std::vector<std::string>{"joints [rad]", "rates of joints [rad/s]",
                                      "rotation of base [rad]", "rates of base, own axes [rad/s]",
                                      "path of base [m]", "velocity of base [m/s]"}));
  EXPECT_EQ(panels[0]["lines"][0]["name"], "hinge");
  EXPECT_EQ(panels[0]["lines"][0]["v"].get<std::string>().size(), 540u);  // 101 floats in base64
}

/// A hinge that turns more than four times in the second phase alone is in one panel all along, and
/// rotations count from the start of the run: on the page as in every picture.
TEST_F(Report, HasOneMotionOverAllPhases) {
  const auto change = [](std::string& text, const std::string& from, const std::string& to) {
    text.replace(text.find(from), from.size(), to);
  };
  std::string urdf = scene::read_file(folder_ / "arm.urdf");
  std::string text = scene::read_file(folder_ / "scene.toml");
  change(urdf, "</robot>", R"(<link name="flap"><inertial><mass value="1"/><inertia ixx="1" iyy="1"
      izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link><joint name="lid" type="continuous">
      <parent link="base"/><child link="flap"/><axis xyz="0 0 1"/></joint></robot>)");
  change(text, "velocity = 0.5 }", "velocity = 15 }");
  change(text, "arm.urdf", "two.urdf");
  std::ofstream(folder_ / "two.urdf") << urdf;
  std::ofstream(folder_ / "two.toml")
      << text << "[[event]]\ntype = \"lock\"\njoint = \"lid\"\nat = 1\n";
  const auto s = scene::read_scene((folder_ / "two.toml").string());
  scene::RunOptions options;
  options.out = (folder_ / "two").string();
  scene::run(s, scene::assemble(s), options);
  const auto drawn = scene::motion_in(options.out, 2000);
  const Json phases = Json::parse(report_json(options.out))["phases"];
  ASSERT_EQ(phases.size(), 2u);
  size_t before = 0, same = 0;
  for (const Json& phase : phases) {
    const size_t n = phase["series"]["records"];
    for (const Json& p : phase["motion"]["panels"])
      for (const Json& l : p["lines"]) {
        const auto panel =
            std::ranges::find(drawn.panels, p["what"].get<std::string>(), &scene::TracePanel::what);
        ASSERT_NE(panel, drawn.panels.end()) << p["what"];
        const auto line =
            std::ranges::find(panel->lines, l["name"].get<std::string>(), &scene::TraceLine::name);
        ASSERT_NE(line, panel->lines.end()) << l["name"];
        const auto from = line->value.begin() + long(before);
        EXPECT_EQ(l["v"], base64(std::vector<float>(from, from + long(n)))) << p["what"];
        ++same;
      }
    before += n;
  }
  EXPECT_EQ(before, drawn.t.size());
  EXPECT_GT(same, 20u);
  for (const auto& p : drawn.panels)
    for (const auto& l : p.lines)
      EXPECT_EQ(std::isnan(l.value.back()), l.name == "lid") << p.what << ", " << l.name;
  const auto panels = [](const Json& phase) {
    std::string all;
    for (const Json& p : phase["motion"]["panels"]) all += p["what"].get<std::string>() + "; ";
    return all;
  };
  EXPECT_TRUE(panels(phases[0]).starts_with("joints [rad]; rates of joints [rad/s]; turning"));
  // Control: the first phase alone has no joint that turns often.
  EXPECT_EQ(scene::motion_in(fs::path(options.out) / "phase_1", 2000).panels[2].what,
            "rotation of base [rad]");
}

TEST_F(Report, BoxesHaveTheInertiaTheyStandFor) {
  const Json j = Json::parse(report_json(out()));
  const Json& box = j["phases"][0]["playback"]["bodies"][0]["box"];
  auto side = box["size"].get<std::vector<double>>();
  std::sort(side.begin(), side.end());  // m/12 (b² + c²) = 13, (a² + c²) = 10, (a² + b²) = 5
  EXPECT_NEAR(side[0], 1, 1e-12);
  EXPECT_NEAR(side[1], 2, 1e-12);
  EXPECT_NEAR(side[2], 3, 1e-12);
}

/// A box of placeholder moments is bounded by what the body can be; controls: usual bodies are not.
TEST_F(Report, BoxesAreNoLargerThanTheirBodiesCanBe) {
  struct Case {
    const char* name;
    double mass, com, sides[3], drawn;  ///< drawn: the longest side
  };
  const Case cases[] = {{"hand", 0.169, 0.03, {0.22, 0.21, 0.19}, 0.0743},
                        {"sole", 0.01, 0, {0.24, 0.24, 0.24}, 0.027},
                        {"identified", 5, 0.05, {1.3, 0.12, 0.08}, 0.464},
                        {"thigh", 6.8, 0.22, {0.43, 0.18, 0.1}, 0.43},
                        {"wheel", 8, 0, {0.27, 0.27, 0.12}, 0.27},
                        {"panel", 1, 0.05, {2, 0.1, 0.001}, 2},
                        {"boom", 1, 1, {2, 0.1, 0.1}, 2}};
  std::vector<mechanics::BodySpec> bodies(1);
  const auto mass_of = [](double m, double com, const double(&s)[3]) {
    mechanics::MassProperties all;
    all.mass = m;
    all.com = {com, 0, 0};
    all.inertia.xx = m / 12 * (s[1] * s[1] + s[2] * s[2]);
    all.inertia.yy = m / 12 * (s[0] * s[0] + s[2] * s[2]);
    all.inertia.zz = m / 12 * (s[0] * s[0] + s[1] * s[1]);
    return all;
  };
  bodies[0].name = "station";
  bodies[0].parent = "world";
  bodies[0].mass = mass_of(4e5, 0, {52, 47, 20});  // 8 kg/m³ are usual of one
  for (const Case& c : cases) {
    bodies.emplace_back();
    bodies.back().name = c.name;
    bodies.back().parent = "station";
    bodies.back().mass = mass_of(c.mass, c.com, c.sides);
  }
  MeshShelf meshes({});
  const Json drawn = shapes_of(bodies, "", {}, meshes);
  const auto longest = [&](size_t k) {
    const auto side = drawn[k]["box"]["size"].get<std::vector<double>>();
    return *std::ranges::max_element(side);
  };
  EXPECT_NEAR(longest(0), 52, 1e-9);
  for (size_t k = 0; k < std::size(cases); ++k) {
    std::printf("  %-10s of %.3g m is drawn %.3g m long (%.3g)\n", cases[k].name, cases[k].sides[0],
                longest(k + 1), cases[k].drawn);
    EXPECT_NEAR(longest(k + 1), cases[k].drawn, 0.01 * cases[k].drawn + 1e-9);
  }
}

/// Of a part of a long run the playback has every record, at its time; of the whole of it (control)
/// it has some, and tells how far the hinge turns to and fro between two of them.
TEST_F(Report, APartOfALongRunHasAPlaybackOfItsOwn) {
  auto scene = scene::read_scene(folder_ / "scene.toml");
  scene::apply(scene, {.method = "stormer_verlet", .step = 0.01, .duration = 400});
  scene.record_every = 0.01;
  scene::RunOptions options;
  options.out = (folder_ / "long").string();
  scene::run(scene, scene::assemble(scene), options);
  const fs::path page = folder_ / "page.html", made = folder_ / "part.html";
  std::ofstream(page) << "<script>@PORTHOS_DATA@</script>";
  write_report(options.out, fs::path(options.out) / "report.html", page);
  write_part(options.out, made, page, {300, 310});
  const auto clip_of = [](const fs::path& file) {
    const std::string text = scene::read_file(file);
    return Json::parse(text.substr(8, text.size() - 17))["phases"][0]["playback"]["clips"][0];
  };
  const auto inside = [&](const Json& clip) {
    const std::string bytes = bytes_of_base64(clip["t"].dump());
    int n = 0;
    for (size_t i = 0; i + 8 <= bytes.size(); i += 8) {
      double t;
      std::memcpy(&t, bytes.data() + i, 8);
      n += t >= 300 - 1e-9 && t <= 310 + 1e-9;
    }
    return n;
  };
  const Json part = clip_of(made), whole = clip_of(fs::path(options.out) / "report.html");
  EXPECT_EQ(inside(part), 1001);
  EXPECT_LE(part["t"].get<std::string>().size(), 4 * 8 * 1003 / 3 + 4);  // and two beside it
  EXPECT_LT(inside(whole), 60);
  std::printf("  between two frames of the part %.3f rad, of the whole %.2f rad\n",
              part["turn"].get<double>(), whole["turn"].get<double>());
  EXPECT_LT(part["turn"], 0.05);
  EXPECT_GT(whole["turn"], 0.2);
}

TEST_F(Report, TextOfTheRunCannotLeaveItsScript) {
  const fs::path page = folder_ / "page.html", made = folder_ / "report.html";
  std::ofstream(page) << "<script>@PORTHOS_DATA@</script>";
  write_report(out(), made, page);
  const std::string text = scene::read_file(made);
  EXPECT_EQ(text.find("</script>"), text.size() - 9);
  const std::string data = text.substr(8, text.size() - 17);
  EXPECT_EQ(Json::parse(data)["summary"]["title"], "A </script><b>bold</b> title");
}

// Names from others are text on the page, and the page itself loads nothing: its policy forbids it.
TEST_F(Report, HostileNamesStayTextAndNothingIsLoaded) {
  const std::string evil = "</script><img src=x onerror=alert(1)>";
  std::string urdf = scene::read_file(folder_ / "arm.urdf"), text;
  for (const std::string word : {"\"hinge\"", "\"rod\""})
    for (size_t at; (at = urdf.find(word)) != std::string::npos;)
      urdf.replace(at, word.size(),
                   "\"&lt;/script>&lt;img src=x onerror=alert(1)>" + word.substr(1));
  std::ofstream(folder_ / "evil.urdf") << urdf;
  std::ofstream(folder_ / "evil.toml")
      << "title = '" << evil << "<!--'\n[model]\nurdf = 'evil.urdf'\nbase = 'free'\n[initial]\n"
      << "base.angular_velocity = [0.1, 0.2, 0.3]\n[integrator]\nmethod = 'gauss8'\nstep = 0.05\n"
      << "[run]\nduration = 1\n";
  const auto scene = scene::read_scene((folder_ / "evil.toml").string());
  scene::RunOptions options;
  options.out = (folder_ / "evil").string();
  scene::run(scene, scene::assemble(scene), options);
  const auto count = [](const std::string& all, const std::string& what) {
    int n = 0;
    for (size_t at = 0; (at = all.find(what, at)) != std::string::npos; ++at) ++n;
    return n;
  };
  const fs::path page = find_template(), made = folder_ / "report.html";
  if (page.empty()) GTEST_SKIP() << no_template_text();
  write_report(options.out, made, page);
  text = scene::read_file(made);
  const std::string blank = scene::read_file(page);
  for (const char* tag : {"<script", "</script", "<img", "<!--"})
    EXPECT_EQ(count(text, tag), count(blank, tag)) << tag;
  EXPECT_EQ(count(text, "alert(1)") > 3, true) << "the names are on the page, as data";
  EXPECT_EQ(count(text, "default-src 'none'; script-src 'unsafe-inline'"), 1);
  for (const char* from : {"src=\"http", "href=\"http", "src=\"//", "@import", "url(http"})
    EXPECT_EQ(count(text, from), 0) << from;
  for (const auto& file : {options.out + "/energy_error.svg", options.out + "/ledger.svg"}) {
    EXPECT_EQ(count(scene::read_file(file), "<img"), 0) << file;
    EXPECT_EQ(count(scene::read_file(file), "<script"), 0) << file;
  }
}

TEST_F(Report, TemplateWithoutAPlaceForTheDataIsRefused) {
  const fs::path page = folder_ / "page.html";
  std::ofstream(page) << "<script></script>";
  EXPECT_THROW(write_report(out(), folder_ / "r.html", page), InvalidArgument);
  EXPECT_FALSE(fs::exists(folder_ / "r.html"));
}

TEST_F(Report, OfDamagedResultsSaysSo) {
  fs::resize_file(out() + "/run.h5", fs::file_size(out() + "/run.h5") / 2);
  const Json j = Json::parse(report_json(out()));
  EXPECT_EQ(j["status"]["state"], "damaged");
  ASSERT_EQ(j["missing"].size(), 1u);
  EXPECT_NE(j["missing"][0].get<std::string>().find("run.h5"), std::string::npos);
  EXPECT_EQ(j["summary"]["verdict"], "pass");  // what can be read is there
}

TEST_F(Report, OfAFolderWithoutResultsIsRefused) {
  fs::create_directories(folder_ / "empty");
  try {
    report_json(folder_ / "empty");
    FAIL() << "expected InvalidArgument";
  } catch (const InvalidArgument& e) {
    EXPECT_NE(std::string(e.what()).find("holds no results: expected summary.json"),
              std::string::npos)
        << e.what();
  }
}

TEST_F(Report, OfARunUnderWayShowsWhatItHasRecorded) {
  auto scene = scene::read_scene((folder_ / "scene.toml").string());
  std::atomic<bool> stop = true;  // before the first step
  scene::RunOptions options;
  options.out = (folder_ / "cut").string();
  options.stop = &stop;
  scene::run(scene, scene::assemble(scene), options);
  const Json j = Json::parse(report_json(options.out));
  EXPECT_EQ(j["status"]["state"], "unfinished");
  EXPECT_TRUE(j["missing"].empty()) << j["missing"].dump();
  EXPECT_EQ(j["phases"][0]["series"]["records"], 1);
  EXPECT_EQ(j["phases"][0]["playback"]["nodes"], 2);
}

TEST(Shapes, QuaternionsOfRotations) {
  for (const auto& [r, p, y] :
       {std::array{0.1, 0.2, 0.3}, {3.1, 0.1, -2.9}, {0.2, 1.5, 3.0}, {-3.0, -1.0, 0.4}}) {
    const auto R = mechanics::rotation_from_rpy(r, p, y);
    const auto q = mechanics::quaternion_of(R);
    const auto back = mechanics::rotation_matrix(mechanics::Quaternion<double>::load(q.data()));
    EXPECT_NEAR(mechanics::norm(back.x - R.x) + mechanics::norm(back.y - R.y) +
                    mechanics::norm(back.z - R.z),
                0, 4e-15);
  }
}

}  // namespace
}  // namespace porthos::report::report_test
