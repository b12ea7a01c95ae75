// MuJoCo (Todorov and others 2012): soft contacts without restitution, elliptic cones, conjugate
// gradients. Its buffers, whose sizes are 32-bit numbers of bytes, just hold 1000 balls.
#include "bench/heap/heap.h"

#include <mujoco/mujoco.h>
#include <cstring>
#include <string>
int main(int, char** argv) {
  const heap::Heap heap(argv);
  const double h = heap.step;
  char text[600];
  std::snprintf(
      text, sizeof text,
      "<mujoco><size njmax='%d' nconmax='%d' nstack='%d'/><option timestep='%g' gravity='0 0 %g' "
      "solver='CG' jacobian='sparse' cone='elliptic' iterations='100'></option><default><geom "
      "friction='%g 0 0' condim='3'/></default><worldbody>",
      int(8.25 * heap.n), int(2.75 * heap.n), int(11000 * heap.n), h, -heap.g, heap.friction);
  std::string xml = text;
  const double L = heap.width;
  const char* planes[] = {"0 0 0' zaxis='0 0 1", "0 0 0' zaxis='1 0 0", "L 0 0' zaxis='-1 0 0",
                          "0 0 0' zaxis='0 1 0", "0 L 0' zaxis='0 -1 0"};
  for (std::string p : planes) {
    if (auto at = p.find('L'); at != p.npos) p.replace(at, 1, std::to_string(L));
    xml += "<geom type='plane' size='0 0 1' pos='" + p + "'/>";
  }
  for (const auto& p : heap.start) {
    std::snprintf(
        text, sizeof text,
        "<body pos='%.9g %.9g %.9g'><freejoint/><geom type='sphere' size='0.1' mass='1'/></body>",
        p[0], p[1], p[2]);
    xml += text;
  }
  xml += "</worldbody></mujoco>";
  mjVFS vfs;
  mj_defaultVFS(&vfs);
  mj_makeEmptyFileVFS(&vfs, "m.xml", int(xml.size()));
  std::memcpy(vfs.filedata[0], xml.data(), xml.size());
  char error[500] = "";
  mjModel* m = mj_loadXML("m.xml", &vfs, error, 500);
  if (!m) {
    std::printf("%s\n", error);
    return 1;
  }
  mjData* d = mj_makeData(m);
  heap::run(
      "mujoco", heap, [&] { mj_step(m, d); },
      [&](std::vector<heap::Place>& p, double& H) {
        H = 0;
        for (size_t i = 0; i < heap.n; ++i) {
          const double *q = d->qpos + 7 * i, *v = d->qvel + 6 * i;
          p[i] = {q[0], q[1], q[2]};
          for (int k = 0; k < 3; ++k)
            H += 0.5 * v[k] * v[k] + 0.5 * heap.inertia * v[3 + k] * v[3 + k];
          H += heap.g * q[2];
        }
      });
  std::printf("  contacts %d, solver iterations %d\n", d->ncon, d->solver_iter);
}
