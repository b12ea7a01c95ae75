// The URDF reader: what it makes of good files, and that no bytes crash it.
#include <gtest/gtest.h>

#include <clocale>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <locale>
#include <random>

#include "tests/support/reference.h"
#include "tests/urdf/robots.h"

namespace porthos::mechanics::urdf_test {
namespace {

Mat3<double> about(int axis, double angle) {
  const double c = std::cos(angle), s = std::sin(angle);
  if (axis == 0) return {{1, 0, 0}, {0, c, s}, {0, -s, c}};
  if (axis == 1) return {{c, 0, -s}, {0, 1, 0}, {s, 0, c}};
  return {{c, s, 0}, {-s, c, 0}, {0, 0, 1}};
}
void expect_near(const Vec3d& a, const Vec3d& b, double tolerance) {
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(a[i], b[i], tolerance) << "component " << i;
}
void expect_near(const Mat3<double>& a, const Mat3<double>& b, double tolerance) {
  expect_near(a.x, b.x, tolerance);
  expect_near(a.y, b.y, tolerance);
  expect_near(a.z, b.z, tolerance);
}
/// m (|c|² 1 - c cᵀ)
Mat3<double> steiner(double m, const Vec3d& c) {
  const double d = dot(c, c);
  return {m * (Vec3d{d, 0, 0} - c.x * c), m * (Vec3d{0, d, 0} - c.y * c),
          m * (Vec3d{0, 0, d} - c.z * c)};
}

// --- Meaning ------------------------------------------------------------------------------------

TEST(Urdf, RpyIsRzRyRx) {
  std::mt19937 rng(3);
  std::uniform_real_distribution<double> angle(-7, 7);
  for (int k = 0; k < 50; ++k) {
    const double r = angle(rng), p = angle(rng), y = angle(rng);
    char origin[200];
    std::snprintf(origin, sizeof origin, "<origin xyz=\"1 -2 3e-1\" rpy=\"%.17g %.17g %.17g\"/>", r,
                  p, y);
    const auto m = parse(arm("revolute", std::string(origin) + "<axis xyz='0 0 1'/>")).mechanism;
    // Three roundings per entry of size <= 1: 1e-15.
    expect_near(m.nodes()[0].placement.R, about(2, y) * about(1, p) * about(0, r), 1e-15);
    expect_near(m.nodes()[0].placement.r, {1, -2, 0.3}, 0);
  }
}

TEST(Urdf, RotatedInertialFrame) {
  const auto m =
      parse(arm_link(
                "<inertial><origin xyz='.1 -.2 .3' rpy='.4 -1.1 2.3'/><mass value='5'/>"
                "<inertia ixx='.9' ixy='.03' ixz='-.02' iyy='.7' iyz='.01' izz='.5'/></inertial>"))
          .mechanism;
  // The default axis is x: the kernel's frame has its z there.
  const Node& n = m.nodes()[0];
  const Vec3d axis = n.placement.R.z;
  expect_near(axis, {1, 0, 0}, 0);
  const Mat3<double> R = about(2, 2.3) * about(1, -1.1) * about(0, .4);
  const Mat3<double> tensor = Sym3<double>{.9, .03, -.02, .7, .01, .5}.full();
  const Vec3d c{.1, -.2, .3};
  const Mat3<double> I = R * tensor * R.transposed() + steiner(5, c);
  const Mat3<double> Z = n.placement.R;  // kernel's frame -> link frame
  EXPECT_EQ(n.inertia.m, 5);
  expect_near(Z * n.inertia.mc, {.5, -1, 1.5}, 1e-15);
  expect_near(Z * n.inertia.I.full() * Z.transposed(), I, 2e-15);
  // The control: without the rotation the tensor is another one.
  EXPECT_GT(norm((tensor + steiner(5, c)).x - I.x), 1e-2);
}

TEST(Urdf, FixedJointsAreMerged) {
  const std::string tip =
      "<inertial><mass value='3'/><inertia ixx='.1' ixy='0' ixz='0' iyy='.2' iyz='0' "
      "izz='.25'/></inertial>";
  const auto m =
      parse(robot({link("base"), link("arm"), link("hand"), link("tip", tip),
                   joint("j", "base", "arm", "continuous", "<axis xyz='0 0 1'/>"),
                   joint("f", "arm", "hand", "fixed", "<origin xyz='0 0 1' rpy='0 0 1'/>"),
                   joint("g", "hand", "tip", "fixed", "<origin xyz='1 0 0' rpy='1 0 0'/>")}))
          .mechanism;
  ASSERT_EQ(m.body_count(), 1);
  EXPECT_EQ(m.total_mass(), 2 + 2 + 3);  // not the base, which cannot move
  const Vec3d at{std::cos(1), std::sin(1), 1};
  const BodyFrame& frame = m.body("tip");
  EXPECT_EQ(frame.node, 0);
  expect_near(frame.pose.r, at, 1e-15);
  expect_near(frame.pose.R, about(2, 1) * about(0, 1), 1e-15);
  const RigidInertia<double>& body = m.nodes()[0].inertia;
  expect_near(body.mc, 3 * at + Vec3d{0, 0, 2}, 1e-15);
  const Mat3<double> R = about(2, 1), S = frame.pose.R;
  const Mat3<double> some = Sym3<double>{.3, 0, 0, .4, 0, .5}.full();
  const Mat3<double> I = some + R * some * R.transposed() + steiner(2, {0, 0, 1}) +
                         S * Sym3<double>{.1, 0, 0, .2, 0, .25}.full() * S.transposed() +
                         steiner(3, at);
  expect_near(body.I.full(), I, 5e-15);
}

std::vector<std::string> coordinate_names(const Mechanism& m) {
  std::vector<std::string> names;
  for (const auto& c : m.coordinates()) names.push_back(c.name);
  return names;
}

TEST(Urdf, JointTypes) {
  struct Case {
    std::string type, inside;
    Names coordinates;
    int nq, nv;
  };
  for (const Case& c : {Case{"revolute", "", {"j"}, 1, 1}, Case{"continuous", "", {"j"}, 1, 1},
                        Case{"prismatic", "", {"j"}, 1, 1},
                        Case{"floating", "", {"j.position", "j.attitude"}, 7, 6},
                        Case{"free", "", {"j.position", "j.attitude"}, 7, 6},
                        Case{"planar", "", {"j.x", "j.y", "j.angle"}, 3, 3},
                        Case{"helical", "<pitch value='.5'/>", {"j"}, 1, 1},
                        Case{"universal", "", {"j.first", "j.second"}, 2, 2},
                        Case{"cylindrical", "", {"j.angle", "j.slide"}, 2, 2},
                        Case{"spherical", "", {"j"}, 4, 3}}) {
    SCOPED_TRACE(c.type);
    const auto result = parse(arm(c.type, c.inside));
    EXPECT_EQ(coordinate_names(result.mechanism), c.coordinates);
    EXPECT_EQ(result.mechanism.nq(), c.nq);
    EXPECT_EQ(result.mechanism.nv(), c.nv);
    EXPECT_TRUE(result.notes.empty());
  }
  EXPECT_EQ(parse(arm("helical", "<pitch value='.5'/>")).mechanism.nodes()[0].pitch, 0.5);
}

TEST(Urdf, AxesOfPlanarAndUniversal) {
  const auto directions = [](const std::string& type, const std::string& inside) {
    std::vector<Vec3d> z;
    Pose X{Mat3<double>::identity(), {0, 0, 0}};
    const auto m = parse(arm(type, inside)).mechanism;
    for (const Node& n : m.nodes()) z.push_back((X = X * neutral_pose(n)).R.z);
    return z;
  };
  const auto planar = directions("planar", "<axis xyz='0 0 2'/><axis2 xyz='0 1 0'/>");
  expect_near(planar.at(0), {0, 1, 0}, 0);
  expect_near(planar.at(1), {-1, 0, 0}, 0);
  expect_near(planar.at(2), {0, 0, 1}, 0);
  expect_near(directions("planar", "").at(2), {1, 0, 0}, 0);  // URDF's default axis is the normal
  const auto universal = directions("universal", "<axis xyz='0 1 0'/><axis2 xyz='1 0 0'/>");
  expect_near(universal.at(0), {0, 1, 0}, 0);
  expect_near(universal.at(1), {1, 0, 0}, 0);
}

TEST(Urdf, LimitsDampingAndFrictionAreKept) {
  const auto m =
      parse(
          arm("revolute", "<limit lower='-1' upper='+2.5'/><dynamics damping='.3' friction='.4'/>"))
          .mechanism;
  ASSERT_EQ(m.joint_properties().size(), 1u);
  const JointProperties& p = m.joint_properties()[0];
  EXPECT_EQ(p.joint, "j");
  EXPECT_EQ(p.lower, -1);
  EXPECT_EQ(p.upper, 2.5);
  EXPECT_EQ(p.damping, 0.3);
  EXPECT_EQ(p.friction, 0.4);
}

TEST(Urdf, RootOnFreeAndFixedBase) {
  Options o = free_base;
  o.gravity = {0, 0, -9.81};
  const auto result = parse(arm("revolute"), o);
  EXPECT_EQ(result.root_link, "base");
  EXPECT_EQ(coordinate_names(result.mechanism), (Names{"base.position", "base.attitude", "j"}));
  EXPECT_EQ(result.mechanism.total_mass(), 4);
  EXPECT_EQ(result.mechanism.gravity().z, -9.81);
  EXPECT_EQ(result.mechanism.name(), "r");
  EXPECT_EQ(parse(arm("revolute")).mechanism.body("base").node, -1);
  // Neither a joint called like the fixed base's own nor a root link called "world" is in the way.
  EXPECT_EQ(parse(robot({link("base"), link("arm"), joint("root", "base", "arm")})).mechanism.nv(),
            1);
  EXPECT_EQ(
      parse(robot({link("world", ""), link("arm"), joint("j", "world", "arm")})).mechanism.nv(), 1);
}

TEST(Urdf, UnphysicalInertiaOnlyOnRequest) {
  const std::string text = arm_link(
      "<inertial><mass value='1'/>"
      "<inertia ixx='1' ixy='0' ixz='0' iyy='1' iyz='0' izz='2.1'/></inertial>");
  EXPECT_THROW(parse(text), InvalidArgument);
  Options o;
  o.accept_unphysical_inertia = true;
  EXPECT_EQ(parse(text, o).mechanism.nodes()[0].inertia.m, 1);
}

TEST(Urdf, BodiesComeDepthFirstInFileOrderOfTheJoints) {
  const auto m = parse(robot({link("a"), link("b"), link("c"), link("d"), link("root"),
                              joint("4", "root", "d"), joint("1", "root", "a"),
                              joint("3", "a", "c"), joint("2", "c", "b")}))
                     .mechanism;
  Names names;
  for (const auto& b : m.bodies()) names.push_back(b.name);
  EXPECT_EQ(names, (Names{"root", "d", "a", "c", "b"}));
}

struct Comma : std::numpunct<char> {
  char do_decimal_point() const override { return ','; }
};

TEST(Urdf, NumbersDoNotDependOnTheLocale) {
  const std::string c_before = std::setlocale(LC_NUMERIC, nullptr);
  const std::locale before = std::locale::global(std::locale(std::locale(), new Comma));
  std::setlocale(LC_NUMERIC, "de_DE.UTF-8");  // where the machine has it
  const auto r = parse(arm("helical", "<pitch value='0.25'/><dynamics friction='0.5'/>"));
  std::locale::global(before);
  std::setlocale(LC_NUMERIC, c_before.c_str());
  EXPECT_EQ(r.mechanism.nodes()[0].pitch, 0.25);
  EXPECT_EQ(r.notes.at(0).text, "joint 'j': friction 0.5 read but not simulated");
}

// --- Any bytes ----------------------------------------------------------------------------------

const std::string rich = robot(
    {"<!-- every tag -->", "<material name='red'/>", link("base"),
     link("arm",
          "<inertial><origin xyz='.1 0 .2' rpy='.1 .2 .3'/><mass value='1.5'/>"
          "<inertia ixx='.2' ixy='.01' ixz='0' iyy='.3' iyz='0' izz='.4'/></inertial><visual/>"),
     link("screw"), link("table"), link("ball"),
     joint("j", "base", "arm", "revolute",
           "<origin xyz='0 0 1' rpy='0 1.57 0'/><axis xyz='0 1 0'/>"
           "<limit lower='-1' upper='1' effort='3' velocity='4'/><dynamics damping='.1' "
           "friction='.2'/><mimic joint='s'/>"),
     joint("s", "arm", "screw", "helical", "<pitch value='.01'/>"),
     joint("t", "arm", "table", "planar", "<axis xyz='0 0 1'/><axis2 xyz='1 0 0'/>"),
     joint("b", "table", "ball", "floating"), "<gazebo>&lt;text&gt;</gazebo>"});

/// Whether it is accepted. Anything but a result or an InvalidArgument that names the file fails.
bool survives(const std::string& text, const Options& o) {
  try {
    const auto result = parse(text, o);
    EXPECT_GT(result.mechanism.nv(), 0);
    return true;
  } catch (const InvalidArgument& e) {
    EXPECT_TRUE(std::string_view(e.what()).starts_with("r.urdf:")) << e.what();
    return false;
  }
}

TEST(UrdfFuzz, EveryTruncation) {
  ASSERT_TRUE(survives(rich, free_base));
  const std::size_t end = rich.rfind('>');
  for (std::size_t n = 0; n <= rich.size(); ++n)
    EXPECT_EQ(survives(rich.substr(0, n), n % 2 ? Options{} : free_base), n > end) << n << " bytes";
}

TEST(UrdfFuzz, RandomBytesAndPieces) {
  std::mt19937 rng(20240607);
  const auto below = [&](std::size_t n) { return std::size_t(rng() % n); };
  int accepted = 0;
  const int trials = 20000;
  for (int k = 0; k < trials; ++k) {
    std::string text = rich;
    for (std::size_t flips = 1 + below(3); flips > 0; --flips)
      text[below(text.size())] = char(rng() % 256);
    if (k % 4 == 0) text.erase(below(text.size()), below(40));
    if (k % 4 == 1) text.insert(below(text.size()), text.substr(below(text.size()), below(60)));
    if (k % 4 == 2) text[below(text.size())] = "0123456789e.-+ \"'<>/&="[below(22)];
    accepted += survives(text, k % 2 ? Options{} : free_base);
  }
  EXPECT_GT(accepted, 100);  // both ways are taken
  EXPECT_LT(accepted, trials - 100);
}

// --- Robots beside the project ------------------------------------------------------------------

std::string contents(const fs::path& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// The mass of all links as a text search finds it.
double mass_in(const std::string& text) {
  const std::string key = "value=\"";
  double sum = 0;
  for (auto at = text.find("<mass"); at != text.npos; at = text.find("<mass", at + 1))
    sum += std::stod(text.substr(text.find(key, at) + key.size(), 40));
  return sum;
}

std::string replaced(std::string text, const std::string& old, const std::string& by) {
  for (auto at = text.find(old); at != text.npos; at = text.find(old, at + by.size()))
    text.replace(at, old.size(), by);
  return text;
}

/// On a free base every link counts, on a fixed base those that move. Pinocchio's file, if any, has
/// one of the two.
void check_model(const fs::path& path) {
  auto options = massless(Options::Base::fixed);
  // One of TIAGo's published inertias is not that of any body.
  options.accept_unphysical_inertia = path.stem() == "tiago_continuous";
  const auto fixed = read_urdf(path.string(), options);
  for (const auto& n : fixed.notes) EXPECT_EQ(n.text.find("unknown"), n.text.npos) << n.text;

  // A free base needs an inertia of its own and a name other than "world".
  const std::string text = replaced(contents(path), "\"world\"", "\"ground\"");
  const double sum = mass_in(text), tolerance = 1e-14 * sum;  // rounding of fewer than 100 sums
  const std::string root = fixed.root_link == "world" ? "ground" : fixed.root_link;
  options.base = Options::Base::free;
  const std::string empty = "<link name=\"" + root + "\"";
  const bool bare = text.find(empty + "/>") != text.npos || text.find(empty + " />") != text.npos;
  if (bare)
    options.link_inertia[root] = {1, {0, 0, 0}, {1, 0, 0, 1, 0, 1}, Mat3<double>::identity()};
  const Mechanism moving = parse(text, options).mechanism;
  EXPECT_NEAR(moving.total_mass(), sum + (bare ? 1 : 0), tolerance);

  const std::string reference = contents(path.parent_path() / ".." / path.stem().concat(".json"));
  const std::string key = "\"total_mass\":";
  const auto at = reference.find(key);
  if (at == reference.npos) return;
  const bool flies = reference.find("\"root_joint\": \"freeflyer\"") != reference.npos;
  const double expected = std::stod(reference.substr(at + key.size()));
  EXPECT_NEAR((flies ? moving : fixed.mechanism).total_mass(), expected, tolerance);
}

void read_all(const fs::path& folder) {
  int files = 0;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().extension() != ".urdf") continue;
    SCOPED_TRACE(entry.path().string());
    ++files;
    EXPECT_NO_THROW(check_model(entry.path()));
  }
  EXPECT_GT(files, 0);
}

TEST(UrdfModels, Shared) { read_all(test::data_file("models")); }
TEST(UrdfModels, Pinocchio) { read_all(test::data_file("reference/pinocchio/urdf")); }

}  // namespace
}  // namespace porthos::mechanics::urdf_test
