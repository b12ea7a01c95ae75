#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <numbers>
#include <set>

#include "report/detail/mesh.h"
#include "report/detail/mesh_shelf.h"
#include "tests/run/scenes.h"
#include "tests/support/bounds.h"

/// Meshes of other programs become triangles; the volume that they enclose tells whether all are
/// there and turned to the outside.
namespace porthos::report::mesh_test {
namespace {

namespace fs = std::filesystem;
using test::TemporaryFolder, test::write_bytes, test::refusal, test::keeps;

double volume(const Mesh& m) {
  double six = 0;
  for (const auto& t : m.triangles) {
    const auto &a = m.corners[t[0]], &b = m.corners[t[1]], &c = m.corners[t[2]];
    six += a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
           a[2] * (b[0] * c[1] - b[1] * c[0]);
  }
  return six / 6;
}

/// A sphere of radius 1 m: rows of `n` and columns of 2 n squares, at the poles triangles.
Mesh sphere(int n) {
  Mesh m;
  const auto at = [&](int row, int column) {
    const double a = std::numbers::pi * row / n, b = std::numbers::pi * column / n;
    m.corners.push_back({std::sin(a) * std::cos(b), std::sin(a) * std::sin(b), std::cos(a)});
    return std::uint32_t(m.corners.size() - 1);
  };
  for (int i = 0; i < n; ++i)
    for (int k = 0; k < 2 * n; ++k) {
      const auto a = at(i, k), b = at(i + 1, k), c = at(i + 1, k + 1), d = at(i, k + 1);
      if (i + 1 < n) m.triangles.push_back({a, b, c});
      if (i > 0) m.triangles.push_back({a, c, d});
    }
  return m;
}

std::string binary_stl(const Mesh& m) {
  std::string bytes = "solid, says a program that writes binary files";
  bytes.resize(80, ' ');
  const auto put = [&](const auto& x) {
    bytes.append(reinterpret_cast<const char*>(&x), sizeof x);
  };
  put(std::uint32_t(m.triangles.size()));
  for (const auto& t : m.triangles) {
    for (int k = 0; k < 3; ++k) put(0.0f);
    for (const auto i : t)
      for (const double x : m.corners[i]) put(float(x));
    put(std::uint16_t(0));
  }
  return bytes;
}

/// A tetrahedron of volume 1/6 m³ with corners at 0 and the unit vectors.
const char* const stl =
    "solid t\n"
    "facet normal 0 0 -1\n outer loop\n  vertex 0 0 0\n  vertex 0 1 0\n  vertex 1 0 0\n endloop\n"
    "endfacet\n"
    "facet normal 0 -1 0\n outer loop\n  vertex 0 0 0\n  vertex 1 0 0\n  vertex 0 0 1\n endloop\n"
    "endfacet\n"
    "facet normal -1 0 0\n outer loop\n  vertex 0 0 0\n  vertex 0 0 1\n  vertex 0 1 0\n endloop\n"
    "endfacet\n"
    "facet normal 1 1 1\n outer loop\n  vertex 1 0 0\n  vertex 0 1e0 0\n  vertex 0 0 +1.0\n"
    " endloop\nendfacet\nendsolid t\n";
/// A cube of side 2 m of squares, the last two with corners counted from the end.
const char* const obj =
    "# a cube\no cube\nv -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\n"
    "v -1 1 1\nvt 0 0\nvn 0 0 1\nf 4 3 2 1\nf 5/1/1 6/1/1 7/1/1 8/1/1\nf 1//1 2//1 6//1 5//1\n"
    "f 2 3 7 6\r\nf -6 -5 -1 -2\nf -5 -8 -4 -1\n";
/// The same tetrahedron in centimetres, with sides of 1/2 m, drawn by a node that moves it, and
/// once more by a node in that node, at the same place and twice as large.
std::string collada(const std::string& faces) {
  return R"(<?xml version="1.0"?><COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema">
<asset><unit name="centimeter" meter="0.01"/><up_axis>Y_UP</up_axis></asset>
<library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="f" count="12">0 0 0 50 0 0 0 50 0 0 0 50</float_array></source>
<source id="n"><float_array id="nf" count="3">0 0 1</float_array></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>)" +
         faces + R"(</mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s"><node><translate>100 0 0</translate>
<rotate>0 0 1 90</rotate><instance_geometry url="#g"/>
<node><matrix>2 0 0 0  0 2 0 0  0 0 2 0  0 0 0 1</matrix><instance_geometry url="#g"/></node>
</node></visual_scene></library_visual_scenes></COLLADA>)";
}
const char* const triangles =
    "<triangles count='4'><input semantic='VERTEX' source='#v' offset='0'/>"
    "<input semantic='NORMAL' source='#n' offset='1'/>"
    "<p>0 0 2 0 1 0  0 0 1 0 3 0  0 0 3 0 2 0  1 0 2 0 3 0</p></triangles>";
const char* const polylist =
    "<polylist count='4'><input semantic='VERTEX' source='#v' offset='0'/>"
    "<vcount>3 3 3 3</vcount><p>0 2 1 0 1 3 0 3 2 1 2 3</p></polylist>";

TEST(Mesh, EncloseTheVolumeOfTheirShape) {
  const Mesh text = parse_mesh(stl, "t.stl");
  EXPECT_EQ(text.corners.size(), 4u);
  EXPECT_NEAR(volume(text), 1.0 / 6, 1e-16);
  EXPECT_NEAR(volume(parse_mesh(obj, "Cube.OBJ")), 8, 1e-14);
  const Mesh ball = sphere(24), read = parse_mesh(binary_stl(ball), "ball.stl");
  EXPECT_EQ(read.triangles.size(), ball.triangles.size());
  EXPECT_LT(read.corners.size(), 1200u) << "corners are joined, 24 times 48 and a few by rounding";
  EXPECT_NEAR(volume(read), volume(ball), 1e-7) << "floats";
  for (const char* faces : {triangles, polylist}) {
    const Mesh two = parse_mesh(collada(faces), "t.dae");
    EXPECT_NEAR(volume(two), (1 + 8) / 48.0, 1e-15) << faces;
    EXPECT_NEAR(two.corners[1][1], 0.5, 1e-15) << "turned by 90 degrees about z";
    EXPECT_NEAR(two.corners[1][0], 1, 1e-15) << "and moved by 1 m";
  }
}

TEST(Mesh, ACoarserOneHasNearlyTheSameVolume) {
  const Mesh fine = sphere(150);
  ASSERT_GT(fine.triangles.size(), 80000u);
  for (const size_t most : {6000u, 500u}) {
    const Mesh coarse = simplified(fine, most);
    EXPECT_LE(coarse.triangles.size(), most);
    EXPECT_GT(coarse.triangles.size(), most / 4) << "no coarser than it has to be";
    std::printf("  %zu of %zu triangles: %.2f of the volume\n", coarse.triangles.size(),
                fine.triangles.size(), volume(coarse) / volume(fine));
    EXPECT_NEAR(volume(coarse) / volume(fine), 1,
                most == 500 ? 0.1 : 0.04);  // 0.06, 0.025: corners move inwards
  }
  EXPECT_EQ(simplified(sphere(10), 6000).corners.size(), sphere(10).corners.size()) << "as it is";
}

TEST(Mesh, WhatIsDamagedIsRefused) {
  const auto why = [](const std::string& bytes, const char* name) {
    return refusal([&] { parse_mesh(bytes, name); });
  };
  std::string cut = binary_stl(sphere(4));
  cut.replace(0, 5, "cubic");
  cut.pop_back();
  EXPECT_EQ(why(cut, "a.stl"), "a.stl: it is cut off or no STL file: 2483 bytes for 48 triangles");
  EXPECT_EQ(why("solid a\nvertex 1 2\n", "a.stl"), "a.stl:2: '', expected three numbers");
  EXPECT_EQ(why("solid a\nvertex 1 2 nan\n", "a.stl"), "a.stl:2: 'nan', expected three numbers");
  EXPECT_EQ(why("solid a\nendsolid\n", "a.stl"), "a.stl: it has no triangles");
  EXPECT_EQ(why("v 0 0 0\nf 1 2 3\n", "a.obj"),
            "a.obj:2: '2', expected one of the 1 corners before it");
  EXPECT_EQ(why("", "a.3ds"), "a.3ds: a mesh of kind '.3ds', expected .stl, .obj or .dae");
  EXPECT_NE(why("<a>", "a.dae").find("a.dae: it is no XML"), std::string::npos);
  EXPECT_EQ(why("<a/>", "a.dae"), "a.dae: it is no COLLADA file");
  std::string far = collada(triangles);
  far.replace(far.find("1 0 2 0 3 0<"), 11, "1 0 2 0 4 0");
  EXPECT_EQ(why(far, "a.dae"), "a.dae: a face names corner 4 of 4");
  EXPECT_EQ(
      why("<COLLADA><library_visual_scenes><visual_scene><node id='n'><instance_node url='#n'/>"
          "<instance_node url='#n'/></node></visual_scene></library_visual_scenes></COLLADA>",
          "a.dae"),
      "a.dae: its nodes are too many, too deep or within themselves");
}

TEST(Mesh, FilesAreFoundAsAModelNamesThem) {
  TemporaryFolder folder;
  const fs::path top = folder / "robots/arm", urdf = top / "urdf";
  fs::create_directories(urdf);
  fs::create_directories(top / "meshes");
  write_bytes(top / "meshes/link.stl", stl);
  write_bytes(urdf / "beside.stl", stl);
  const auto found = [&](const std::string& name) { return mesh_file(name, {urdf}); };
  EXPECT_EQ(found("package://arm/meshes/link.stl"), top / "meshes/link.stl");
  EXPECT_EQ(found("../meshes/link.stl"), urdf / "../meshes/link.stl");
  EXPECT_EQ(found("beside.stl"), urdf / "beside.stl");
  EXPECT_EQ(found("file://" + (urdf / "beside.stl").string()), urdf / "beside.stl");
  EXPECT_EQ(found("package://leg/meshes/link.stl"), fs::path());
  EXPECT_EQ(mesh_file("beside.stl", {}), fs::path());
  const fs::path here = fs::current_path();  // a model file named without a folder
  fs::current_path(urdf);
  EXPECT_EQ(mesh_file("package://arm/meshes/link.stl", {""}), top / "meshes/link.stl");
  EXPECT_EQ(mesh_file("beside.stl", {""}), "beside.stl");
  fs::current_path(here);
  setenv("ROS_PACKAGE_PATH", ("/nowhere:" + (folder / "robots").string()).c_str(), 1);
  EXPECT_EQ(mesh_file("package://arm/meshes/link.stl", {}), top / "meshes/link.stl");
  unsetenv("ROS_PACKAGE_PATH");

  MeshShelf shelf({urdf}), none({});
  EXPECT_EQ(shelf.index("beside.stl"), 0u);
  EXPECT_EQ(shelf.index("package://arm/meshes/link.stl"), 1u);
  EXPECT_EQ(shelf.index("beside.stl"), 0u) << "each once";
  EXPECT_EQ(shelf.missing(), "");
  EXPECT_FALSE(shelf.index("lost.stl"));
  EXPECT_EQ(shelf.missing(), "1 of 3 meshes of the model are not shown: 'lost.stl' was not found");
  EXPECT_EQ(shelf.json().size(), 2u);
  EXPECT_FALSE(none.index("beside.stl"));
  EXPECT_NE(none.missing().find("--models FOLDER"), std::string::npos);
}

}  // namespace
}  // namespace porthos::report::mesh_test
