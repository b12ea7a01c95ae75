// Cart-pole: from 1.2 rad off upright back to upright, the cart where it is told to be. One smooth
// law.

#include <cstdio>
#include <exception>

#include "energy_shaping/certify/certify.h"
#include "energy_shaping/matching/designs.h"
#include "examples/show.h"

using namespace porthos::energy_shaping;
using porthos::scene::column;

int main(int argc, char** argv) try {
  const auto loop = cart_pole({.a = 10, .b = 1, .k = 1, .m22 = 0.1, .P = 1, .kv = 3, .q2_rest = 1});

  CertifyOptions o{.region = loop->options().region, .starts = {{1.2, 0, 0, 0}}};
  o.periods = {0, 0.005};
  o.run.duration = 30;
  o.run.step = 0.0025;
  for (const double a : {8.0, 9.0, 11.0, 12.0}) o.plants.push_back(cart_pole_plant({.a = a}));
  const Certificate certificate = certify(*loop, o);

  const Run run = simulate(*loop, o.starts[0], o.run);
  o.run.period = 0.05;
  const Run slow = simulate(*loop, o.starts[0], o.run);
  auto above = [](const Run& r) {
    auto H = r.H;
    for (double& h : H) h -= 30;
    return H;
  };
  return show(
      argc, argv, certificate,
      porthos::scene::trace_plot(
          {{"pole [rad], cart [m]",
            {column("pole", run.t, run.x, 0), column("cart", run.t, run.x, 1)}},
           {"H_d above rest [J]",
            {{"continuous", run.t, above(run)}, {"held for 50 ms", slow.t, above(slow)}},
            true},
           {"input [m/s²]",
            {column("continuous", run.t, run.u, 0), column("held for 50 ms", slow.t, slow.u, 0)}}},
          "Cart-pole by interconnection and damping assignment",
          "from 1.2 rad off upright; the cart is to stop at 1 m"));
} catch (const std::exception& e) {  // one sentence: what, where, what was expected
  std::fprintf(stderr, "%s\n", e.what());
  return 1;
}
