// Requirements: [[stop]]s with outcome = "fail" as rows of the checks: met or not, looked at or
// not, over phases, resumed and in memory.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "scene/session/info.h"
#include "scene/session/memory_run.h"
#include "tests/run/shipped.h"

namespace porthos::test::requirements_test {
namespace {

/// A rod of 2 kg about its hinge, free of gravity: it turns at 2 rad/s.
const std::string turning =
    "[initial]\njoints.hinge = { position = 0, velocity = 2 }\n[[output]]\nquantity = "
    "\"joint_position\"\nname = \"q\"\njoint = \"hinge\"\n";

std::string requirement(const std::string& keys, const std::string& output = "q") {
  return fmt::format("[[stop]]\noutput = \"{}\"\noutcome = \"fail\"\n{}\n", output, keys);
}
scene::Scene scene_of(const TemporaryFolder& folder, const std::string& urdf,
                      const std::string& more, double duration, double step = 0.01) {
  write_bytes(folder / "model.urdf", urdf);
  write_bytes(folder / "scene.toml",
              fmt::format("[model]\nurdf = \"model.urdf\"\nbase = \"fixed\"\n{}[integrator]\n"
                          "method = \"gauss8\"\nstep = {}\n[run]\nduration = {}\n"
                          "record_every = 0.3\n",
                          more, step, duration));
  return scene::read_scene((folder / "scene.toml").string());
}
scene::Scene rod(const TemporaryFolder& folder, const std::string& more, double duration,
                 double step) {
  return scene_of(folder,
                  "<robot name='rod'><link name='foot'/>" + link("rod", 2) +
                      joint("hinge", "foot", "rod", "0 1 0") + "</robot>",
                  turning + more, duration, step);
}
scene::RunReport of_rod(const std::string& more, double duration = 8, double step = 0.01) {
  TemporaryFolder folder;
  const auto s = rod(folder, more, duration, step);
  return scene::run_in_memory(s, scene::assemble(s), {});
}
/// The rows of stops as text, to the last bit.
std::string rows_of(const scene::RunReport& r) {
  std::string all;
  for (const auto& c : r.checks)
    if (c.name.starts_with("stop."))
      all += fmt::format("{} {} {} {} {}\n", c.name, c.value, c.limit, c.pass, c.telling);
  for (const auto& n : r.not_applicable)
    if (n.name.starts_with("stop.")) all += n.name + ": " + n.why + "\n";
  return all;
}

}  // namespace

TEST(Requirements, OneThatIsMetShowsItsValueAndItsLimit) {
  const auto r = of_rod(requirement("above = 17\nname = \"turned\"") +
                        requirement("below = -1\nafter = 4\nname = \"low\"") +
                        "[[stop]]\noutput = \"q\"\nabove = 20\n");
  EXPECT_EQ(r.verdict(), scene::Verdict::pass);
  keeps("largest angle, off 16 rad", std::fabs(value_of(r, "stop.turned") - 16), 1e-13);
  keeps("smallest angle since 4 s, its sign turned, off -8 rad",
        std::fabs(value_of(r, "stop.low (sign turned)") + 8), 1e-13);
  breaks("it is not the smallest of the run, 0 rad",
         std::fabs(value_of(r, "stop.low (sign turned)")), 1);
  ASSERT_EQ(rows_of(r).find("turned"), 5u);
  for (const auto& c : r.checks) {
    if (!c.name.starts_with("stop.")) continue;
    EXPECT_TRUE(c.pass && !c.telling && c.value <= c.limit) << c.name;
    EXPECT_EQ(c.limit, c.name == "stop.turned" ? 17 : 1);
  }
  EXPECT_EQ(std::ranges::count(rows_of(r), '\n'), 2) << "a stop that only ends is no requirement";
}

TEST(Requirements, OneThatIsNotMetFails) {
  for (const char* keys : {"above = 7", "below = -7"}) {
    const bool above = keys[0] == 'a';
    const auto r =
        of_rod(std::string(above ? ""
                                 : "[[output]]\nquantity = \"formula\"\nname = "
                                   "\"back\"\nformula = \"-q\"\nunit = \"rad\"\n") +
               requirement(std::string(keys) + "\nname = \"far\"", above ? "q" : "back"));
    EXPECT_EQ(r.verdict(), scene::Verdict::fail);
    const std::string name = above ? "stop.far" : "stop.far (sign turned)";
    EXPECT_FALSE(rows_of(r).empty());
    // Reached at the end of a step, so passed in the next one.
    keeps(name + ", off its limit of 7 rad", std::fabs(value_of(r, name) - 7), 1e-11);
    for (const auto& c : r.checks) EXPECT_EQ(c.pass, c.name != name) << c.name;
  }
}

TEST(Requirements, OneThatWasNeverLookedAtSaysSo) {
  const auto r = of_rod(requirement("above = 1\nafter = 20\nname = \"late\""));
  EXPECT_EQ(rows_of(r), "stop.late: begins at 20 s, the run ended at 8 s\n");
  EXPECT_EQ(r.verdict(), scene::Verdict::pass);
  // At the end, which 6 steps of 0.15 s miss by a rounding: 0.8999999999999999 s.
  const auto at_end = [](const char* after, double duration, double step) {
    return of_rod(requirement(fmt::format("above = 17\nafter = {}\nname = \"end\"", after)),
                  duration, step);
  };
  for (const double step : {0.15, 0.01, 0.4})  // the last one is shorter
    keeps(fmt::format("angle at the end, steps of {} s, off 1.8 rad", step),
          std::fabs(value_of(at_end("0.9", 0.9, step), "stop.end") - 1.8), 1e-14);
  EXPECT_TRUE(std::isnan(value_of(at_end("0.9000001", 0.9, 0.15), "stop.end")));
}

TEST(Requirements, AreThoseOfTheWholeRunInPhasesResumedAndInMemory) {
  const std::string arm =
      "[environment]\ngravity = \"uniform\"\nvector = [0, 0, -9.81]\n[initial]\njoints.shoulder = "
      "{ position = 2 }\njoints.elbow = { position = 1 }\n[[output]]\nquantity = \"joint_rate\"\n"
      "name = \"rate\"\njoint = \"elbow\"\n" +
      requirement("above = 30\nname = \"fast\"", "rate") +
      requirement("below = -30\nafter = 1.2\nname = \"back\"", "rate") +
      requirement("above = 1\nafter = 70\nname = \"late\"", "rate");
  for (const char* event : {"", "[[event]]\ntype = \"lock\"\njoint = \"shoulder\"\nat = 1\n"}) {
    TemporaryFolder folder;
    const auto s = scene_of(folder, arm_urdf(), arm + event, 2);
    const auto a = scene::assemble(s);
    const auto whole = scene::run(s, a, into(folder / "whole"));
    const std::string rows = rows_of(whole);
    EXPECT_TRUE(says(rows, "stop.late: begins at 70 s, the run ended at 2 s\n")) << rows;
    EXPECT_EQ(std::ranges::count(rows, '\n'), 3) << rows;
    EXPECT_EQ(rows_of(scene::run_in_memory(s, a, {})), rows);
    for (const std::int64_t at : {77, 150}) {
      auto half = into(folder / fmt::format("parts_{}", at));
      half.stop_at = at;
      EXPECT_TRUE(scene::run(s, a, half).interrupted);
      half = into(half.out, true);
      EXPECT_EQ(rows_of(scene::run(s, a, half)), rows) << "stopped at step " << at;
    }
    // The largest value of all steps, as outputs see it with extrema = "all".
    auto seen = s;
    seen.extrema = scene::Extrema::all;
    const auto all = scene::run_in_memory(seen, a, {});
    keeps("largest rate, off that of all steps",
          std::fabs(value_of(whole, "stop.fast") - all.outputs[0].largest), 1e-14);
    breaks("the records alone see less", all.outputs[0].largest - whole.outputs[0].largest, 1e-6);
  }
}

TEST(Requirements, OneThatDoesNotHoldAfterAnEventHasTheValueThere) {
  const std::string arm =
      "[initial]\njoints.shoulder = { velocity = 1 }\njoints.elbow = { position = 1, velocity = 1 "
      "}\n[[output]]\nquantity = \"joint_rate\"\nname = \"rate\"\njoint = \"elbow\"\n";
  const std::string lock = "[[event]]\ntype = \"lock\"\njoint = \"shoulder\"\nat = 1\n";
  const auto run = [&](const std::string& more, double duration) {
    TemporaryFolder folder;
    const auto s = scene_of(folder, arm_urdf(), arm + more, duration);
    return scene::run_in_memory(s, scene::assemble(s), {});
  };
  const double before = run("", 1).outputs[0].end, after = run(lock, 1.01).outputs[0].end;
  const double between = 0.5 * (before + after);
  const auto r = run(lock + requirement(fmt::format("{} = {}\nname = \"jump\"\nafter = 0.9",
                                                    after > before ? "above" : "below", between),
                                        "rate"),
                     2);
  const std::string name = after > before ? "stop.jump" : "stop.jump (sign turned)";
  EXPECT_EQ(r.verdict(), scene::Verdict::fail) << rows_of(r);
  EXPECT_EQ(r.simulated_s, 1);
  EXPECT_EQ(std::ranges::count(rows_of(r), '\n'), 1) << rows_of(r);
  keeps("rate after the event, off that of a run without the stop",
        std::fabs(std::fabs(value_of(r, name)) - std::fabs(after)), 1e-12);
  breaks("it is not the limit", std::fabs(std::fabs(value_of(r, name)) - std::fabs(between)), 0.05);
  const auto& o = r.outputs[0];
  keeps("that extremum of the output, off it",
        std::fabs((after > before ? o.largest : o.least) - after), 1e-12);
}

// outcome = "judge": to the end, and the worst value of all steps since `after`.
TEST(Requirements, OneThatJudgesLetsTheRunGoOn) {
  const auto judged = [](const std::string& keys, const std::string& output = "q") {
    return fmt::format("[[stop]]\noutput = \"{}\"\noutcome = \"judge\"\n{}\n", output, keys);
  };
  const auto r = of_rod(judged("above = 7\nname = \"far\"") + judged("above = 17\nname = \"ok\"") +
                        judged("below = 9\nafter = 4\nname = \"low\"") +
                        judged("below = 7\nafter = 4\nname = \"high\"") +
                        judged("above = 1\nafter = 20\nname = \"late\""));
  EXPECT_EQ(r.simulated_s, 8);
  EXPECT_EQ(r.verdict(), scene::Verdict::fail);
  EXPECT_FALSE(r.stopped);
  keeps("worst value, off 16 rad", std::fabs(value_of(r, "stop.far") - 16), 1e-13);
  keeps("smallest since 4 s, its sign turned, off -8 rad",
        std::fabs(value_of(r, "stop.low (sign turned)") + 8), 1e-13);
  for (const auto& c : r.checks)
    EXPECT_EQ(c.pass, c.name != "stop.far" && c.name != "stop.low (sign turned)") << c.name;
  EXPECT_TRUE(says(rows_of(r), "stop.late: begins at 20 s, the run ended at 8 s\n"));
  // It holds from the start; beside one that ends the run, whatever their order.
  for (const bool first : {true, false}) {
    const std::string ends = requirement("above = 4\nname = \"end\"");
    const auto both =
        of_rod((first ? ends : "") + judged("above = -1\nname = \"all\"") + (first ? "" : ends));
    keeps("end by the other stop, off 2 s", std::fabs(both.simulated_s - 2), 1e-11);
    ASSERT_TRUE(both.stopped);
    EXPECT_EQ(both.stopped->name, "end");
    keeps("value of the one that judges", std::fabs(value_of(both, "stop.all") - 4), 1e-11);
  }
}

TEST(Requirements, OneThatJudgesOverPhasesAndAResume) {
  const std::string arm =
      "[initial]\njoints.shoulder = { velocity = 1 }\njoints.elbow = { position = 1, velocity = 1 "
      "}\n[[output]]\nquantity = \"joint_rate\"\nname = \"rate\"\njoint = \"elbow\"\n[[stop]]\n"
      "output = \"rate\"\nbelow = 0.99\noutcome = \"judge\"\nname = \"slow\"\n";
  for (const char* event : {"", "[[event]]\ntype = \"lock\"\njoint = \"shoulder\"\nat = 1\n"}) {
    TemporaryFolder folder;
    const auto s = scene_of(folder, arm_urdf(), arm + event, 2);
    const auto a = scene::assemble(s);
    const auto whole = scene::run(s, a, into(folder / "whole"));
    EXPECT_EQ(whole.simulated_s, 2);
    EXPECT_EQ(whole.verdict(), scene::Verdict::fail);
    auto half = into(folder / "half");
    half.stop_at = 77;
    EXPECT_TRUE(scene::run(s, a, half).interrupted);
    EXPECT_EQ(rows_of(scene::run(s, a, into(half.out, true))), rows_of(whole));
    auto seen = s;
    seen.extrema = scene::Extrema::all;
    keeps("smallest rate, off that of all steps",
          std::fabs(value_of(whole, "stop.slow (sign turned)") +
                    scene::run_in_memory(seen, a, {}).outputs[0].least),
          1e-14);
  }
}

// Beside a sampled law a requirement judges by what acted in each step.
TEST(Requirements, OneThatJudgesATorqueSeesWhatASampledLawHeld) {
  const std::string servo =
      "[[element]]\ntype = \"controller\"\nname = \"servo\"\njoint = \"hinge\"\nstiffness = "
      "3\ndamping = 0.1\nrate = 2\n[[output]]\nquantity = \"joint_torque\"\nname = \"t\"\njoint "
      "= \"hinge\"\n";
  const auto judged = [&](const char* limit, const char* outcome = "judge") {
    return servo + fmt::format("[[stop]]\noutput = \"t\"\noutcome = \"{}\"\n{}\nname = \"u\"\n",
                               outcome, limit);
  };
  TemporaryFolder folder;
  auto seen = rod(folder, judged("above = 100"), 8, 0.01);
  seen.extrema = scene::Extrema::all;
  const auto r = scene::run_in_memory(seen, scene::assemble(seen), {});
  const scene::OutputRow& torque = r.outputs.at(1);
  keeps("largest torque, off that of the output at all steps",
        std::fabs(value_of(r, "stop.u") - torque.largest), 1e-15);
  breaks("control: no torque", torque.largest, 0.1);
  EXPECT_EQ(of_rod(judged("above = 0.1")).verdict(), scene::Verdict::fail);
  const auto low = of_rod(judged("below = -100"));
  keeps("smallest, its sign turned",
        std::fabs(value_of(low, "stop.u (sign turned)") + torque.least), 1e-15);
  EXPECT_TRUE(says(refusal([&] { of_rod(judged("above = 100", "fail")); }),
                   "expected outcome = \"judge\", or an output that"));
}

// What a run refuses before its first step `porthos info` refuses too, by the same sentence.
TEST(Requirements, AScenesInfoRefusesWhatItsRunDoes) {
  const std::string arm =
      "[initial]\njoints.elbow = { position = 1, velocity = 1 }\n[[output]]\nquantity = "
      "\"joint_position\"\nname = \"q\"\njoint = \"elbow\"\n";
  for (const char* event : {"", "[[event]]\ntype = \"lock\"\njoint = \"shoulder\"\nat = 1\n"})
    for (const char* limit : {"above = -1", "above = 20"}) {
      TemporaryFolder folder;
      const auto s = scene_of(folder, arm_urdf(), arm + event + requirement(limit), 2);
      const auto a = scene::assemble(s);
      const std::string why = refusal([&] { (void)scene::run_in_memory(s, a, {}); });
      EXPECT_EQ(says(why, "holds where the run starts"), limit == std::string("above = -1"));
      EXPECT_EQ(refusal([&] { (void)scene::info_text(s, a); }), why);
      EXPECT_EQ(refusal([&] { (void)scene::info_json(s, a); }), why);
    }
}

// "above" is more than: a limit that is reached, from wherever, is kept.
TEST(Requirements, AValueAtItsLimitHasNotPassedIt) {
  const auto formula = [](const char* f) {
    return fmt::format(
        "[[output]]\nquantity = \"formula\"\nname = \"f\"\nformula = \"{}\"\n"
        "unit = \"rad\"\n",
        f);
  };
  struct Case {
    std::string more;
    double at;  // where the run ends, of 8 s; q = 2 t
  };
  const Case cases[] = {{formula("min(q, 0.2)") + requirement("above = 0.2", "f"), 8},
                        {formula("max(-q, -0.2)") + requirement("below = -0.2", "f"), 8},
                        {formula("max(min(q, 0.2), q - 4)") + requirement("above = 0.2", "f"), 2.1},
                        {formula("0.2 - (q - 4)^2") + requirement("above = 0.2", "f"), 8},
                        {formula("0.6 + q") + requirement("above = 0.6", "f"), 0},
                        {formula("0.6 + q^3") + requirement("above = 0.6", "f"), 0},
                        {formula("0.6 - q") + requirement("above = 0.6", "f"), 8},
                        {requirement("above = 0"), 0},
                        {requirement("below = 0"), 8}};
  for (const Case& c : cases) {
    const auto r = of_rod(c.more);
    EXPECT_EQ(r.verdict() == scene::Verdict::pass, c.at == 8) << c.more;
    EXPECT_EQ(std::ranges::count(rows_of(r), '\n'), 1);
    keeps("end of the run, off " + fmt::format("{} s", c.at), std::fabs(r.simulated_s - c.at),
          c.more.find("q^3") == std::string::npos ? 1e-11 : 1e-3);
  }
  EXPECT_TRUE(says(refusal([&] { of_rod(formula("0.6 + q") + requirement("above = 0.59", "f")); }),
                   "holds where the run starts"));
}

TEST(Requirements, AHeightOf400KmIsNotBelowIt) {
  const auto run = [](const char* limit) {
    TemporaryFolder folder;
    write_bytes(folder / "model.urdf", "<robot name='bus'>" + link("bus", 20) + "</robot>");
    write_bytes(folder / "scene.toml",
                fmt::format("[model]\nurdf = \"model.urdf\"\nbase = \"free\"\n[orbit]\naltitude = "
                            "400e3\n[[output]]\nquantity = \"altitude\"\nname = \"height\"\n"
                            "[[stop]]\noutput = \"height\"\nbelow = {}\n[integrator]\nmethod = "
                            "\"gauss8\"\nstep = 1\n[run]\nduration = 1000\n",
                            limit));
    const auto s = scene::read_scene((folder / "scene.toml").string());
    return scene::run_in_memory(s, scene::assemble(s), {}).simulated_s;
  };
  EXPECT_EQ(run("400000"), 1000);
  EXPECT_TRUE(says(refusal([&] { run("400000.001"); }), "holds where the run starts"));
}

// The instant that ended the run, between two records, is among what the outputs have seen.
TEST(Requirements, TheOutputShowsTheValueThatFailedIt) {
  for (const char* jump : {"0.5", "0.25"}) {
    const std::string push = fmt::format(
        "[[element]]\ntype = \"force\"\nname = \"push\"\njoint = \"hinge\"\npieces = {{ period = "
        "1.0, "
        "nodes = 1, values = [1e-4, {}, 0] }}\n[[output]]\nquantity = \"joint_torque\"\nname = "
        "\"t\"\njoint = \"hinge\"\n",
        jump);
    const auto r = of_rod(push + requirement("above = 0.2\nname = \"tmax\"", "t"));
    EXPECT_EQ(r.verdict(), scene::Verdict::fail);
    keeps("end of the run, off 1 s", std::fabs(r.simulated_s - 1), 1e-12);
    keeps("largest torque, off the piece's", std::fabs(r.outputs.at(1).largest - std::stod(jump)),
          1e-15);
    keeps("value of the check", std::fabs(value_of(r, "stop.tmax") - std::stod(jump)), 1e-15);
  }
}

}  // namespace porthos::test::requirements_test
