// `porthos judge`: rows that are missing, too few or too far apart, and columns in another order.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <random>

#include "scene/files/hdf5_reader.h"
#include "scene/judge/judge_file.h"
#include "scene/plot/plot.h"
#include "scene/run/growth_words.h"
#include "scene/session/replot.h"
#include "tests/run/scenes.h"

namespace porthos::test::judge_rows_test {
namespace {

/// Two rotors on a fixed foot that do not feel each other.
class JudgeRows : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto rotor = [](const char* name, double inertia) {
      return fmt::format(
          "<link name='{0}_disk'><inertial><mass value='1'/><inertia ixx='{1}' iyy='{1}' "
          "izz='{1}' ixy='0' ixz='0' iyz='0'/></inertial></link><joint name='{0}' "
          "type='continuous'><parent link='foot'/><child link='{0}_disk'/><axis xyz='0 0 "
          "1'/></joint>",
          name, inertia);
    };
    write_bytes(folder_ / "model.urdf", "<robot name='rotors'><link name='foot'/>" +
                                            rotor("a", 0.7) + rotor("b", 0.2) + "</robot>");
  }
  /// They turn steadily; the rate of the first swings by a part in a million.
  /// @param kept   whether a row is written
  /// @param spike  number of the row, from 1, whose rate is half as large again
  scene::RunReport judged(int n, const std::function<bool(int)>& kept, double h = 0.1,
                          double rate = 2, double of_rates = 1, int spike = 0) {
    std::string text = "t,a,b,v.a,v.b\n";
    for (int i = 0; i < n; ++i) {
      const double t = h * i;
      if (kept(i))
        text += fmt::format(
            "{:.6f},{:.12g},{:.12g},{:.12g},1\n", t, rate * t, t,
            (i + 1 == spike ? 1.5 : 1) * of_rates * rate * (1 + 1e-6 * std::sin(5 * t)));
    }
    write_bytes(folder_ / "run.csv", text);
    write_bytes(folder_ / "map.toml", "[model]\nbase = \"fixed\"\n[verify]\nenergy = 1e-4\n");
    fs::remove_all(folder_ / "out");
    return scene::judge_file({(folder_ / "run.csv").string(), (folder_ / "model.urdf").string(),
                              (folder_ / "map.toml").string(), (folder_ / "out").string()});
  }
  TemporaryFolder folder_;
};

bool notes_say(const scene::RunReport& r, const std::string& part) {
  return std::ranges::any_of(r.notes, [&](const auto& n) { return says(n, part); });
}
const scene::Check* rates_of(const scene::RunReport& r) {
  const auto at = std::ranges::find(r.checks, "rates", &scene::Check::name);
  return at == r.checks.end() ? nullptr : &*at;
}
bool no_rates_as(const scene::RunReport& r, const std::string& why) {
  return !rates_of(r) && std::ranges::any_of(r.not_applicable, [&](const auto& n) {
    return n.name == "rates" && says(n.why, why);
  });
}
bool bounded(const scene::RunReport& r) {
  return scene::growth_words(r).starts_with("stays bounded");
}
const char* const unequal = "is known at unequal intervals, which do not tell how it grows";

TEST_F(JudgeRows, AHoleIsNamedAndLeftOut) {
  const auto hole = [](int from, int rows) {
    return [=](int i) { return i < from || i >= from + rows; };
  };
  const auto r = judged(2000, hole(800, 200));
  EXPECT_TRUE(notes_say(r, "rows 800-801: 20.1 s apart, the others 0.1 s"));
  EXPECT_TRUE(r.passed());
  ASSERT_TRUE(rates_of(r));
  EXPECT_LT(rates_of(r)->value, 1e-5);
  EXPECT_TRUE(notes_say(r, "how the error grows is told of rows 801-1800"));
  EXPECT_TRUE(bounded(r)) << scene::growth_words(r);
  const auto whole = judged(2000, [](int) { return true; });
  EXPECT_FALSE(notes_say(whole, "apart")) << "control";
  EXPECT_EQ(scene::rows_words(whole), "2000 rows, 0.1 s apart");
  EXPECT_EQ(scene::rows_words(r), "1800 rows, 0.111 s apart in the mean");
  const std::string beneath = scene::plot_subtitle(whole);
  EXPECT_TRUE(says(beneath, "2000 rows, 0.1 s apart") && !says(beneath, "CPU")) << beneath;
  EXPECT_FALSE(whole.energy.about_centre) << "a fixed base";
  EXPECT_NEAR(rates_of(r)->value, rates_of(whole)->value, 1e-6);
  EXPECT_FALSE(judged(2000, hole(800, 200), 0.1, 2, 1.5).passed()) << "control: wrong rates";

  const auto small = judged(2000, hole(700, 1));
  EXPECT_TRUE(notes_say(small, "rows 700-701: 0.2 s apart, the others 0.1 s"));
  EXPECT_TRUE(bounded(small));
  // No piece is a third of the time.
  const auto halves = judged(2000, hole(600, 800));
  EXPECT_EQ(scene::growth_words(halves), unequal);
  EXPECT_TRUE(notes_say(halves, "rows 600-601: 80.1 s apart"));
}

TEST_F(JudgeRows, PicturesHaveNoLineThroughAHole) {
  const auto lines = [&](const char* file) {
    const std::string svg = read_bytes(folder_ / "out" / file);
    size_t n = 0;
    for (size_t at = 0; (at = svg.find("<polyline", at)) != svg.npos; ++at) ++n;
    return n;
  };
  (void)judged(600, [](int) { return true; });
  const size_t motion = lines("motion.svg"), ledger = lines("ledger.svg");
  (void)judged(600, [](int i) { return i < 200 || i >= 300; });
  EXPECT_EQ(lines("motion.svg"), 2 * motion);
  EXPECT_EQ(lines("ledger.svg"), 2 * ledger);
  const std::string before = read_bytes(folder_ / "out/motion.svg");
  (void)scene::replot(folder_ / "out");
  EXPECT_EQ(lines("ledger.svg"), 2 * ledger);
  EXPECT_EQ(read_bytes(folder_ / "out/motion.svg"), before);
  EXPECT_EQ(scene::motion_in(folder_ / "out", 1000).holes.size(), 1u);
}

TEST_F(JudgeRows, RowsDroppedAtRandomAreToldOnce) {
  const auto dropped = [&](double part) {
    std::mt19937_64 rng(2);
    std::uniform_real_distribution<double> uniform;
    return judged(2000, [&](int) { return uniform(rng) >= part; });
  };
  const auto few = dropped(0.05), half = dropped(0.5);
  EXPECT_TRUE(notes_say(few, "holes more, the others 0.1 s"));
  EXPECT_FALSE(notes_say(few, "the rows are at unequal intervals"));
  EXPECT_TRUE(notes_say(few, "rows follow at other intervals (0.1 to 0."));
  EXPECT_TRUE(notes_say(few, "as if rows were 0.1 s apart"));
  EXPECT_TRUE(bounded(few)) << scene::growth_words(few);
  EXPECT_TRUE(notes_say(half, "the rows are at unequal intervals"));
  EXPECT_EQ(scene::growth_words(half), unequal);
  for (const auto& r : {few, half}) EXPECT_TRUE(r.passed());
  const auto one = judged(2000, [](int i) { return i != 700; });
  EXPECT_FALSE(notes_say(one, "follow at other intervals")) << "its hole is told";
}

TEST_F(JudgeRows, OneWrongRowIsToldByNumberAndTime) {
  const auto all = [](int) { return true; };
  for (const int spike : {1, 58, 200}) {
    const auto r = judged(200, all, 0.1, 2, 1, spike);
    EXPECT_FALSE(r.passed());
    const auto part = fmt::format("row {} at {:.6g} s alone is far off: its energy by 1.", spike,
                                  0.1 * (spike - 1));
    EXPECT_TRUE(notes_say(r, part)) << part;
  }
  EXPECT_FALSE(notes_say(judged(200, all), "alone is far off")) << "control";
  EXPECT_FALSE(notes_say(judged(
                             12, [](int i) { return i % 2 == 0; }, 0.1, 2, 1, 3),
                         "alone is far off"))
      << "too few rows to tell";
}

TEST_F(JudgeRows, TooFewRowsAreNotJudged) {
  const auto all = [](int) { return true; };
  for (const int n : {2, 3}) {
    const auto r = judged(n, all, 0.1, 2, 57);
    EXPECT_TRUE(no_rates_as(r, fmt::format("too few rows: {}, expected 4 or more", n)));
    EXPECT_EQ(r.verdict(), scene::Verdict::not_judged);
    EXPECT_TRUE(notes_say(r, "too few rows to judge a motion"));
  }
  EXPECT_EQ(judged(4, all).verdict(), scene::Verdict::pass) << "control";
  EXPECT_TRUE(notes_say(judged(9, all), "9 rows tell little of a motion: expected 10 or more"));
  EXPECT_FALSE(notes_say(judged(10, all), "tell little"));
  EXPECT_EQ(judged(4, all, 0.1, 2, 1.5).verdict(), scene::Verdict::fail) << "control";
  EXPECT_EQ(judged(40, [](int i) { return i % 10 < 2; }).verdict(), scene::Verdict::pass)
      << "unequal, but enough";
}

/// A hint names a cause only if the energy is kept with it. Two pendulums beside each other.
TEST_F(JudgeRows, ColumnsInAnotherOrderOrUnitAreAskedAbout) {
  Case c = pendulum(folder_);
  c.scene.record_every = c.scene.step;
  (void)scene::run(c.scene, c.assembly, into(folder_ / "out"));
  const scene::Hdf5Reader file(folder_ / "out" / "run.h5");
  const auto column = [&](const std::string& name) {
    std::vector<double> x(size_t(file.dataset(name).size()));
    file.read(name, x.data());
    return x;
  };
  const auto t = column("time"), a = column("state/shoulder"), b = column("state/elbow");
  const auto& d = c.assembly.mechanical->description();
  const auto p = column("momentum/shoulder"), q = column("momentum/elbow");
  const auto with = [&](const std::string& heads, double unit) {
    std::string text = heads + "\n";
    for (size_t i = 0; i < t.size(); ++i) {
      std::vector<double> x(size_t(d.nx));
      for (const auto& block : d.blocks) {
        const bool first = block.name == "shoulder";
        x[size_t(block.at)] = first ? a[i] : b[i];
        x[size_t(block.momentum)] = first ? p[i] : q[i];
      }
      const std::vector<std::int64_t> turns(2);
      const auto v = c.assembly.mechanical->rates(x, turns);
      text +=
          fmt::format("{},{},{},{},{}\n", t[i], unit * a[i], unit * b[i], unit * v[0], unit * v[1]);
    }
    write_bytes(folder_ / "run.csv", text);
    fs::remove_all(folder_ / "judged");
    return scene::judge_file({(folder_ / "run.csv").string(), (folder_ / "model.urdf").string(),
                              (folder_ / "map.toml").string(), (folder_ / "judged").string()});
  };
  write_bytes(folder_ / "map.toml",
              "[model]\nbase = \"fixed\"\n[environment]\ngravity = \"uniform\"\nvector = [0, 0, "
              "-9.81]\n[verify]\nenergy = 1e-9\n");
  const std::string right = "t,shoulder,elbow,v.shoulder,v.elbow";
  const char* const degrees = "are angles and rates in degrees?";
  const char* const place = "in each other's place?";
  const auto good = with(right, 1);
  EXPECT_TRUE(good.passed()) << good.energy.max_rel_error;
  EXPECT_FALSE(notes_say(good, degrees) || notes_say(good, place));
  const auto all = with("t,elbow,shoulder,v.elbow,v.shoulder", 1);
  EXPECT_FALSE(all.passed()) << all.energy.max_rel_error;
  EXPECT_TRUE(notes_say(all, "are the columns of 'shoulder' and 'elbow' in each other's place?"));
  EXPECT_FALSE(notes_say(all, degrees));
  EXPECT_TRUE(notes_say(with("t,shoulder,elbow,v.elbow,v.shoulder", 1),
                        "are the rates of 'shoulder' and 'elbow' in each other's place?"));
  const auto turned = with(right, 180 / M_PI);
  EXPECT_TRUE(notes_say(turned, degrees));
  EXPECT_FALSE(notes_say(turned, place));
  const auto doubled = with(right, 2);  // another cause
  EXPECT_FALSE(doubled.passed());
  EXPECT_TRUE(notes_say(doubled, "usual causes that were not tried: columns of another order"));
  for (const auto* told : {&good, &all, &turned}) EXPECT_FALSE(notes_say(*told, "usual causes"));
  EXPECT_FALSE(notes_say(doubled, degrees) || notes_say(doubled, place));
}

/// Rotors that are faster from the middle on, as of no columns in another place.
TEST_F(JudgeRows, MoreThanEightJointsAreNotExchangedWhichANoteSays) {
  const auto judged_with = [&](int joints) {
    std::string urdf = "<robot name='rotors'><link name='foot'/>", text = "t";
    for (int k = 0; k < joints; ++k) {
      urdf += fmt::format(
          "<link name='d{0}'><inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='1' ixy='0' "
          "ixz='0' iyz='0'/></inertial></link><joint name='j{0}' type='continuous'><parent "
          "link='foot'/><child link='d{0}'/><axis xyz='0 0 1'/></joint>",
          k);
      text += fmt::format(",j{0},v.j{0}", k);
    }
    for (int i = 0; i < 100; ++i) {
      text += fmt::format("\n{:.1f}", 0.1 * i);
      const double v = i < 50 ? 1 : 1.1, q = 0.1 * i * v - (i < 50 ? 0 : 0.495);
      for (int k = 0; k < joints; ++k) text += fmt::format(",{:.12g},{}", q, v);
    }
    write_bytes(folder_ / "model.urdf", urdf + "</robot>");
    write_bytes(folder_ / "run.csv", text + "\n");
    fs::remove_all(folder_ / "out");
    return scene::judge_file({(folder_ / "run.csv").string(), (folder_ / "model.urdf").string(),
                              (folder_ / "map.toml").string(), (folder_ / "out").string()});
  };
  write_bytes(folder_ / "map.toml", "[model]\nbase = \"fixed\"\n");
  const char* const not_tried = "exchanged joints were not tried: more than eight";
  const auto nine = judged_with(9), eight = judged_with(8);
  EXPECT_TRUE(notes_say(nine, not_tried));
  EXPECT_FALSE(notes_say(eight, not_tried)) << "control";
  EXPECT_FALSE(nine.passed() || eight.passed());
}

/// Angles modulo a turn fit rates with times in milliseconds too. Controls: seconds, true angles.
TEST_F(JudgeRows, AnOpenQuestionAboutTheUnitOfTimeIsNotPassed) {
  const auto in_units_of = [&](double second, bool wrapped) {
    std::string text = "t,a,b,v.a,v.b\n";
    for (int i = 0; i < 400; ++i) {
      const double t = 0.1 * i, a = 2 * t;
      text += fmt::format("{},{},{},2,1\n", second * t, wrapped ? std::remainder(a, 2 * M_PI) : a,
                          wrapped ? std::remainder(t, 2 * M_PI) : t);
    }
    write_bytes(folder_ / "run.csv", text);
    fs::remove_all(folder_ / "out");
    return scene::judge_file({(folder_ / "run.csv").string(), (folder_ / "model.urdf").string(), "",
                              (folder_ / "out").string()});
  };
  const auto late = in_units_of(1000, true);
  EXPECT_TRUE(no_rates_as(late, "and its angles do not show them"));
  EXPECT_TRUE(notes_say(late, "are times in another unit, as milliseconds? expected seconds"));
  EXPECT_TRUE(std::ranges::all_of(late.checks, &scene::Check::pass));
  EXPECT_EQ(late.verdict(), scene::Verdict::not_judged);
  EXPECT_EQ(in_units_of(1, true).verdict(), scene::Verdict::pass);
  EXPECT_EQ(in_units_of(1000, false).verdict(), scene::Verdict::fail);
}

/// A swing of 3.1 s in rows of 20 s: its rates are no way from row to row. Control: rows of 0.1 s.
TEST_F(JudgeRows, RowsBeyondTheSwingAreTooFewToCheckRates) {
  const auto swing = [&](double h, double of_rates) {
    std::string text = "t,a,b,v.a,v.b\n";
    for (int i = 0; i < 200; ++i)
      text += fmt::format("{},{},0,{},0\n", h * i, 0.05 * std::sin(2 * h * i),
                          of_rates * 0.1 * std::cos(2 * h * i));
    write_bytes(folder_ / "run.csv", text);
    fs::remove_all(folder_ / "out");
    return scene::judge_file({(folder_ / "run.csv").string(), (folder_ / "model.urdf").string(), "",
                              (folder_ / "out").string()});
  };
  EXPECT_TRUE(no_rates_as(swing(20, 1), "too few rows to check rates"));
  const auto close = swing(0.1, 1), wrong = swing(0.1, 2);
  ASSERT_TRUE(rates_of(close) && rates_of(wrong));
  EXPECT_TRUE(rates_of(close)->pass);
  EXPECT_FALSE(rates_of(wrong)->pass);
}

/// A turn with swings of 2.5, 0.4 and 1.8 rad/s, right in every digit, by rows 1.6 s apart: they
/// are too far apart to tell. Controls: at 0.2 s it is right, and wrong with rates of the other
/// sign.
TEST_F(JudgeRows, AMotionThatIsRightIsNotRefusedByCoarseRows) {
  const auto rates_by = [&](double h, double of_rates) {
    std::string text = "t,a,b,v.a,v.b\n";
    for (int i = 0; i < 33; ++i) {
      const double t = h * i;
      double q = 0.9 * t, v = 0.9;
      for (const auto& [w, size, phase] :
           {std::array{2.5, 0.2, 3.5}, {0.4, 0.6, 0.5}, {1.8, 0.3, 0.5}}) {
        q += size * std::sin(w * t + phase);
        v += size * w * std::cos(w * t + phase);
      }
      text += fmt::format("{:.6f},{:.12g},0,{:.12g},0\n", t, q, of_rates * v);
    }
    write_bytes(folder_ / "run.csv", text);
    write_bytes(folder_ / "map.toml", "[model]\nbase = \"fixed\"\n");
    fs::remove_all(folder_ / "out");
    return scene::judge_file({(folder_ / "run.csv").string(), (folder_ / "model.urdf").string(),
                              (folder_ / "map.toml").string(), (folder_ / "out").string()});
  };
  EXPECT_TRUE(no_rates_as(rates_by(1.6, 1), "the rows are too far apart to tell"));
  const auto fine = rates_by(0.2, 1), wrong = rates_by(0.2, -1);
  ASSERT_TRUE(rates_of(fine));
  EXPECT_TRUE(rates_of(fine)->pass);
  ASSERT_TRUE(rates_of(wrong));
  EXPECT_FALSE(rates_of(wrong)->pass);
}

}  // namespace
}  // namespace porthos::test::judge_rows_test
